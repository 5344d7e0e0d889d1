"""Reference values for the estimators of static nonlinearities, by NumPy and SciPy.

Least squares by lstsq on the square roots of the weights; leave-one-out by a refit without each point;
the smoothing spline by scipy.interpolate.make_smoothing_spline; the spline with fewer knots from
BSpline.design_matrix and the integral of products of second derivatives; neighbours by cKDTree.

Run: python3 scripts/reference/estimators.py   (needs NumPy and SciPy)
Used by: crates/flexure/src/nonlinearity/estimator_tests/oracle.rs
"""

import math

import numpy as np
from numpy.polynomial import Polynomial
from numpy.polynomial.hermite import hermvander
from numpy.polynomial.legendre import legvander
from scipy.interpolate import BSpline, make_smoothing_spline
from scipy.spatial import cKDTree

N = 60
i = np.arange(N)
x = ((37 * i) % 101) / 50.0 - 1.0
y = x * x + ((53 * i * i + 7 * i) % 97) / 97.0
w = 1.0 + i % 3
at = np.array([-0.933, -0.411, 0.0743, 0.5527, 0.9017])
low, high = x.min(), x.max()


def show(name, values):
    print(f"{name}: [" + ", ".join(repr(float(v)) for v in np.atleast_1d(values)) + "]")


def fit(design, target, weights):
    root = np.sqrt(weights)
    return np.linalg.lstsq(design * root[:, None], target * root, rcond=None)[0]


def linear(name, design, queries, w=w):
    """Fitted values, leave-one-out and generalised scores of a weighted least-squares fit."""
    show(name, queries @ fit(design, y, w))
    keep = [np.arange(N) != j for j in range(N)]
    left = [y[j] - design[j] @ fit(design[k], y[k], w[k]) for j, k in enumerate(keep)]
    residual = y - design @ fit(design, y, w)
    gcv = np.sum(w * residual**2) / w.sum() / (1 - design.shape[1] / N) ** 2
    show(name + " scores", [np.sum(w * np.square(left)) / w.sum(), gcv])


def fourier(v):
    t = 2 * np.pi * (v - low) / (high - low)
    return np.stack([np.ones_like(t)] + [f(k * t) for k in (1, 2, 3) for f in (np.cos, np.sin)], axis=1)


def hermite(v):
    spread = np.quantile(x, [0.25, 0.75], method="averaged_inverted_cdf")
    scale = (spread[1] - spread[0]) / 1.3489795003921636
    t = (v - np.quantile(x, 0.5, method="averaged_inverted_cdf")) / scale
    norm = [math.sqrt(2.0**k * math.factorial(k) * math.sqrt(math.pi)) for k in range(7)]
    return hermvander(t, 6) / norm * np.exp(-t * t / 2)[:, None]


def spline_with_knots(count, penalty):
    """O'Sullivan's penalised spline: breakpoints by rank, Gauss quadrature of the second derivatives."""
    distinct = np.unique(x)
    d = len(distinct)
    rank = lambda k: k * (d - 1) // (count - 1)
    breaks = np.array([distinct[rank(k) if 2 * k < count else d - 1 - rank(count - 1 - k)] for k in range(count)])
    knots = np.r_[[breaks[0]] * 3, breaks, [breaks[-1]] * 3]
    design = BSpline.design_matrix(x, knots, 3).toarray()
    size = design.shape[1]
    nodes, weights = np.polynomial.legendre.leggauss(3)
    rough = np.zeros((size, size))
    for a, b in zip(breaks[:-1], breaks[1:]):
        at_nodes = 0.5 * (a + b) + 0.5 * (b - a) * nodes
        second = BSpline(knots, np.eye(size), 3).derivative(2)(at_nodes)
        rough += 0.5 * (b - a) * (second * weights[:, None]).T @ second
    normal = design.T @ (w[:, None] * design) + penalty * rough
    c = np.linalg.solve(normal, design.T @ (w * y))
    show("spline with knots", BSpline(knots, c, 3)(at))
    hat = np.linalg.solve(normal, (design * w[:, None]).T)
    leverage = np.einsum("ij,ji->i", design, hat)
    show("spline with knots df", leverage.sum())


linear("legendre", legvander((2 * x - low - high) / (high - low), 5), legvander((2 * at - low - high) / (high - low), 5))
linear("fourier", fourier(x), fourier(at))
linear("hermite", hermite(x), hermite(at), np.ones(N))
show("polynomial", Polynomial.fit(x, y, 7, w=np.sqrt(w))(at))
order = np.argsort(x)
show("smoothing spline", make_smoothing_spline(x[order], y[order], w=w[order], lam=0.02)(at))
spline_with_knots(9, 0.02)

z = ((53 * i * i + 7 * i) % 97) / 97.0
scales = np.array([x.std(), z.std()])
tree = cKDTree(np.stack([x, z], axis=1) / scales)
queries = np.stack([at, [0.2, 0.4, 0.5, 0.7, 0.31]], axis=1) / scales
show("neighbours", y[tree.query(queries, k=7)[1]].mean(axis=1))
