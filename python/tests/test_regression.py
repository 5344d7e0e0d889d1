"""Static estimators: scikit-learn's own checks, and the library's numbers."""

import json
import pickle

import numpy as np
import pytest
from conftest import write_csv
from sklearn.base import clone
from sklearn.model_selection import GridSearchCV, cross_val_score
from sklearn.utils.estimator_checks import estimator_checks_generator

import flexure
from flexure.regression import Band, KernelRegressor, KNNRegressor, SeriesRegressor, SplineRegressor

ESTIMATORS = [
    KernelRegressor(),
    KernelRegressor(degree=0),
    KNNRegressor(),
    SeriesRegressor(),
    SeriesRegressor("polynomial"),
    SplineRegressor(),
]


def _checks():
    for estimator in ESTIMATORS:
        yield from estimator_checks_generator(estimator, legacy=True)


def _name(value):
    function = getattr(value, "func", value)
    return getattr(function, "__name__", repr(value))


@pytest.mark.parametrize(("estimator", "check"), list(_checks()), ids=_name)
def test_scikit_learns_checks(estimator, check):
    check(estimator)


@pytest.fixture(scope="module")
def points():
    rng = np.random.default_rng(1)
    x = rng.uniform(-2, 2, 400)
    return x, np.tanh(2 * x) + 0.1 * rng.normal(size=400)


def test_the_local_constant_is_its_formula(points):
    x, y = points
    h, at = 0.3, np.linspace(-1.5, 1.5, 31)
    u = (at[:, None] - x) / h
    k = np.where(np.abs(u) < 1, 1 - u**2, 0)
    fit = KernelRegressor(degree=0, bandwidth=h).fit(x[:, None], y)
    np.testing.assert_allclose(fit.predict(at[:, None]), k @ y / k.sum(axis=1), rtol=1e-12)
    assert fit.bandwidth_ == h and fit.scores_ is None


def test_leave_one_out_is_its_definition(points):
    x, y = (v[:60] for v in points)
    fit = KernelRegressor(degree=0).fit(x[:, None], y)
    best = np.argmin(fit.scores_.score)
    assert fit.scores_.parameter[best] == fit.bandwidth_

    def left_out(h):
        k = np.maximum(1 - ((x[:, None] - x) / h) ** 2, 0)
        np.fill_diagonal(k, 0)
        return np.mean((y - k @ y / k.sum(axis=1)) ** 2)

    assert fit.left_out_error_ == pytest.approx(left_out(fit.bandwidth_), rel=1e-9)
    assert fit.left_out_error_ < left_out(2 * fit.bandwidth_)


def test_neighbours_are_means():
    fit = KNNRegressor(2).fit([[0.0], [1.0], [2.0], [5.0]], [1.0, 3.0, 5.0, 9.0])
    np.testing.assert_array_equal(fit.predict([[0.2], [1.0]]), [2.0, 3.0])


def test_weights_count_points(points):
    x, y = points
    w = np.arange(len(x)) % 3
    whole = SplineRegressor(penalty=0.1).fit(np.repeat(x, w)[:, None], np.repeat(y, w))
    weighted = SplineRegressor(penalty=0.1).fit(x[:, None], y, sample_weight=w)
    at = np.linspace(-1.9, 1.9, 50)[:, None]
    np.testing.assert_allclose(weighted.predict(at), whole.predict(at), rtol=1e-8)
    # Where the parameter is chosen, too; and other weights are weights.
    whole = KernelRegressor().fit(np.repeat(x, w)[:, None], np.repeat(y, w))
    assert KernelRegressor().fit(x[:, None], y, sample_weight=w).bandwidth_ == whole.bandwidth_
    halves = KernelRegressor(bandwidth=0.3).fit(x[:, None], y, sample_weight=0.5 * w)
    np.testing.assert_allclose(
        halves.predict(at), KernelRegressor(bandwidth=0.3).fit(x[:, None], y, sample_weight=w).predict(at), rtol=1e-10
    )


