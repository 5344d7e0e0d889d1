"""The jobs, who does them, and the data.

A job is a task of the workers (`peers.py`, `rust/src`) with its parameters, on one of three known functions. All
contestants of a job and a size get the same data. One with a tolerance computes the very quantity that Flexure
does, and must agree with it so far, in the unit of y; the others answer the same question in another way.
"""

from dataclasses import dataclass, field

import numpy as np

POINTS = 1000  # of evaluation
NOISE = 0.1


def dead_zone(x):
    return np.maximum(x - 0.7, 0) + np.minimum(x + 0.5, 0)


def plane(x1, x2):
    return np.sin(3 * x1) + x2**2


def space(x1, x2, x3):
    return np.sin(3 * x1) + x2**2 + np.abs(x3)


def data(truth, dimension, n):
    """Columns of x, uniform on [-2, 2], and y; the points of evaluation and the truth there."""
    rng = np.random.default_rng([1, dimension, n])
    x = rng.uniform(-2, 2, (dimension, n))
    y = truth(*x) + NOISE * rng.standard_normal(n)
    # In several variables the points stay away from the borders, whose errors would hide all others.
    at = np.linspace(-2, 2, POINTS)[None, :] if dimension == 1 else rng.uniform(-1.7, 1.7, (dimension, POINTS))
    return x, y, at, truth(*at)


@dataclass(frozen=True)
class Contestant:
    label: str
    who: str  # a key of `peers.PEERS`, or one of the Rust contestants
    tolerance: float | None = None
    threads: int = 1
    changes: dict = field(default_factory=dict)  # of the job's parameters

    @property
    def ours(self):
        return self.who == "flexure"

    @property
    def rust(self):
        return self.who in ("flexure", "fdars")


@dataclass(frozen=True)
class Job:
    name: str
    title: str
    parameters: dict
    peers: list
    quick: list  # sizes
    full: list
    truth: object = dead_zone
    dimension: int = 1
    estimates: bool = True  # of the function; otherwise one number, which has no error to speak of

    @property
    def contestants(self):
        # The first is the one that the others are compared with. Its result does not depend on the threads.
        return [Contestant("Flexure", "flexure"), Contestant("Flexure, 2 threads", "flexure", 0.0, 2), *self.peers]


EXACT = 1e-8
LINE = [10_000, 100_000, 1_000_000, 10_000_000]
SHORT = [10_000, 100_000]

# scikit-learn weighs by the distance, statsmodels by Gaussians about as wide: the same question, other estimates.
PRODUCT = [
    Contestant("SciPy k-d tree", "scipy", EXACT),
    Contestant("scikit-learn, radius", "sklearn"),
    Contestant("statsmodels KernelReg", "statsmodels", changes={"h": 0.1}),
]

