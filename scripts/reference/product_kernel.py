"""Reference values for kernel regression in two columns, by statsmodels' KernelReg.

Gaussian product kernel, local constant and local linear, and the leave-one-out score.

Run: python3 scripts/reference/product_kernel.py   (needs NumPy and statsmodels)
Used by: crates/flexure/src/nonlinearity/kernel/product/tests/oracle.rs
"""

import numpy as np
from statsmodels.nonparametric.kernel_regression import KernelReg

N = 60
i = np.arange(N)
a = ((37 * i) % 101) / 50.0 - 1.0
b = ((61 * i + 5) % 97) / 40.0
y = a * a - np.sin(b) + ((53 * i * i + 7 * i) % 97) / 97.0
BANDWIDTHS = [0.35, 0.5]
at = np.array([[-0.9, 0.2], [-0.4, 2.0], [0.05, 1.1], [0.55, 0.7], [0.9, 2.3]])


def show(name, values):
    print(f"{name}: [" + ", ".join(repr(float(v)) for v in np.atleast_1d(values)) + "]")


for kind in ["lc", "ll"]:
    fit = KernelReg(y, [a, b], "cc", reg_type=kind, bw=BANDWIDTHS)
    show(kind, fit.fit(at)[0])
    show(kind + " leave-one-out", fit.cv_loo(np.array(BANDWIDTHS), fit.est[kind]))
