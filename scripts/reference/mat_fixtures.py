"""Writes the MAT v5 fixtures of crates/flexure-io/tests/data with SciPy.

Usage: python scripts/reference/mat_fixtures.py
"""

import pathlib

import numpy as np
import scipy.io

OUT = pathlib.Path(__file__).resolve().parents[2] / "crates/flexure-io/tests/data"
N = 6
k = np.arange(N)
signals = {
    "t": (k / 8.0).reshape(-1, 1),  # a column
    "u": (np.sin(k) * 1e-3).reshape(1, -1),  # a row
    "counts": (k - 3).astype(np.int16).reshape(-1, 1),
    "single": (k / 4).astype(np.float32).reshape(-1, 1),
    "on": (k % 2 == 0).reshape(-1, 1),  # logical
    "wide": (k.astype(np.int64) - 2**53 + 5).reshape(-1, 1),  # all exact in double
    "too_wide": (k.astype(np.uint64) + np.uint64(2**63)).reshape(-1, 1),  # some not exact
}
rest = {
    "gain": 35.15,
    "label": "motor",
    "setup": {"mass": 1.0, "name": "arm"},
    "pair": np.arange(2.0 * N).reshape(N, 2),
    "phasor": (k + 1j * k).reshape(-1, 1),
    "nothing": np.zeros((0, 0)),
    "cells": np.array([1.0, "a"], dtype=object),
}


def save(name, variables, **options):
    path = OUT / name
    scipy.io.savemat(path, variables, **options)
    content = bytearray(path.read_bytes())
    # The header's date would make every run's files differ.
    content[:116] = b"MATLAB 5.0 MAT-file, fixture".ljust(116)
    path.write_bytes(content)


save("signals.mat", signals | rest)
save("signals_compressed.mat", signals | rest, do_compression=True)
save("unequal.mat", {"u": np.arange(4.0), "y": np.arange(5.0)})
log = {"t": signals["t"], "u": signals["u"], "Kp": 2.5, "limits": np.arange(3.0), "note": "run 1", "info": {"rig": 3.0}, "none": np.zeros((0, 0))}
for name, packed in [("structure.mat", False), ("structure_compressed.mat", True)]:
    save(name, {"log": log, "Ts": 0.125, "date": "2026-11-03"}, do_compression=packed)
save("structures.mat", {"u": np.arange(6.0), "a": {"u": k + 1.0, "y": k + 2.0, "gain": 1.5}, "b": {"y": k + 3.0, "z": k + 4.0}, "gain": 2.0})
on = np.random.default_rng(1).integers(-1, 2, 200)
save("untimed.mat", {"u": on.astype(np.int8), "y": (on + np.roll(on, 1)).astype(np.int8), "fs": 8.0, "date": "2026-11-03"})
runs = np.zeros((1, 2), dtype=[("u", object)])
save("structure_array.mat", {"runs": runs, "empty": np.zeros((0, 0), dtype=[("u", object)])})
save("matrix_only.mat", {"pair": np.arange(4.0).reshape(2, 2), "gain": 2.0})


def element(kind, data, order):
    size = np.array([kind, len(data)], order + "u4").tobytes()
    return size + data + b"\0" * (-len(data) % 8)


def by_hand(name, order):
    """Doubles stored as int16 and uint8, as MATLAB does to save space and SciPy does not."""
    out = b"MATLAB 5.0 MAT-file, fixture".ljust(124)
    out += np.array([0x0100], order + "u2").tobytes() + (b"IM" if order == "<" else b"MI")
    for label, kind, values in [
        (b"u", 3, np.array([-300, 0, 7, 32767], order + "i2")),
        (b"y", 2, np.array([0, 1, 200, 255], "u1")),
    ]:
        # The name in the small format, whose length and type share a word.
        small = np.array([len(label) << 16 | 1], order + "u4").tobytes() + label.ljust(4, b"\0")
        body = element(6, np.array([6, 0], order + "u4").tobytes(), order)
        body += element(5, np.array([4, 1], order + "i4").tobytes(), order)
        body += small + element(kind, values.tobytes(), order)
        out += element(14, body, order)
    (OUT / name).write_bytes(out)
    read = scipy.io.loadmat(OUT / name)
    assert read["u"].ravel().tolist() == [-300, 0, 7, 32767]
    assert read["y"].ravel().tolist() == [0, 1, 200, 255]


by_hand("narrow_little.mat", "<")
by_hand("narrow_big.mat", ">")
