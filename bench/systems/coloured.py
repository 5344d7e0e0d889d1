#!/usr/bin/env python3
"""Linear systems in white and coloured noise, drawn at random: how far the identified dynamics are from the true ones.

    python bench/systems/coloured.py --binary target/release/flexure     # needs numpy and scipy

A sum of one to five first-order parts and resonances behind three samples of delay; 600, 1500 or 4000 samples; the input white, slow (a pole
at 0.9) or in steps of ten samples; noise of 10, 30 or 100 % of the output, white, slow (a pole at 0.9 or 0.98) or ringing. The error is that
of the free run on the last quarter, which is not fitted, against the output without noise, in percent of that; a constant error does not
count. It is printed beside that of SciPy's least squares with the true orders and delay, the true colour of the noise, and the true parameters
as a start: no estimator knows as much.
"""

import argparse
import json
import subprocess
import tempfile
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares
from scipy.signal import lfilter

DELAY = 3
# Denominators of the noise.
NOISES = {"white": [1], "pole at 0.9": [1, -0.9], "pole at 0.98": [1, -0.98], "ringing": [1, -1.9, 0.95]}


def part(rng):
    """Numerator and denominator of a first-order part or of a resonance."""
    if rng.random() < 0.5:
        turn = 2 * np.pi * rng.uniform(0.005, 0.4)
        radius = np.exp(-rng.uniform(0.003, 0.5) * turn)
        return [0, 1], [1, -2 * radius * np.cos(turn), radius**2]
    return [1], [1, -rng.uniform(0.5, 0.99)]


def record(noise, seed):
    """Input, output without noise, output, and the denominators of the parts."""
    rng = np.random.default_rng([list(NOISES).index(noise), seed])
    n = int(rng.choice([600, 1500, 4000]))
    white = rng.uniform(-1, 1, n)
    u = {
        "white": white,
        "slow": lfilter([1], [1, -0.9], white),
        "steps": np.repeat(white, 10)[:n],
    }[rng.choice(["white", "slow", "steps"])]
    x, denominators = np.zeros(n), []
    for _ in range(rng.integers(1, 6)):
        b, a = part(rng)
        response = lfilter(b, a, u)
        x += rng.normal() * response / response.std()
        denominators.append(a)
    x = np.r_[np.zeros(DELAY), x][:n]
    e = lfilter([1], NOISES[noise], rng.standard_normal(n + 1000))[1000:]
    return u, x, x + rng.choice([0.1, 0.3, 1]) * x.std() * e / e.std(), denominators


def told(u, x, y, denominators, colour, fitted):
    """The free run of SciPy's least squares that is told all but the parameters."""
    a = np.array([1.0])
    for more in denominators:
        a = np.convolve(a, more)
    order = len(a) - 1
    columns = [lfilter(np.r_[np.zeros(DELAY + k), 1], a, u) for k in range(order)]
    start = np.linalg.lstsq(np.column_stack(columns), x, rcond=None)[0]

    def run(c):
        return lfilter(np.r_[np.zeros(DELAY), c[:order]], np.r_[1, c[order:-1]], u) + c[-1]

    def errors(c):
        with np.errstate(all="ignore"):
            return np.clip(np.nan_to_num(lfilter(colour, [1], y - run(c))[len(colour) - 1 : fitted], nan=1e3), -1e3, 1e3)

    return run(least_squares(errors, np.r_[start, a[1:], 0], x_scale="jac", max_nfev=100).x)


def flexure(binary, u, y):
    """The free run of Flexure's linear model, and the order."""
    with tempfile.TemporaryDirectory() as folder:
        path, model, run = [Path(folder) / name for name in ("record.csv", "model.json", "run.csv")]
        np.savetxt(path, np.c_[u, y], delimiter=",", header="u,y", comments="")
        command = [binary, "identify", path, "--structure", "linear", "-o", model, "--json"]
        found = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
        subprocess.run([binary, "predict", model, path, "-o", run], check=True, capture_output=True)
        return np.genfromtxt(run, delimiter=",", names=True)["predicted"], found["order"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--binary", default="target/release/flexure")
    parser.add_argument("--seeds", type=int, default=30, help="systems for each noise (30)")
    parser.add_argument("--each", action="store_true", help="print a line for each system")
    options = parser.parse_args()
    print(f"{'noise':<14} {'systems':>8} {'error, median':>14} {'told all':>9} {'ratio, median':>14} {'over 3':>7}")
    for noise, colour in NOISES.items():
        errors = []
        for seed in range(options.seeds):
            u, x, y, denominators = record(noise, seed)
            fitted = int(0.75 * len(u))
            of = lambda run: 100 * np.std((x - run)[fitted:]) / np.std(x[fitted:])
            run, order = flexure(options.binary, u, y)
            errors.append([of(run), of(told(u, x, y, denominators, colour, fitted))])
            if options.each:
                print(f"{noise:<14} {seed:>3} order {order:>2} error {errors[-1][0]:8.2f} told all {errors[-1][1]:8.2f}")
        ours, least = np.array(errors).T
        ratio = ours / least
        print(
            f"{noise:<14} {len(ours):>8} {np.median(ours):>12.2f} % {np.median(least):>7.2f} % {np.median(ratio):>14.2f} "
            f"{np.sum(ratio > 3):>7}",
            flush=True,
        )


if __name__ == "__main__":
    main()