JOBS = [
    Job(
        "kernel",
        "local constant, Epanechnikov, h = 0.1",
        {"task": "kernel", "kernel": "epanechnikov", "degree": 0, "h": 0.1},
        [
            Contestant("NumPy, sort and sums", "numpy", EXACT),
            Contestant("scikit-learn, radius", "sklearn", EXACT),
            Contestant("fdars-core", "fdars", EXACT),
        ],
        quick=SHORT,
        full=LINE,
    ),
    Job(
        "line",
        "local line, Epanechnikov, h = 0.1",
        {"task": "kernel", "kernel": "epanechnikov", "degree": 1, "h": 0.1},
        [Contestant("fdars-core", "fdars", EXACT)],
        quick=[10_000],
        full=LINE,
    ),
    Job(
        "gaussian",
        "local constant, Gaussian, h = 0.045",
        {"task": "kernel", "kernel": "gaussian", "degree": 0, "h": 0.045},
        [
            Contestant("KernSmooth locpoly (binned)", "kernsmooth", 0.01),
            Contestant("kernelsmooth", "kernelsmooth", EXACT),
            Contestant("fdars-core", "fdars", EXACT),
            Contestant("statsmodels KernelReg", "statsmodels", EXACT),
        ],
        quick=SHORT,
        full=LINE,
    ),
    Job(
        "gaussian-line",
        "local line, Gaussian, h = 0.045",
        {"task": "kernel", "kernel": "gaussian", "degree": 1, "h": 0.045},
        [
            Contestant("KernSmooth locpoly (binned)", "kernsmooth", 0.01),
            Contestant("fdars-core", "fdars", EXACT),
            Contestant("statsmodels KernelReg", "statsmodels", EXACT),
        ],
        quick=[10_000],
        full=LINE,
    ),
    Job(
        "scores",
        "leave-one-out scores of 20 bandwidths",
        {"task": "scores", "degree": 0, "candidates": 20},
        [Contestant("NumPy, sort and sums", "numpy", EXACT)],
        quick=[1_000, 10_000],
        full=[1_000, *LINE],
        estimates=False,
    ),
    Job(
        "bandwidth",
        "bandwidth chosen from the data",
        {"task": "bandwidth", "rule": "leave-one-out", "degree": 0},
        [
            Contestant("Flexure, local line", "flexure", changes={"degree": 1}),
            Contestant("Flexure, plug-in, local line", "flexure", changes={"degree": 1, "rule": "plug-in"}),
            Contestant("Flexure, local bandwidths", "flexure", changes={"task": "local-bandwidths"}),
            Contestant("NumPy, sort and sums", "numpy"),
            Contestant("KernSmooth dpill, locpoly", "kernsmooth"),
            Contestant("scikit-learn, kNN grid search", "sklearn"),
            Contestant("fdars-core", "fdars", changes={"candidates": 26}),
            Contestant("kernelsmooth lscv", "kernelsmooth"),
            Contestant("statsmodels cv_ls", "statsmodels"),
        ],
        quick=[1_000, 10_000],
        full=[1_000, *LINE],
    ),
    Job(
        "plane",
        "2 columns, product kernel, h = 0.2",
        {"task": "kernel", "kernel": "epanechnikov", "degree": 0, "h": 0.2},
        PRODUCT,
        quick=SHORT,
        full=LINE[:3],
        truth=plane,
        dimension=2,
    ),
    Job(
        "space",
        "3 columns, product kernel, h = 0.3",
        {"task": "kernel", "kernel": "epanechnikov", "degree": 0, "h": 0.3},
        PRODUCT,
        quick=SHORT,
        full=LINE[:3],
        truth=space,
        dimension=3,
    ),
    Job(
        "plane-score",
        "2 columns, leave-one-out, h = 0.2",
        {"task": "leave-one-out", "kernel": "epanechnikov", "degree": 0, "h": 0.2},
        [Contestant("SciPy k-d tree, pairs", "scipy", EXACT)],
        quick=[10_000],
        full=SHORT,
        truth=plane,
        dimension=2,
        estimates=False,
    ),
    Job(
        "space-score",
        "3 columns, leave-one-out, h = 0.5",
        {"task": "leave-one-out", "kernel": "epanechnikov", "degree": 0, "h": 0.5},
        [Contestant("SciPy k-d tree, pairs", "scipy", EXACT)],
        quick=[10_000],
        full=SHORT,
        truth=space,
        dimension=3,
        estimates=False,
    ),
    Job(
        "plane-bandwidth",
        "2 columns, bandwidths chosen",
        {"task": "bandwidth", "degree": 0},
        [
            Contestant("Flexure, local line", "flexure", changes={"degree": 1}),
            Contestant("scikit-learn, kNN grid search", "sklearn"),
            Contestant("kernelsmooth lscv", "kernelsmooth"),
            Contestant("statsmodels cv_ls", "statsmodels"),
        ],
        quick=[1_000],
        full=[1_000, *SHORT],
        truth=plane,
        dimension=2,
    ),
    Job(
        "neighbours",
        "50 nearest neighbours",
        {"task": "neighbours", "k": 50},
        [
            Contestant("scikit-learn", "sklearn", EXACT),
            Contestant("fdars-core", "fdars", EXACT),
        ],
        quick=SHORT,
        full=SHORT,
    ),
    Job(
        "neighbours-chosen",
        "nearest neighbours, k chosen",
        {"task": "neighbours-chosen"},
        [Contestant("scikit-learn, kNN grid search", "sklearn")],
        quick=[10_000],
        full=SHORT,
    ),
    Job(
        "polynomial",
        "polynomial of degree 9",
        {"task": "polynomial", "degree": 9},
        [Contestant("NumPy, Polynomial.fit", "numpy", EXACT)],
        quick=SHORT,
        full=SHORT,
    ),
    Job(
        "series",
        "Legendre series, terms chosen",
        {"task": "series-chosen", "basis": "legendre", "most": 64},
        [Contestant("NumPy, QR", "numpy", EXACT)],
        quick=SHORT,
        full=SHORT,
    ),
    Job(
        "haar",
        "Haar series, 32 cells",
        {"task": "haar", "levels": 5},
        [Contestant("NumPy, bincount", "numpy", EXACT)],
        quick=SHORT,
        full=SHORT,
    ),
    Job(
        "spline",
        "smoothing spline, penalty by GCV",
        {"task": "spline-chosen"},
        [Contestant("SciPy make_smoothing_spline", "scipy")],
        quick=[1_000],
        full=SHORT,
    ),
    Job(
        "network",
        "network of 8 hidden units",
        {"task": "network", "units": 8},
        [Contestant("scikit-learn MLPRegressor", "sklearn")],
        quick=[1_000],
        full=SHORT,
    ),
]
