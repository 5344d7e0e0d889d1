"""The Python peers: for a peer and a job, the function of (columns of x, y, columns of at) that is timed.

It returns the estimates at the points `at`, or these and the parameter that was chosen.
"""

import numpy as np

import numpy_peers


def call(who, job):
    return PEERS[who][job["task"]](job)


def bandwidths(values):
    return "h=" + ",".join(f"{h:.4f}" for h in np.ravel(values))


def epanechnikov(h):
    """The weights for scikit-learn: it hands over one array of distances a query."""

    def weights(distances):
        if distances.dtype != object:
            return 1 - (distances / h) ** 2
        result = np.empty(len(distances), dtype=object)
        for i, d in enumerate(distances):
            result[i] = 1 - (d / h) ** 2
        return result

    return weights


def sklearn_radius(job):
    """Exact in one variable. In several its kernel is of the distance, not the product."""
    from sklearn.neighbors import RadiusNeighborsRegressor

    h = float(job["h"])

    def call(x, y, at):
        model = RadiusNeighborsRegressor(radius=h, weights=epanechnikov(h)).fit(np.column_stack(x), y)
        return model.predict(np.column_stack(at))

    return call


def sklearn_neighbours(job):
    from sklearn.neighbors import KNeighborsRegressor

    k = int(job["k"])

    def call(x, y, at):
        k_at_most = min(k, len(y))
        return KNeighborsRegressor(k_at_most).fit(np.column_stack(x), y).predict(np.column_stack(at))

    return call


def sklearn_grid_search(job):
    """k by five-fold cross-validation over a logarithmic grid of 20."""
    from sklearn.model_selection import GridSearchCV, KFold
    from sklearn.neighbors import KNeighborsRegressor

    def call(x, y, at):
        grid = np.unique(np.geomspace(1, len(y) // 5, 20).astype(int))
        folds = KFold(5, shuffle=True, random_state=1)
        search = GridSearchCV(KNeighborsRegressor(), {"n_neighbors": grid}, cv=folds, scoring="neg_mean_squared_error")
        search.fit(np.column_stack(x), y)
        return search.predict(np.column_stack(at)), f"k={search.best_params_['n_neighbors']}"

    return call


def sklearn_network(job):
    """Hyperbolic tangents, by L-BFGS from one start until it converges; columns to standard deviation 1 before."""
    from sklearn.neural_network import MLPRegressor
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler

    units = int(job["units"])

    def call(x, y, at):
        network = MLPRegressor(
            hidden_layer_sizes=(units,),
            activation="tanh",
            solver="lbfgs",
            max_iter=5000,
            max_fun=100_000,
            random_state=1,
        )
        model = make_pipeline(StandardScaler(), network).fit(np.column_stack(x), y)
        return model.predict(np.column_stack(at))

    return call


def statsmodels_kernel(job):
    """Gaussian; it works out the slopes as well."""
    from statsmodels.nonparametric.kernel_regression import KernelReg

    h, degree = float(job["h"]), "ll" if job["degree"] == "1" else "lc"

    def call(x, y, at):
        model = KernelReg(y, np.column_stack(x), "c" * len(x), degree, bw=[h] * len(x))
        return model.fit(np.column_stack(at))[0]

    return call


def statsmodels_bandwidth(job):
    """Gaussian, leave-one-out, minimised by a simplex search."""
    from statsmodels.nonparametric.kernel_regression import KernelReg

    def call(x, y, at):
        model = KernelReg(y, np.column_stack(x), "c" * len(x), "lc", bw="cv_ls")
        return model.fit(np.column_stack(at))[0], bandwidths(model.bw)

    return call


def kernelsmooth_kernel(job):
    """Gaussian, after division by the standard deviation."""
    from kernelsmooth import KernelRegression

    h = float(job["h"])

    def call(x, y, at):
        scaled = h / np.std(x[0], ddof=1)
        return KernelRegression(scaled, diag_cov=True).fit(x[0][:, None], y).predict(at[0][:, None])

    return call


def kernelsmooth_bandwidth(job):
    """Gaussian, exact leave-one-out, minimised by L-BFGS-B."""
    from kernelsmooth import KernelRegression

    def call(x, y, at):
        model = KernelRegression("lscv", diag_cov=True).fit(np.column_stack(x), y)
        return model.predict(np.column_stack(at)), bandwidths(model.bandwidth * model.L)

    return call


def kernsmooth_locpoly(job):
    """R's locpoly, its Fortran: Gaussian, on data binned linearly to the evaluation grid."""
    from r2py_kernsmooth import locpoly

    h, degree = float(job["h"]), int(job["degree"])

    def call(x, y, at):
        grid = at[0]
        return locpoly(x[0], y, degree=degree, bandwidth=h, gridsize=len(grid), range_x=(grid[0], grid[-1]))["y"]

    return call


def kernsmooth_plug_in(job):
    """R's dpill (direct plug-in), then locpoly: local lines, Gaussian, binned."""
    from r2py_kernsmooth import dpill, locpoly

    def call(x, y, at):
        grid = at[0]
        h = float(dpill(x[0], y))
        fit = locpoly(x[0], y, bandwidth=h, gridsize=len(grid), range_x=(grid[0], grid[-1]))
        return fit["y"], f"h={h:.4f}"

    return call


def scipy_spline(job):
    """The smoothing spline with a knot at every point, by generalised cross-validation.

    On x stretched to [0, 30]: on [-2, 2] its search for the penalty misses the minimum.
    """
    from scipy.interpolate import make_smoothing_spline

    def call(x, y, at):
        order = np.argsort(x[0])
        low, high = x[0][order[0]], x[0][order[-1]]

        def stretched(v):
            return (v - low) * (30 / (high - low))

        return make_smoothing_spline(stretched(x[0][order]), y[order])(stretched(np.clip(at[0], low, high)))

    return call


def flexure_regressor(job):
    """Flexure's own Python package."""
    from flexure import KernelRegressor

    h = float(job["h"]) if "h" in job else None
    return lambda x, y, at: KernelRegressor(bandwidth=h).fit(x[0][:, None], y).predict(at[0][:, None])


def flexure_hammerstein(job):
    """The same, and the free run over the record in place of estimates."""
    from flexure import Hammerstein

    return lambda x, y, at: Hammerstein().fit(x[0], y).predicted_


PEERS = {
    "flexure-python": {"regressor": flexure_regressor, "hammerstein": flexure_hammerstein},
    "numpy": {
        "kernel": numpy_peers.kernel,
        "bandwidth": numpy_peers.bandwidth,
        "scores": numpy_peers.scores,
        "polynomial": numpy_peers.polynomial,
        "series-chosen": numpy_peers.series_chosen,
        "haar": numpy_peers.haar,
    },
    "scipy": {
        "kernel": numpy_peers.product_kernel,
        "leave-one-out": numpy_peers.product_leave_one_out,
        "spline-chosen": scipy_spline,
    },
    "sklearn": {
        "kernel": sklearn_radius,
        "bandwidth": sklearn_grid_search,
        "neighbours": sklearn_neighbours,
        "neighbours-chosen": sklearn_grid_search,
        "network": sklearn_network,
    },
    "statsmodels": {"kernel": statsmodels_kernel, "bandwidth": statsmodels_bandwidth},
    "kernelsmooth": {"kernel": kernelsmooth_kernel, "bandwidth": kernelsmooth_bandwidth},
    "kernsmooth": {"kernel": kernsmooth_locpoly, "bandwidth": kernsmooth_plug_in},
}
