"""The coefficients of the Radau IIA method of seven stages, for crates/flexure/src/simulation/radau_tableau.rs, and solutions of two stiff
problems by SciPy's Radau, for integration_tests.rs.

Needs `mpmath` and `scipy` from PyPI:

    python3 scripts/reference/radau.py
"""

import mpmath as mp
from scipy.integrate import solve_ivp

STAGES = 7
mp.mp.dps = 50


def coefficients():
    # The nodes are the zeros of the derivative of order s - 1 of x^(s-1) (x - 1)^s (Hairer & Wanner II, section IV.5).
    poly = [mp.mpf(0)] * (STAGES - 1) + [mp.binomial(STAGES, k) * (-1) ** (STAGES - k) for k in range(STAGES + 1)]
    for _ in range(STAGES - 1):
        poly = [k * value for k, value in enumerate(poly)][1:]
    c = sorted(mp.re(root) for root in mp.polyroots(poly[::-1], maxsteps=500, extraprec=400))
    c[-1] = mp.mpf(1)
    powers = mp.matrix([[node**j for j in range(STAGES)] for node in c])
    inverse = mp.inverse(mp.matrix([[node ** (j + 1) / (j + 1) for j in range(STAGES)] for node in c]) * mp.inverse(powers))
    values, vectors = mp.eig(inverse)
    upper = sorted((k for k in range(STAGES) if mp.im(values[k]) > -1e-20), key=lambda k: mp.im(values[k]))
    columns = []
    for k in upper:
        vector = [vectors[i, k] / vectors[STAGES - 1, k] for i in range(STAGES)]
        columns.append([mp.re(x) for x in vector])
        if mp.im(values[k]) > 1e-20:
            columns.append([mp.im(x) for x in vector])
    t = mp.matrix(columns).T
    # The embedded formula has the derivative at the start with the weight 1 / (real eigenvalue), and order 7.
    unit = mp.matrix([1] + [0] * (STAGES - 1))
    error = -inverse.T * mp.inverse(powers.T) * unit
    return c, [values[k] for k in upper], error, t, mp.inverse(t)


c, values, error, t, inverse = coefficients()
print("NODES", [float(x) for x in c])
print("REAL", float(mp.re(values[0])))
print("PAIRS", [[float(mp.re(x)), float(mp.im(x))] for x in values[1:]])
print("ERROR", [float(x) for x in error])
for name, matrix in (("FROM_MODES", t), ("TO_MODES", inverse)):
    print(name, [[float(matrix[i, j]) for j in range(STAGES)] for i in range(STAGES)])


def van_der_pol(_, x):
    return [x[1], 1e6 * ((1 - x[0] ** 2) * x[1] - x[0])]


def robertson(_, x):
    slow, back, fast = 0.04 * x[0], 1e4 * x[1] * x[2], 3e7 * x[1] ** 2
    return [back - slow, slow - back - fast, fast]


for name, f, x, end in (("van der Pol", van_der_pol, [2.0, 0.0], 1.0), ("Robertson", robertson, [1.0, 0.0, 0.0], 100.0)):
    run = solve_ivp(f, (0.0, end), x, "Radau", rtol=1e-12, atol=1e-15)
    print(name, run.y[:, -1].tolist(), len(run.t) - 1, "steps")
