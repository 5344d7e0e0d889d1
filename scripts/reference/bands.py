"""Reference values for robust bias-corrected kernel bands, by NumPy.

The formulas of Calonico, Cattaneo & Farrell (2018), as in the R package nprobust (lprobust, p = degree, q = 2, deriv = 0):
Q = Rp' W_h - rho^(p+1) (Rp' W_h ((X - x)/h)^(p+1)) e_(p+1)' Gq^-1 Rq' W_b, the corrected estimate e_0' Gp^-1 Q Y and its
variance e_0' Gp^-1 Q Sigma Q' Gp^-1 e_0; for p = 0, whose bias has two terms, both are corrected. The noise variances
Sigma are given here, not estimated.

Run: python3 scripts/reference/bands.py   (needs NumPy)
Used by: crates/flexure/src/bands/robust_tests/reference.rs
"""

import numpy as np

N = 60
i = np.arange(N)
x = ((37 * i) % 101) / 50.0 - 1.0
y = x * x + ((53 * i * i + 7 * i) % 97) / 97.0
sigma2 = 0.1 + 0.5 * x * x
at = [-0.99, -0.411, 0.0743, 0.9017]
q = 2

kernels = {
    "Epanechnikov": lambda u: np.where(np.abs(u) <= 1, 1 - u * u, 0.0),
    "Triangular": lambda u: np.where(np.abs(u) <= 1, 1 - np.abs(u), 0.0),
    "Gaussian": lambda u: np.exp(-0.5 * u * u),
}


def corrected(kernel, p, h, rho, x0):
    b = h / rho
    u, v = (x - x0) / h, (x - x0) / b
    Rp, Rq = np.vander(u, p + 1, increasing=True), np.vander(v, q + 1, increasing=True)
    Wh, Wb = kernel(u), kernel(v)
    Gp, Gq = Rp.T @ (Rp * Wh[:, None]), Rq.T @ (Rq * Wb[:, None])
    Q = Rp.T * Wh
    for k in range(p + 1, q + 1):
        L = Rp.T @ (Wh * u**k)
        Q = Q - rho**k * np.outer(L, np.linalg.solve(Gq, Rq.T * Wb)[k])
    weights = np.linalg.solve(Gp, Q)[0]
    return weights @ y, np.sqrt(weights**2 @ sigma2)


for name, kernel in kernels.items():
    h = 0.25 if name == "Gaussian" else 0.6
    for p in (0, 1):
        for rho in (1.0, 0.7):
            values = [corrected(kernel, p, h, rho, x0) for x0 in at]
            print(f"(Kernel::{name}, {h}, {p}, {rho:.1f}, [{', '.join(f'[{a:.15}, {s:.15}]' for a, s in values)}]),")
