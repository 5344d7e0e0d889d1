"""Minima of the penalised sum of squares of a network with one hidden layer, by SciPy's least_squares.

Residuals sqrt(w) (u - m(z)) and, for the decay, sqrt(decay) times every parameter but the first; from the same
start as the test, by MINPACK's Levenberg-Marquardt, polished by trust regions with central differences.

Run: python3 scripts/reference/network.py   (needs NumPy and SciPy)
Used by: crates/flexure/src/nonlinearity/network/tests.rs
"""

import numpy as np
from scipy.optimize import least_squares

N = 120
k = np.arange(N)


def cost(d, units, decay):
    z = np.stack([((37 + 16 * j) * k % 101) / 50.0 - 1.0 for j in range(d)])
    u = np.sin(3 * z[0]) + z[d - 1] ** 2 + 0.3 * np.sin(12.9898 * k)
    root = np.sqrt(1.0 + k % 3)
    count = 1 + units * (d + 2)
    start = np.sin(2.3 * np.arange(count) + 1.3)

    def residuals(theta):
        c, inner, *v = theta[1:].reshape(units, d + 2).T
        hidden = np.tanh(inner[:, None] + np.array(v).T @ z)
        return np.concatenate([root * (u - theta[0] - c @ hidden), np.sqrt(decay) * theta[1:]])

    exact = dict(xtol=1e-15, ftol=1e-15, gtol=1e-15)
    end = least_squares(residuals, start, method="lm", max_nfev=400_000, **exact)
    end = least_squares(residuals, end.x, method="trf", jac="3-point", max_nfev=20_000, **exact)
    return float(2 * end.cost)


for d, units, decay in [(1, 2, 0.01), (1, 4, 0.1), (2, 3, 0.05), (2, 5, 1.0)]:
    print(f"({d}, {units}, {decay}, {cost(d, units, decay)!r}),")
