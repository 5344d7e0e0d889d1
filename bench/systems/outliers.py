#!/usr/bin/env python3
"""Records with outliers: the fit with and without --robust, in comparison with the record before the outliers.

    python bench/systems/outliers.py --binary target/release/flexure     # needs numpy and scipy

A dead zone, then two complex poles, 2000 samples, white noise at the output (20 dB), and outliers at random samples, each 10 to 50 standard deviations
of the output. One line for each structure and number of outliers: medians over the seeds of the fit to the output without noise and without outliers
on the last quarter, in percent, and how many outliers were found, of all.
"""

import argparse
import json
import subprocess
import tempfile
from pathlib import Path

import numpy as np
from scipy.signal import lfilter

SAMPLES = 2000


def record(seed, count):
    """Input, output without noise, with noise, and with outliers in the fitted part too."""
    rng = np.random.default_rng(seed)
    u = rng.uniform(-2, 2, SAMPLES)
    x = np.where(u > 0.7, u - 0.7, np.where(u < -0.5, u + 0.5, 0))
    truth = lfilter([0.5, 0.25], [1, -1.2, 0.52], x)
    noisy = truth + 0.1 * truth.std() * rng.standard_normal(SAMPLES)
    at = rng.choice(int(0.75 * SAMPLES), count, replace=False)
    spoiled = noisy.copy()
    spoiled[at] += rng.choice([-1, 1], count) * rng.uniform(10, 50, count) * truth.std()
    return u, truth, noisy, spoiled


def found(binary, structure, u, y, truth, *options):
    """The fit to the truth, and the number of outliers that are named."""
    with tempfile.TemporaryDirectory() as folder:
        path, model, out = (Path(folder) / name for name in ["record.csv", "model.json", "out.csv"])
        np.savetxt(path, np.c_[u, y], delimiter=",", header="u,y", comments="")
        command = [binary, "identify", path, "--structure", structure, "--json", "-o", model, *options]
        result = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
        command = [binary, "predict", model, path, "--initial-state", "steady", "-o", out]
        subprocess.run(command, check=True, capture_output=True)
        table = np.genfromtxt(out, delimiter=",", names=True)
    fresh = slice(int(0.75 * SAMPLES), None)
    error = truth[fresh] - table[table.dtype.names[-1]][fresh]
    fit = 100 * (1 - np.linalg.norm(error) / np.linalg.norm(truth[fresh] - truth[fresh].mean()))
    return fit, len(result.get("outliers", []))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--binary", default="target/release/flexure")
    parser.add_argument("--seeds", type=int, default=10, help="records for each line (10)")
    options = parser.parse_args()
    print(f"{'structure':<14} {'outliers':>8} {'before':>8} {'plain':>8} {'robust':>8} {'found':>8}")
    for structure in ["linear", "hammerstein"]:
        for count in [1, 7, 40]:
            rows = []
            for seed in range(options.seeds):
                u, truth, noisy, spoiled = record(seed, count)
                before, _ = found(options.binary, structure, u, noisy, truth)
                plain, _ = found(options.binary, structure, u, spoiled, truth)
                robust, named = found(options.binary, structure, u, spoiled, truth, "--robust")
                rows.append([before, plain, robust, 100 * named / count])
            before, plain, robust, share = np.median(rows, axis=0)
            print(f"{structure:<14} {count:>8} {before:>8.1f} {plain:>8.1f} {robust:>8.1f} {share:>6.0f} %", flush=True)


if __name__ == "__main__":
    main()
