#!/usr/bin/env python3
"""Wiener and Wiener-Hammerstein systems with a delay, drawn at random: how often delay and orders are found.

    python bench/systems/delays.py --binary target/release/flexure     # needs numpy and scipy

A front of one or two poles behind a delay of 4, 7 or 10 samples, one of five nonlinearities, and for Wiener-Hammerstein a back of one or
two poles. 5000 samples, the input white or coloured (a pole at 0.7), white noise at the output. One line for each structure.
"""

import argparse
import json
import subprocess
import tempfile
from pathlib import Path

import numpy as np
from scipy.signal import lfilter

SAMPLES = 5000
NONLINEARITIES = [
    lambda x: np.clip(x, -0.8, 0.8),
    lambda x: np.sign(x) * np.maximum(abs(x) - 0.5, 0),
    lambda x: np.tanh(1.2 * x) + 0.1 * x * x,
    lambda x: x + 0.3 * x**2 + 0.1 * x**3,
    lambda x: np.where(x > 0.2, 2 * x - 0.2, x),
]


def linear(rng, order):
    """Numerator and denominator with unit static gain."""
    radius = rng.uniform(0.3, 0.9)
    if order == 1:
        a = np.array([1, -rng.choice([1, 1, -1]) * radius])
    else:
        a = np.array([1, -2 * radius * np.cos(rng.uniform(0.15, 2.2)), radius**2])
    b = np.concatenate([[1], rng.uniform(-0.6, 0.6, order - 1)])
    return b * a.sum() / b.sum(), a


def record(structure, delay, seed, snr):
    """Input, output, and the orders of the linear blocks."""
    rng = np.random.default_rng([delay, seed])
    orders = [1 + seed % 2] + [1 + seed // 2 % 2] * (structure != "wiener")
    white = rng.standard_normal(SAMPLES)
    u = white if seed % 2 else lfilter([1], [1, -0.7], white)
    w = lfilter(*linear(rng, orders[0]), np.r_[np.zeros(delay), u])[:SAMPLES]
    y = NONLINEARITIES[seed % 5](w / w.std())
    for order in orders[1:]:
        y = lfilter(*linear(rng, order), y)
    return u, y + 10 ** (-snr / 20) * y.std() * rng.standard_normal(SAMPLES), orders


def found(binary, structure, u, y):
    """The delay and the orders of the linear blocks."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "record.csv"
        np.savetxt(path, np.c_[u, y], delimiter=",", header="u,y", comments="")
        command = [binary, "identify", path, "--structure", structure, "--json"]
        result = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    blocks = [result["linear"]] if structure == "wiener" else [result["front"], result["back"]]
    leading = sum(int(np.flatnonzero(block["b"])[0]) for block in blocks)
    return leading, [block["order"] for block in blocks]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--binary", default="target/release/flexure")
    parser.add_argument("--seeds", type=int, default=10, help="systems for each delay (10)")
    parser.add_argument("--snr", type=float, nargs="+", default=[20, 30, 40], help="signal to noise in dB")
    options = parser.parse_args()
    print(f"{'structure':<20} {'dB':>4} {'systems':>8} {'delay right':>12} {'and orders':>11}")
    for structure in ["wiener", "wiener-hammerstein"]:
        for snr in options.snr:
            right = both = 0
            cases = [(delay, seed) for delay in (4, 7, 10) for seed in range(options.seeds)]
            for delay, seed in cases:
                u, y, orders = record(structure, delay, seed, snr)
                lag, poles = found(options.binary, structure, u, y)
                right += lag == delay
                both += lag == delay and poles == orders
            print(f"{structure:<20} {snr:>4.0f} {len(cases):>8} {right:>12} {both:>11}", flush=True)


if __name__ == "__main__":
    main()
