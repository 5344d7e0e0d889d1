"""Runs the Python package and the Rust library in turn on the same data, and prints how much time Python adds.

The results must be the same to the last digit. CPU time is the processor's, of all threads with the system's; both times are the
least of many calls, which the two processes make in turns.
"""

import argparse
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "bench"))

from contest import Limits, Process  # noqa: E402
from jobs import Contestant, dead_zone, data  # noqa: E402

WHO = [Contestant("Rust", "flexure"), Contestant("Python", "flexure-python")]
# s of a turn, within which short calls are repeated.
TURN = 0.3


def regression(n):
    """Points around a dead zone."""
    x, y, at, _ = data(dead_zone, 1, n)
    return x[0], y, at[0]


def system(n):
    """A dead zone, a lag of first order, noise."""
    rng = np.random.default_rng([2, n])
    u = rng.uniform(-2, 2, n)
    y = np.convolve(dead_zone(u), 0.3 * 0.7 ** np.arange(60))[:n] + 0.02 * rng.standard_normal(n)
    return u, y, np.zeros(1)


JOBS = {
    "local line, h = 0.1": ({"task": "regressor", "h": 0.1}, regression),
    "local line, h from the data": ({"task": "regressor"}, regression),
    "Hammerstein": ({"task": "hammerstein"}, system),
}


def main():
    parser = argparse.ArgumentParser(prog="bench/python/run", description=__doc__)
    parser.add_argument("--samples", type=float, metavar="N", default=1e6, help="of every record (1e6)")
    parser.add_argument("--rounds", type=int, default=7, help="turns of both after a first call (7)")
    options = parser.parse_args()
    work = ROOT / "target" / "bench-data"
    work.mkdir(parents=True, exist_ok=True)
    print("| work | n | CPU ms: Rust | Python | ratio | wall ms: Rust | Python | ratio |\n|---|---|---|---|---|---|---|---|")
    for name, (parameters, make) in JOBS.items():
        row(name, parameters, make(int(options.samples)), options.rounds, work)


def row(name, parameters, columns, rounds, work):
    files = {"data": work / "python.bin", "grid": work / "python-grid.bin"}
    np.vstack(columns[:2]).tofile(files["data"])
    columns[2].tofile(files["grid"])
    running = [Process(who, {**parameters, **files, "dimension": 1}, Limits(600, 8 * 2**30)) for who in WHO]
    try:
        for process in running:
            process.ready()
        for turn in range(1 + rounds):
            for process in running:
                process.run(TURN if turn else 0)
        rust, python = (process.estimates(work / "python-out.bin") for process in running)
        if not np.array_equal(rust, python):
            sys.exit(f"error: {name}: Python's numbers are not Rust's")
        cells = []
        for times in ([p.cpu for p in running], [p.wall for p in running]):
            cells += [f"{1e3 * times[0]:.1f}", f"{1e3 * times[1]:.1f}", f"{times[1] / times[0]:.3f}"]
        print(f"| {name} | {len(columns[1])} | " + " | ".join(cells) + " |", flush=True)
    finally:
        for process in running:
            process.close()


if __name__ == "__main__":
    main()
