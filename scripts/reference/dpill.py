"""Reference values of the direct plug-in bandwidth, pasted into crates/flexure/src/selection/plug_in_tests.rs.

Needs NumPy and the port of the R package KernSmooth; run from anywhere:

    pip install numpy r2py-kernsmooth
    python3 scripts/reference/dpill.py

The samples are arithmetic, so that they are the same everywhere.
"""

import numpy as np
from r2py_kernsmooth import dpill


def sample(n, shape):
    i = np.arange(n)
    x = ((37 * i) % (2 * n + 1)) / n - 1.0
    noise = ((53 * i * i + 7 * i) % 97) / 97.0
    m = {"wave": np.sin(3.0 * x), "step": np.sign(x), "bend": np.abs(x)}[shape]
    return x + 0.2 * x**3, m + noise


for n, shape in [(30, "wave"), (61, "bend"), (200, "wave"), (200, "step"), (1000, "bend"), (5000, "wave"), (5000, "step")]:
    x, y = sample(n, shape)
    print(f'(  {n}, "{shape}", {float(dpill(x, y))!r}),')
