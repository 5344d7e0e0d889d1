"""Arrays of every dtype and layout: the same result, or a clear exception."""

from fractions import Fraction

import numpy as np
import pytest

import flexure
from flexure import _core
from flexure._arrays import samples

VALUES = np.array([3, 0, 1, 7, 2, 5])


@pytest.mark.parametrize("dtype", ["?", "i1", "u1", "i2", "<i4", ">i4", "i8", "u8", "f2", "f4", ">f4", "f8", ">f8", "g"])
def test_every_real_dtype(dtype):
    array = VALUES.astype(dtype)
    got = samples(array, "u")
    assert got.dtype == np.float64 and got.dtype.isnative and got.flags.c_contiguous and got.flags.aligned
    np.testing.assert_array_equal(got, array.astype(float))


def test_every_layout():
    wide = np.zeros((6, 4))
    wide[:, 1] = VALUES
    frozen = VALUES.astype(float)
    frozen.setflags(write=False)
    odd = np.zeros(1 + 8 * 6, dtype=np.uint8)[1:].view(np.float64)
    odd[:] = VALUES
    masked = np.ma.MaskedArray(VALUES.astype(float), mask=[0, 0, 1, 0, 0, 0])
    for array in (
        wide[:, 1],
        wide[:, [1]],
        np.asfortranarray(wide)[:, 1],
        VALUES[::-1].astype(float)[::-1],
        frozen,
        odd,
        list(VALUES),
        tuple(float(v) for v in VALUES),
        [Fraction(int(v)) for v in VALUES],
        VALUES.astype(object),
        memoryview(VALUES.astype(float)),
    ):
        np.testing.assert_array_equal(samples(array, "u"), VALUES)
    np.testing.assert_array_equal(np.isnan(samples(masked, "u")), masked.mask)
    np.testing.assert_array_equal(samples([1, None, 2], "u"), [1, np.nan, 2])
    assert samples(frozen, "u") is frozen or np.shares_memory(samples(frozen, "u"), frozen)


@pytest.mark.parametrize(
    ("values", "error", "message"),
    [
        (VALUES.astype(complex), TypeError, "complex numbers"),
        (["1", "2"], TypeError, "text"),
        (np.array(["1", 2], dtype=object), TypeError, "text"),
        (np.array(["2024-01-01"], dtype="M8[s]"), TypeError, "instants"),
        (np.array([1], dtype="m8[s]"), TypeError, "durations"),
        ([object()], TypeError, "object objects"),
        (np.zeros((3, 2)), flexure.DataError, r"'u' has the shape \(3, 2\)"),
        (np.zeros((1, 3)), flexure.DataError, r"the shape \(1, 3\)"),
        (5.0, flexure.DataError, r"the shape \(\)"),
        ([[1], [2, 3]], flexure.DataError, "no sequence of numbers"),
    ],
)
def test_what_is_no_signal_is_said(values, error, message):
    with pytest.raises(error, match=message):
        samples(values, "u")


def test_a_fit_is_the_same_for_every_layout(record):
    u, y = record.u[:1200], record.y[:1200]
    expected = flexure.Hammerstein().fit(u, y).to_json()
    wide = np.asfortranarray(np.column_stack([y, u]))
    wide.setflags(write=False)
    strided = np.repeat(np.stack([u, y]), 2, axis=1)[:, ::2]
    for a, b in ((wide[:, 1], wide[:, 0]), strided, (list(u), y.astype(">f8"))):
        assert flexure.Hammerstein().fit(a, b).to_json() == expected


def test_empty_arrays_are_said(fitted):
    empty = np.array([])
    with pytest.raises(flexure.TooShortError):
        flexure.Hammerstein().fit(empty, empty)
    with pytest.raises(flexure.TooShortError):
        flexure.Wiener().fit(empty, empty)
    with pytest.raises(ValueError, match="0 sample"):
        flexure.KernelRegressor().fit(np.empty((0, 1)), empty)
    assert fitted.simulate(empty).shape == (0,)


def test_the_compiled_part_refuses_what_it_cannot_read():
    for wrong in (VALUES, VALUES.astype("f4"), np.zeros((2, 2)), np.zeros(8)[::2], [1.0, 2.0], "text", None):
        with pytest.raises(TypeError):
            _core.Regression.fit("kernel", [wrong], np.zeros(6))


def test_inputs_are_not_written_to(record):
    u, y = record.u[:800].copy(), record.y[:800].copy()
    before = u.copy(), y.copy()
    flexure.Hammerstein().fit(u, y).predict(u, y)
    np.testing.assert_array_equal((u, y), before)


def test_an_array_stays_alive_and_in_place():
    """The compiled part reads the very memory, which NumPy then refuses to move."""
    rng = np.random.default_rng(0)
    x, y = rng.uniform(size=5000), rng.normal(size=5000)
    fit = _core.Regression.fit("kernel", [x], y, parameter=[0.1])
    with pytest.raises(ValueError, match="resize"):
        x.resize(10_000_000)
    expected = fit.predict([np.array([0.5])])
    del x, y
    junk = [np.full(5000, np.nan) for _ in range(20)]
    np.testing.assert_array_equal(fit.predict([np.array([0.5])]), expected)
    assert len(junk) == 20


def test_arrays_across_the_words_of_the_processor_are_read_as_others():
    odd = np.zeros(1 + 8 * 6, dtype=np.uint8)[1:].view(np.float64)
    odd[:] = VALUES
    assert samples(odd, "u").flags.aligned
    y = np.sin(odd)
    points = flexure.KNNRegressor(1).fit(odd[:, None], y).predict(odd[:, None])
    np.testing.assert_array_equal(points, flexure.KNNRegressor(1).fit(VALUES[:, None], y).predict(VALUES[:, None]))
    assert _core.sample_time(samples(np.sort(odd)[[0, 1]], "t")) == 1