def test_bands_cover(points):
    x, y = points
    at = np.linspace(-1.8, 1.8, 100)
    estimate, band = KernelRegressor().fit(x[:, None], y).predict(at[:, None], return_band=0.95)
    assert isinstance(band, Band) and band.level == 0.95 and "robust" in band.method
    inside = np.mean((band.lower < np.tanh(2 * at)) & (np.tanh(2 * at) < band.upper))
    assert 0.8 < inside <= 1
    assert np.max(np.abs(estimate - np.tanh(2 * at))) < 0.2
    _, wide = KernelRegressor().fit(x[:, None], y).predict(at[:, None], return_band=0.95, simultaneous=True)
    assert np.all(wide.upper - wide.lower > band.upper - band.lower)
    _, boot = SplineRegressor().fit(x[:, None], y).predict(at[:, None], return_band=0.9)
    assert np.all(boot.lower < boot.upper) and "ootstrap" in boot.method


def test_local_bandwidths_follow_jumps():
    rng = np.random.default_rng(3)
    x = rng.uniform(-2, 2, 2000)
    y = np.round(x) + 0.1 * rng.normal(size=2000)
    at = np.linspace(-1.8, 1.8, 300)
    at = at[np.abs(np.abs(at) % 1 - 0.5) > 0.15]  # one bandwidth is narrow everywhere, on the flat parts too
    rms = {}
    for bandwidth in (None, "local"):
        fit = KernelRegressor(bandwidth=bandwidth).fit(x[:, None], y)
        rms[bandwidth] = np.sqrt(np.mean((fit.predict(at[:, None]) - np.round(at)) ** 2))
    assert rms["local"] < 0.8 * rms[None]
    again = pickle.loads(pickle.dumps(fit))
    np.testing.assert_array_equal(again.predict(at[:, None]), fit.predict(at[:, None]))
    with pytest.raises(flexure.ParameterError, match="at most|takes 1 column"):
        KernelRegressor(bandwidth="local").fit(np.stack([x, x**2], axis=1), y)


def test_two_columns_and_many():
    rng = np.random.default_rng(2)
    x = rng.uniform(-1, 1, (600, 8))
    y = np.sin(3 * x[:, 0]) + x[:, 1] ** 2 + 0.05 * rng.normal(size=600)
    plane = KernelRegressor().fit(x[:, :2], y)
    assert plane.bandwidth_.shape == (2,) and plane.score(x[:, :2], y) > 0.97
    additive = SplineRegressor().fit(x, y)
    assert additive.penalty_.shape == (8,)
    at = rng.uniform(-0.9, 0.9, (200, 8))
    error = additive.predict(at) - np.sin(3 * at[:, 0]) - at[:, 1] ** 2
    assert np.sqrt(np.mean(error**2)) < 0.04
    with pytest.raises(flexure.ParameterError, match="additive model has no band"):
        additive.predict(x, return_band=0.95)


def test_pickle_keeps_the_fit(points):
    x, y = points
    for estimator in [KernelRegressor(), KNNRegressor(), SeriesRegressor("cosine"), SplineRegressor()]:
        fit = clone(estimator).fit(x[:, None], y)
        again = pickle.loads(pickle.dumps(fit))
        np.testing.assert_array_equal(again.predict(x[:50, None]), fit.predict(x[:50, None]))
        np.testing.assert_array_equal(again.scores_.score, fit.scores_.score)


def test_scikit_learns_tools_work(points):
    x, y = points
    assert cross_val_score(KernelRegressor(), x[:, None], y).mean() > 0.9
    search = GridSearchCV(SeriesRegressor(), {"basis": ["legendre", "fourier"], "terms": [3, 9]}).fit(x[:, None], y)
    assert search.best_params_["terms"] == 9


