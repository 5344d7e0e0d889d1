"""Runs Flexure and its peers in turn on the common Hammerstein job and prints one table.

The job: u uniform on [-2, 2], a dead zone [-0.5, 0.7], (z^-1 + 0.5 z^-2) / (1 - 1.5 z^-1 + 0.7 z^-2), white output noise
at 20 dB. Columns: processor time, medians over the seeds; NL, the relative L2 error of the nonlinearity on [-1.9, 1.9]
after the best affine alignment; the fit on a fresh noiseless record of 10,000 samples, the first 200 left out. Flexure's
time is that of the whole process, reading and writing included; a peer's that of its fit alone. Flexure is told nothing
but the two columns.
"""

import argparse
import json
import resource
import subprocess
import sys
from pathlib import Path

import numpy as np
from scipy.signal import lfilter

ROOT = Path(__file__).resolve().parents[2]
PEERS = ["jax-sysid", "SysIdentPy"]
B, A = [0.0, 1.0, 0.5], [1.0, -1.5, 0.7]
SETTLED = 200


def dead_zone(u):
    return np.maximum(u - 0.7, 0) + np.minimum(u + 0.5, 0)


class Job:
    """A record, a fresh one and the grid, as files."""

    def __init__(self, folder, n, seed):
        rng = np.random.default_rng([n, seed])
        u = rng.uniform(-2, 2, n)
        clean = lfilter(B, A, dead_zone(u))
        y = clean + clean.std() / 10 * rng.normal(size=n)
        self.fresh = rng.uniform(-2, 2, 10_000)
        self.truth = lfilter(B, A, dead_zone(self.fresh))
        self.grid = np.linspace(-1.9, 1.9, 1001)
        self.folder = folder
        np.save(folder / "record.npy", [u, y])
        np.save(folder / "fresh.npy", self.fresh)
        np.save(folder / "grid.npy", self.grid)
        for name, columns in [("record.csv", {"u": u, "y": y}), ("fresh.csv", {"u": self.fresh})]:
            table = np.column_stack(list(columns.values()))
            np.savetxt(folder / name, table, "%.17g", ",", header=",".join(columns), comments="")

    def fit(self, output):
        error, truth = (np.asarray(output) - self.truth)[SETTLED:], self.truth[SETTLED:]
        return 100 * (1 - np.linalg.norm(error) / np.linalg.norm(truth - truth.mean()))

    def curve_error(self, curve):
        if curve is None:
            return np.nan
        phi = dead_zone(self.grid)
        basis = np.column_stack([curve, np.ones_like(phi)])
        aligned = basis @ np.linalg.lstsq(basis, phi, rcond=None)[0]
        return np.linalg.norm(aligned - phi) / np.linalg.norm(phi)


def flexure(job, _limit):
    binary, folder = ROOT / "target/release/flexure", job.folder
    model, out = folder / "model.json", folder / "out.csv"
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    columns = ["--input", "u", "--output", "y"]
    identify = [binary, "identify", folder / "record.csv", *columns, "-o", model, "--json"]
    subprocess.run(identify, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    predict = [binary, "predict", model, folder / "fresh.csv", "--input", "u", "-o", out, "--json"]
    subprocess.run(predict, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    table = json.loads(model.read_text())["block"]["series"][0]["static"]
    curve = np.interp(job.grid, table["x"], table["y"])
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    output = np.genfromtxt(out, delimiter=",", names=True)["y"]
    return seconds, job.fit(output), job.curve_error(curve)


def peer(name):
    def run(job, limit):
        files = [job.folder / f for f in ("record.npy", "fresh.npy", "grid.npy")]
        command = [sys.executable, Path(__file__).with_name("peers.py"), name, *files]
        done = subprocess.run(command, check=True, capture_output=True, text=True, timeout=limit)
        found = json.loads(done.stdout.splitlines()[-1])
        return found["seconds"], job.fit(found["output"]), job.curve_error(found["curve"])

    return run


def main():
    parser = argparse.ArgumentParser(prog="bench/systems/run", description=__doc__.splitlines()[0])
    parser.add_argument("--sizes", metavar="N,N", default="10000", help="samples (10000)")
    parser.add_argument("--seeds", type=int, metavar="K", default=3, help="records of each size (3)")
    parser.add_argument("--limit", type=float, metavar="S", default=900, help="longest time of one peer's fit (900 s)")
    parser.add_argument("--peers", metavar="A,B", default=",".join(PEERS), help=f"of {', '.join(PEERS)}")
    options = parser.parse_args()
    unknown = set(filter(None, options.peers.split(","))) - set(PEERS)
    if unknown:
        parser.error(f"unknown: {', '.join(sorted(unknown))}")
    contestants = {"Flexure": flexure} | {name: peer(name) for name in PEERS if name in options.peers.split(",")}
    folder = ROOT / "target/bench-data/systems"
    folder.mkdir(parents=True, exist_ok=True)
    print("| n | who | CPU s | CPU ratio | NL | NL ratio | fit % | worst fit % |\n|---|---|---|---|---|---|---|---|")
    for n in (int(float(size)) for size in options.sizes.split(",")):
        results = {name: [] for name in contestants}
        for seed in range(options.seeds):
            job = Job(folder, n, seed)
            for name in list(results):
                try:
                    results[name].append(contestants[name](job, options.limit))
                except subprocess.TimeoutExpired:
                    print(f"| {n} | {name} | over {options.limit:.0f} s | - | - | - | - | - |", flush=True)
                    del results[name]
        ours = np.median(results["Flexure"], axis=0)
        for name, found in results.items():
            seconds, fit, curve = np.median(found, axis=0)
            nonlinearity = "- | -" if np.isnan(curve) else f"{curve:.4f} | {curve / ours[2]:.1f}"
            worst = min(row[1] for row in found)
            print(f"| {n} | {name} | {seconds:.3g} | {seconds / ours[0]:.0f} | {nonlinearity} | {fit:.2f} | {worst:.2f} |", flush=True)


main()
