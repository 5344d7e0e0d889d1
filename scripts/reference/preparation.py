"""Reference values for the preparation of records, by SciPy.

Run: python3 scripts/reference/preparation.py   (needs SciPy)
Used by: crates/flexure/src/preparation/reference_tests.rs
"""

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import butter, detrend, sosfiltfilt

i = np.arange(60)
# Exact in float64, so that Rust makes the same numbers.
x = ((37 * i * i + 11 * i) % 101) / 64.0 + 0.125 * i
t = 0.5 * i + ((53 * i) % 64) / 256.0  # steps from 0.26 to 0.71


def literal(name: str, values: np.ndarray) -> None:
    print(f"const {name}: [f64; {len(values)}] = [")
    for value in values:
        print(f"    {value!r},".replace("np.float64(", "").replace(")", ""))
    print("];")


for name, order, cutoff, n in [("ORDER_4", 4, 2.0, 60), ("ORDER_8", 8, 4.5, 60), ("SLOW", 4, 0.05, 60), ("ORDER_2", 2, 3.0, 60)]:
    literal(name, sosfiltfilt(butter(order, cutoff, fs=10.0, output="sos"), x[:n])[::6])
# Shorter than the usual margin of 15 samples.
literal("SHORT", sosfiltfilt(butter(4, 2.0, fs=10.0, output="sos"), x[:9], padlen=8))
at = 1.0 + 0.375 * np.arange(74)
literal("SPLINE", CubicSpline(t, x)(at)[::6])
literal("DETRENDED", detrend(x)[::6])