@pytest.mark.parametrize(
    ("estimator", "message"),
    [
        (KernelRegressor(bandwidth=-1.0), "the bandwidth is -1, but must be positive"),
        (KernelRegressor(kernel="box"), "the kernel is 'box', but must be one of uniform, triangular"),
        (KernelRegressor(degree=2), "the degree is 2"),
        (KernelRegressor(bandwidth="wide"), "must be numbers, None, or with degree 1 'local'"),
        (KernelRegressor(rule="best"), "the rule is 'best'"),
        (KernelRegressor(outside="zero"), "the outside is 'zero'"),
        (KNNRegressor(1000), "number of neighbours is 1000, but these data allow at most 400"),
        (KNNRegressor(2.5), "whole number"),
        (SeriesRegressor("bessel"), "the basis is 'bessel'"),
        (SplineRegressor(-1.0), "-1"),
        (KNNRegressor("3"), "n_neighbors is '3', but must be a number, or None"),
        (SeriesRegressor(terms="3"), "terms is '3'"),
        (SplineRegressor("3"), "penalty is '3'"),
        (SplineRegressor([1.0]), r"penalty is \[1.0\]"),
        (KNNRegressor(True), "n_neighbors is True"),
        (KernelRegressor(bandwidth=[0.1, 0.2]), "there are 2 values of bandwidth for 1 column"),
        (KernelRegressor(bandwidth=[[0.1], [0.1, 0.2]]), "one a column"),
        (KernelRegressor(bandwidth=0.1 + 0j), "one a column"),
        (KernelRegressor(kernel=3), "kernel is 3, but must be a name"),
        (KernelRegressor(rule=None), "rule is None, but must be a name"),
    ],
)
def test_wrong_parameters_are_said(points, estimator, message):
    x, y = points
    with pytest.raises(flexure.ParameterError, match=message):
        estimator.fit(x[:, None], y)


def test_every_column_of_an_additive_model_has_its_bandwidth():
    rng = np.random.default_rng(4)
    x = rng.uniform(-1, 1, (300, 7))
    y = np.sin(3 * x[:, 0]) + 0.05 * rng.normal(size=300)
    given = np.linspace(0.3, 0.9, 7)
    np.testing.assert_array_equal(KernelRegressor(bandwidth=given).fit(x, y).bandwidth_, given)


def test_instants_are_no_points(points):
    with pytest.raises(TypeError, match="instants or durations"):
        KernelRegressor().fit((1000 * points[0]).astype("m8[s]")[:, None], points[1])


def test_rows_that_depend_on_each_other_are_warned_of(points):
    assert KernelRegressor().fit(points[0][:, None], points[1]).warnings_ == []
    rng = np.random.default_rng(5)
    noise = np.zeros(1500)
    for i in range(1, len(noise)):
        noise[i] = 0.8 * noise[i - 1] + 0.1 * rng.normal()
    x = np.linspace(-2, 2, len(noise))
    y = np.sin(x) + noise
    fit = KernelRegressor(bandwidth=0.5).fit(x[:, None], y)
    assert any("rule='block' allows for it" in text for text in fit.warnings_)
    assert pickle.loads(pickle.dumps(fit)).warnings_ == fit.warnings_
    blocks = KernelRegressor(rule="block").fit(x[:, None], y)
    assert not any("correlated" in text for text in blocks.warnings_)


def test_the_warnings_are_the_command_lines(tmp_path, command):
    rng = np.random.default_rng(6)
    x = np.repeat(rng.uniform(-2, 2, 300), 2)
    y = np.repeat(np.sin(x[::2]) + 0.1 * rng.normal(size=300), 2)
    path = write_csv(tmp_path / "r.csv", x=x, y=y)
    done = command("regress", path, "--x", "x", "--y", "y", "--estimator", "local-linear", "--json")
    # The command also says where its own grid has no estimate or no band.
    theirs = [text for text in json.loads(done.stdout)["warnings"] if "points of the result" not in text]
    theirs = [text.replace("--weights", "sample_weight").replace("--select block", "rule='block'") for text in theirs]
    fit = KernelRegressor().fit(x[:, None], y)
    assert fit.warnings_ and fit.warnings_ == theirs
    # Repetitions that are asked for are no copies.
    weighted = KernelRegressor().fit(x[::2, None], y[::2], sample_weight=np.full(300, 2))
    assert not any("copies" in text for text in weighted.warnings_)
