"""Regressions that take a record in parts."""

import pickle

import numpy as np
import pytest
from sklearn.base import clone

import flexure
from flexure import StreamedKernelRegressor


def rows(seed, n=20_000):
    rng = np.random.default_rng(seed)
    x = rng.uniform(-2, 2, n)
    return x, np.sin(2 * x) + 0.1 * rng.normal(size=n)


AT = np.linspace(-1.9, 1.9, 39)


def test_parts_give_the_result_of_the_whole():
    x, y = rows(1)
    whole = StreamedKernelRegressor().fit(x, y)
    parts = StreamedKernelRegressor()
    for k in range(0, 20_000, 3000):
        assert parts.partial_fit(x[k : k + 3000, None], y[k : k + 3000]) is parts
    late = StreamedKernelRegressor().partial_fit(x[9000:], y[9000:], first_row=9000)
    merged = StreamedKernelRegressor().merge(late, StreamedKernelRegressor().fit(x[:9000], y[:9000]))
    for model in (parts, merged, pickle.loads(pickle.dumps(parts)), clone(whole).from_bytes(whole.to_bytes())):
        assert (model.n_rows_, model.bin_width_) == (20_000, whole.bin_width_)
        np.testing.assert_allclose(model.predict(AT), whole.predict(AT), rtol=0, atol=1e-12)
        assert model.bandwidth_ == pytest.approx(whole.bandwidth_, rel=1e-12)


def test_it_agrees_with_the_regression_of_all_rows_and_its_band_covers():
    x, y = rows(2)
    own = flexure.KernelRegressor(bandwidth=0.2).fit(x[:, None], y).predict(AT[:, None])
    np.testing.assert_allclose(StreamedKernelRegressor(bandwidth=0.2).fit(x, y).predict(AT), own, atol=1e-8)
    inside = []
    for seed in range(20):
        values, band = StreamedKernelRegressor(most_bins=2048, block=200).fit(*rows(100 + seed)).predict(AT, return_band=0.95)
        assert np.max(np.abs(values - np.sin(2 * AT))) < 0.05 and band.level == 0.95
        inside.append((band.lower <= np.sin(2 * AT)) & (np.sin(2 * AT) <= band.upper))
    assert 0.92 <= np.mean(inside) <= 0.98


def test_what_cannot_be_is_refused_and_nothing_is_lost():
    x, y = rows(3, 5000)
    model = StreamedKernelRegressor().fit(x, y)
    before = model.to_bytes()
    with pytest.raises(flexure.DataError, match="sample 5001"):
        model.partial_fit([0.0, np.nan], [1.0, 1.0])
    with pytest.raises(flexure.DataError, match="length"):
        model.partial_fit([0.0, 1.0], [1.0])
    with pytest.raises(flexure.DataError, match="shape"):
        model.partial_fit(np.zeros((3, 2)), np.zeros(3))
    with pytest.raises(flexure.DataError, match="numbers of bins differ"):
        model.merge(StreamedKernelRegressor(most_bins=100).fit(x, y))
    with pytest.raises(flexure.DataError, match="no partial sums"):
        model.from_bytes(before[:-3])
    assert model.to_bytes() == before
    with pytest.raises(flexure.TooShortError, match="blocks"):
        _ = StreamedKernelRegressor().fit(x[:500], y[:500]).bandwidth_
    for wrong in ({"degree": 2}, {"kernel": "box"}, {"bandwidth": -1.0}, {"most_bins": 3}, {"block": 0}):
        with pytest.raises(flexure.ParameterError):
            StreamedKernelRegressor(**wrong).fit(x, y).predict(AT)
