"""What a careful user of NumPy (and of SciPy's k-d tree) would write: exact, and without Python loops over points."""

import numpy as np
from numpy.polynomial import Polynomial
from numpy.polynomial.legendre import legval, legvander

# The candidates of the bandwidth search: Flexure's own grid and refinement.
GRID, REFINEMENTS = 20, 6


class Line:
    """Points on a line, sorted, with the running sums that give any Epanechnikov window in O(log n)."""

    def __init__(self, x, y):
        order = np.argsort(x)
        # Centred: the sums of squares keep their digits.
        self.centre, self.mean = x.mean(), y.mean()
        self.x, self.y = x[order] - self.centre, y[order] - self.mean
        self.sums = [running(v) for v in (self.x, self.x * self.x)]
        weighted = self.y
        self.sums.append(running(weighted))
        for _ in range(2):
            weighted = weighted * self.x
            self.sums.append(running(weighted))

    def windows(self, at, h):
        """The sums of the weights 1 - ((x - at) / h)^2, and of weight times y, for centred `at`."""
        low, high = np.searchsorted(self.x, at - h), np.searchsorted(self.x, at + h, side="right")
        s0 = high - low
        s1, s2, t0, t1, t2 = (sum[high] - sum[low] for sum in self.sums)
        weights = s0 - (s2 - at * (2 * s1 - at * s0)) / h**2
        weighted = t0 - (t2 - at * (2 * t1 - at * t0)) / h**2
        return weights, weighted

    def estimate(self, at, h):
        weights, weighted = self.windows(at - self.centre, h)
        with np.errstate(divide="ignore", invalid="ignore"):
            return self.mean + weighted / weights

    def leave_one_out(self, h):
        """The mean squared error of predicting every point from the others; its neighbours where none is in reach."""
        weights, weighted = self.windows(self.x, h)
        alone = weights - 1 < 1e-9
        others = (weighted - self.y) / np.where(alone, 1, weights - 1)
        if alone.any():
            i = np.flatnonzero(alone)
            others[i] = (self.y[np.maximum(i - 1, 0)] + self.y[np.minimum(i + 1, len(self.y) - 1)]) / 2
        return np.mean((self.y - others) ** 2)

    def bandwidth(self):
        n = len(self.x)
        extent = min(self.x[-1] - self.x[0], 2 * (self.x[n - 1 - n // 10] - self.x[n // 10]))
        smallest = extent * np.clip(3 / n, 1e-4, 0.2)
        ratio = np.log(extent / smallest) / (GRID - 1)

        def score(t):
            return self.leave_one_out(smallest * np.exp(t))

        scores = [score(ratio * i) for i in range(GRID)]
        best = int(np.argmin(scores))
        t = ratio * best
        if 0 < best < GRID - 1:
            t = min(golden_section(t - ratio, t + ratio, score) + [(scores[best], t)])[1]
        return smallest * np.exp(t)


def running(values):
    sums = np.empty(len(values) + 1)
    sums[0] = 0
    np.cumsum(values, out=sums[1:])
    return sums


def golden_section(a, b, score):
    """All (score, point) that were tried."""
    golden = (5**0.5 - 1) / 2
    c, d = b - golden * (b - a), a + golden * (b - a)
    low, high = score(c), score(d)
    tried = [(low, c), (high, d)]
    for _ in range(2, REFINEMENTS):
        if low < high:
            b, d, high = d, c, low
            c = b - golden * (b - a)
            low = score(c)
            tried.append((low, c))
        else:
            a, c, low = c, d, high
            d = a + golden * (b - a)
            high = score(d)
            tried.append((high, d))
    return tried


def kernel(job):
    h = float(job["h"])
    return lambda x, y, at: Line(x[0], y).estimate(at[0], h)


def bandwidth(job):
    def call(x, y, at):
        line = Line(x[0], y)
        h = line.bandwidth()
        return line.estimate(at[0], h), f"h={h:.4f}"

    return call


def scores(job):
    """The leave-one-out scores of bandwidths from 0.02 to 1, evenly spaced in their logarithm."""
    bandwidths = np.geomspace(0.02, 1, int(job["candidates"]))

    def call(x, y, at):
        line = Line(x[0], y)
        return np.array([line.leave_one_out(h) for h in bandwidths])

    return call


def polynomial(job):
    degree = int(job["degree"])
    return lambda x, y, at: Polynomial.fit(x[0], y, degree)(np.clip(at[0], x[0].min(), x[0].max()))


def series_chosen(job):
    """Legendre polynomials, their number by exact leave-one-out: one QR factorisation serves all numbers."""
    most = int(job["most"])

    def call(x, y, at):
        low, high = x[0].min(), x[0].max()
        scaled = (2 * x[0] - low - high) / (high - low)
        q, r = np.linalg.qr(legvander(scaled, min(most, int(8 * len(y) ** (1 / 3))) - 1))
        coefficients = q.T @ y
        residual, rest, scores = y.copy(), np.ones_like(y), []
        for column, coefficient in zip(q.T, coefficients):
            residual -= coefficient * column
            rest -= column * column
            scores.append(np.mean((residual / rest) ** 2))
        terms = 1 + int(np.argmin(scores))
        solution = np.linalg.solve(r[:terms, :terms], coefficients[:terms])
        points = np.clip((2 * at[0] - low - high) / (high - low), -1, 1)
        return legval(points, solution), f"terms={terms}"

    return call


def haar(job):
    cells = 2 ** int(job["levels"])

    def call(x, y, at):
        low, high = x[0].min(), x[0].max()

        def cell(v):
            return np.clip((v - low) * (cells / (high - low)), 0, cells - 1).astype(np.int64)

        index = cell(x[0])
        means = np.bincount(index, y, cells) / np.bincount(index, minlength=cells)
        return means[cell(at[0])]

    return call


def product_kernel(job):
    """The product Epanechnikov kernel in several variables, the points in reach by SciPy's k-d tree."""
    from scipy.spatial import cKDTree

    h = float(job["h"])

    def call(x, y, at):
        points, queries = np.column_stack(x), np.column_stack(at)
        found = cKDTree(points).query_ball_point(queries, h, p=np.inf)
        which = np.repeat(np.arange(len(queries)), [len(f) for f in found])
        index = np.concatenate(found).astype(np.int64)
        weights = np.prod(1 - ((points[index] - queries[which]) / h) ** 2, axis=1)
        total = np.bincount(which, weights, len(queries))
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.bincount(which, weights * y[index], len(queries)) / total

    return call


def product_leave_one_out(job):
    """The leave-one-out score of the product Epanechnikov kernel: every pair in reach once."""
    from scipy.spatial import cKDTree

    h = float(job["h"])

    def call(x, y, at):
        points = np.column_stack(x)
        i, j = cKDTree(points).query_pairs(h, p=np.inf, output_type="ndarray").T
        weights = np.prod(1 - ((points[i] - points[j]) / h) ** 2, axis=1)
        n = len(y)
        total = np.bincount(i, weights, n) + np.bincount(j, weights, n)
        sums = np.bincount(i, weights * y[j], n) + np.bincount(j, weights * y[i], n)
        alone = total <= 0
        others = np.where(alone, y.mean(), sums / np.where(alone, 1, total))
        return np.array([np.mean((y - others) ** 2)])

    return call
