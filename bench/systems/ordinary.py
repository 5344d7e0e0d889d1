#!/usr/bin/env python3
"""Hammerstein systems as users have them: how near `flexure identify` without options comes to the noise of fresh data.

    bench/systems/run --help                                             makes the environment
    target/bench-systems-venv/bin/python bench/systems/ordinary.py       400 systems, two minutes
    ... ordinary.py --binary OTHER/flexure --systems 200-400 --list     another program, and every system that it misses

A system follows from its number: one of eight nonlinearities, one of nine inputs (white, held, levels, multisine, ramps, a sweep, ...), one of
four linear parts with time constants of 2 to 60 samples, with and without delay, white or coloured noise of 1, 3 or 10 %, 1000 to 6000
samples. The last quarter is fresh; its input stays within the range of the rest.

The figure of a system is the error of the free run on the fresh quarter over the error of the true system there, which is the noise: 1 is
the best there is.
"""

import argparse
import json
import pathlib
import subprocess
import tempfile

import numpy as np
from scipy.signal import cont2discrete, lfilter

NONLINEARITIES = {
    "dead zone": lambda u: np.sign(u) * np.maximum(np.abs(u) - 1.2, 0),
    "saturation": lambda u: np.clip(u, -2, 2),
    "cubic": lambda u: u + 0.1 * u**3,
    "one side": lambda u: np.maximum(u, 0),
    "tanh": lambda u: np.tanh(u / 1.5),
    "quantizer": lambda u: np.round(u / 1.5) * 1.5,
    "friction": lambda u: u * 0.5 + 2 * np.sign(u),
    "parabola": lambda u: u + 0.4 * u * u,
}
INPUTS = ["white", "held", "held for 5 to 80", "levels", "multisine", "autoregression", "walk", "ramps", "sweep"]
JUMPS = ("quantizer", "friction")


def held(values, counts, n):
    return np.repeat(values, counts)[:n]


def signal(kind, n, random):
    if kind == "white":
        return random.uniform(-5, 5, n)
    if kind == "held":
        return held(random.uniform(-5, 5, n // 20 + 1), 20, n)
    if kind == "held for 5 to 80":
        counts = random.integers(5, 80, n // 5 + 1)
        return held(random.uniform(-5, 5, len(counts)), counts, n)
    if kind == "levels":
        return held(random.integers(-5, 6, n // 20 + 1).astype(float), 20, n)
    if kind == "multisine":
        lines = np.arange(1, 1 + random.integers(20, 90))
        phases = random.uniform(0, 2 * np.pi, len(lines))
        u = np.cos(4 * np.pi / n * np.outer(np.arange(n), lines) + phases).sum(axis=1)
        return 2 * u / np.std(u)
    if kind == "autoregression":
        return 2 * lfilter([np.sqrt(1 - 0.95**2)], [1, -0.95], random.standard_normal(n))
    if kind == "walk":
        walk = np.cumsum(random.standard_normal(n))
        walk -= np.convolve(walk, np.ones(301) / 301, "same")
        return 2 * walk / np.std(walk)
    if kind == "ramps":
        corners = np.arange(0, n + 60, random.integers(30, 60))
        return np.interp(np.arange(n), corners, random.uniform(-5, 5, len(corners)))
    share = np.arange(n) / n
    return 4 * np.sin(2 * np.pi * n * (0.0005 * share + 0.02 * share**2))


def linear_part(kind, random):
    if kind == "one pole":
        continuous = [1], [np.exp(random.uniform(np.log(4), np.log(60))), 1]
    elif kind == "two poles":
        first, second = np.exp(random.uniform(np.log(2), np.log(40), 2))
        continuous = [1], np.polymul([first, 1], [second, 1])
    elif kind == "resonance":
        w, damping = 2 * np.pi / random.uniform(15, 80), random.uniform(0.1, 0.5)
        continuous = [w * w], [1, 2 * damping * w, w * w]
    else:
        slow = random.uniform(4, 40)
        continuous = [slow * random.uniform(0.2, 0.6), 1], [slow * slow * 0.1, slow, 1]
    b, a, _ = cont2discrete([np.asarray(part, float) for part in continuous], 1.0)
    return b.ravel(), a


def system(number):
    """The name of the record, its input and output, the first fresh sample and the noise there."""
    random = np.random.default_rng(number)

    def one_of(values):
        return values[random.integers(len(values))]

    n = int(one_of([1000, 2000, 3000, 6000]))
    nonlinearity, of_input = one_of(list(NONLINEARITIES)), one_of(INPUTS)
    linear = one_of(["one pole", "two poles", "resonance", "a zero"])
    noise, level, delay = one_of(["white", "autoregression", "poles"]), one_of([0.01, 0.03, 0.1]), one_of([0, 0, 0, 3, 10])
    # If values are held, few lie near a jump, and its place stays unknown.
    if of_input.startswith("held") and nonlinearity in JUMPS:
        nonlinearity = "dead zone"
    u, fresh = signal(of_input, n, random), n - n // 4
    u[fresh:] = np.clip(u[fresh:], u[:fresh].min(), u[:fresh].max())
    b, a = linear_part(linear, random)
    between = np.concatenate([np.zeros(delay), NONLINEARITIES[nonlinearity](u)[: n - delay]])
    y = lfilter(b, a, between)
    e = random.standard_normal(n)
    if noise == "autoregression":
        e = lfilter([np.sqrt(1 - 0.9**2)], [1, -0.9], e)
    elif noise == "poles":
        e = lfilter([1], a, e)
    e *= level * np.std(y) / np.std(e)
    what = f"{nonlinearity}, {linear}, delay {delay}, input {of_input}, noise {noise} {level:.0%}, n = {n}"
    return what, u, y + e, fresh, e[fresh:]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--binary", default="target/release/flexure")
    parser.add_argument("--systems", default="0-400", help="the first, and the one behind the last")
    parser.add_argument("--list", action="store_true", help="print the systems whose error is over twice the noise")
    arguments = parser.parse_args()
    first, end = map(int, arguments.systems.split("-"))
    ratios, holding = [], 0
    with tempfile.TemporaryDirectory() as folder:
        record = pathlib.Path(folder) / "record.csv"
        for number in range(first, end):
            what, u, y, fresh, e = system(number)
            np.savetxt(record, np.column_stack([u, y]), "%.9g", ",", header="u,y", comments="")
            command = [arguments.binary, "identify", record, "--input", "u", "--output", "y", "--json"]
            found = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
            # The fit is 1 - (error)/(standard deviation).
            error = (1 - found["fit_percent"] / 100) * np.std(y[fresh:])
            ratios.append(error / np.std(e))
            holding += bool(found["holds"]) and ratios[-1] > 2
            if arguments.list and ratios[-1] > 2:
                print(f"{number}: {what}: {ratios[-1]:.3g}, order {found['order']}, delay {found['delay']}, holds {found['holds']}")
    ratios = np.array(ratios)
    over = ", ".join(f"{np.mean(ratios > limit):.1%} over {limit}" for limit in (1.1, 1.3, 2))
    print(f"{len(ratios)} systems: error over noise {np.median(ratios):.3f} in the median, {over}; {holding} of those over 2 are said to hold")


main()
