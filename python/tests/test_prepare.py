"""Preparing frames: known truth, comparison with SciPy, and the same numbers as from the command line."""

import doctest
import logging

import flexure
import numpy as np
import pandas as pd
import polars as pl
import pytest
from conftest import write_csv
from flexure import prepare
from scipy.signal import butter, sosfiltfilt


def log(n=400, seed=1):
    """A log with jittered instants, two outliers and a column of text."""
    rng = np.random.default_rng(seed)
    t = 0.01 * (np.arange(n) + rng.uniform(-0.3, 0.3, n))
    t[0] = 0.0
    y = np.sin(3 * t)
    y[[100, 101]] += 30.0
    return {"t": t, "u": np.cos(2 * t), "y": y, "state": np.array(["run"] * n)}


FRAMES = [dict, pd.DataFrame, pl.DataFrame]


@pytest.mark.parametrize("make", FRAMES)
def test_all_kinds_of_frames_give_the_same_numbers(make):
    data = log()
    even = prepare.resample(prepare.outliers(make(data)), 0.01)
    assert type(even) is make
    assert list(even if make is dict else even.columns) == ["t", "u", "y"]
    t, y = np.asarray(even["t"]), np.asarray(even["y"])
    np.testing.assert_array_equal(t, np.arange(len(t)) / 100)
    np.testing.assert_allclose(y, np.sin(3 * t), atol=2e-6)


@pytest.mark.parametrize("make", FRAMES)
def test_only_the_chosen_columns_change(make):
    data = log()
    frame = make(data)
    marked = prepare.outliers(frame, "y")
    y = np.asarray(marked["y"])
    assert list(np.flatnonzero(np.isnan(y))) == [100, 101]
    for name in ["t", "u", "state"]:
        np.testing.assert_array_equal(np.asarray(marked[name]), data[name])
    # The frame that was given is as it was.
    np.testing.assert_array_equal(np.asarray(frame["y"]), data["y"])


@pytest.mark.parametrize("make", FRAMES)
def test_a_cut_keeps_columns_of_text(make):
    data = log()
    part = prepare.cut(make(data), 1, 2)
    inside = (data["t"] >= 1 - 1e-8) & (data["t"] <= 2 + 1e-8)
    for name, column in data.items():
        np.testing.assert_array_equal(np.asarray(part[name]), column[inside])


def test_the_low_pass_is_that_of_scipy():
    rng = np.random.default_rng(2)
    y = rng.normal(size=500)
    for order, cutoff in [(4, 3.0), (2, 20.0), (8, 0.7)]:
        filtered = prepare.low_pass({"y": y}, cutoff, order=order, dt=0.01)["y"]
        np.testing.assert_allclose(filtered, sosfiltfilt(butter(order, cutoff, fs=100, output="sos"), y), atol=1e-10)


def test_missing_samples_stay_missing_in_a_filter():
    t = np.arange(500) / 100
    y = np.sin(t)
    y[[50, 51, 300]] = np.nan
    filtered = prepare.low_pass({"t": t, "y": y}, 10)["y"]
    np.testing.assert_array_equal(np.isnan(filtered), np.isnan(y))
    np.testing.assert_allclose(filtered[~np.isnan(y)], np.sin(t)[~np.isnan(y)], atol=1e-3)


def test_an_index_of_time_stamps_stays_one():
    stamps = pd.date_range("2024-05-01 10:00", periods=100, freq="10ms", tz="Europe/Berlin", name="when")
    frame = pd.DataFrame({"y": np.arange(100.0)}, index=stamps)
    slow = prepare.resample(frame, 0.05)
    assert slow.index.name == "when" and slow.index.tz is not None
    assert list(slow.index) == list(stamps[::5])
    assert list(prepare.cut(frame, 0.1, 0.2).index) == list(stamps[10:21])


@pytest.mark.parametrize("zone", [None, "UTC", "Europe/Berlin"])
def test_columns_of_time_stamps_stay_ones(zone):
    stamps = pd.date_range("2024-05-01 10:00", periods=100, freq="10ms", tz=zone)
    for make in (pd.DataFrame, pl.DataFrame):
        frame = make({"time": stamps.tz_localize(None) if make is pl.DataFrame else stamps, "y": np.arange(100.0)})
        if make is pl.DataFrame and zone is not None:
            frame = frame.with_columns(pl.col("time").dt.replace_time_zone(zone))
        slow = prepare.resample(frame, 0.02)
        own = slow["time"].dt.tz if make is pd.DataFrame else slow["time"].dtype.time_zone
        assert (own is None) is (zone is None) and (own is None or str(own) == zone), make
        assert [pd.Timestamp(t) for t in slow["time"]] == list(stamps[::2]), make


def test_frames_are_merged_by_their_clock():
    stamps = pd.date_range("2024-05-01 10:00", periods=10, freq="1s")
    first = pd.DataFrame({"u": np.arange(10.0)}, index=stamps)
    second = pd.DataFrame({"u": np.arange(3.0, 13.0)}, index=stamps + pd.Timedelta("3s"))
    merged = prepare.merge(first, second)
    assert list(merged.columns) == ["u", "table2.u"]
    assert list(merged.index) == list(stamps[3:])
    np.testing.assert_allclose(merged["u"], merged["table2.u"], atol=1e-12)
    with pytest.raises(flexure.DataError, match="no common clock"):
        prepare.merge(first, {"t": np.arange(5.0), "y": np.arange(5.0)})


def test_held_columns_and_gaps():
    t = np.concatenate([np.arange(50), np.arange(80, 120)]) / 10
    frame = {"t": t, "u": np.floor(t), "y": t**2}
    even = prepare.resample(frame, 0.05, hold="u")
    inside = even["t"] <= 4.9
    np.testing.assert_array_equal(even["u"][inside], np.floor(even["t"][inside] + 1e-9))
    gap = (even["t"] > 4.95) & (even["t"] < 7.99)
    assert np.isnan(even["y"][gap]).all() and np.isnan(even["u"][gap & (even["t"] > 5.01)]).all()
    bridged = prepare.resample(frame, 0.05, longest_gap=40)
    np.testing.assert_allclose(bridged["y"], bridged["t"] ** 2, atol=1e-9)


def test_the_command_gives_the_same_numbers(command, tmp_path):
    data = {name: column for name, column in log().items() if name != "state"}
    write_csv(tmp_path / "log.csv", **data)
    command(
        "prepare", tmp_path / "log.csv", "--outliers", "y", "--resample", "0.025", "--hold", "u",
        "--low-pass", "4", "--detrend", "y", "-o", tmp_path / "out.csv",
    )  # fmt: skip
    expected = pd.read_csv(tmp_path / "out.csv")
    even = prepare.resample(prepare.outliers(data, "y"), 0.025, hold="u")
    got = prepare.detrend(prepare.low_pass(even, 4), "y")
    for name, header in [("t", "t [s]"), ("u", "u"), ("y", "y")]:
        np.testing.assert_array_equal(got[name], expected[header])


def test_what_was_done_is_logged(caplog):
    with caplog.at_level(logging.INFO, logger="flexure.prepare"):
        prepare.convert({"q": np.array([180.0])}, {"q": ("deg", "rad")})
    assert caplog.messages == ["'q' is converted from deg to rad"]


def test_what_is_refused_says_what_to_do():
    frame = {"t": np.arange(20.0), "y": np.arange(20.0), "state": ["a"] * 20}
    for call, error, message in [
        (lambda: prepare.outliers(frame, "z"), flexure.DataError, "no column 'z' of numbers; the columns are: y"),
        (lambda: prepare.outliers(frame, "state"), flexure.DataError, "no column 'state' of numbers"),
        (lambda: prepare.outliers(frame, neighbours=0), flexure.ParameterError, "neighbours is 0"),
        (lambda: prepare.outliers(frame, threshold="5"), flexure.ParameterError, "threshold is '5'"),
        (lambda: prepare.resample(frame, 0), flexure.ParameterError, "the new sample time is 0"),
        (lambda: prepare.resample({"y": [1.0, 2.0]}, 0.1), flexure.FlexureError, "needs the sample time"),
        (lambda: prepare.low_pass(frame, 3), flexure.ParameterError, "the cutoff frequency of the low-pass is 3"),
        (lambda: prepare.low_pass(frame, 0.1, order=3), flexure.ParameterError, "the order of the low-pass is 3"),
        (lambda: prepare.cut({"y": [1.0]}, 1), flexure.FlexureError, "needs the sample time"),
        (lambda: prepare.cut(frame, 100), flexure.FlexureError, "nothing is left after the cut"),
        (lambda: prepare.convert(frame, {"y": ("deg", "m")}), flexure.FlexureError, "deg cannot be converted to m"),
        (lambda: prepare.fill({"a": [1.0, 2.0], "b": [1.0]}), flexure.DataError, "the same length"),
        (lambda: prepare.fill(np.zeros(3)), flexure.DataError, "a ndarray is no frame"),
        (lambda: prepare.fill({"t": [0.0, 1.0]}), flexure.DataError, "no column of numbers"),
        (lambda: prepare.merge(), flexure.ParameterError, "at least one frame"),
        (lambda: prepare.merge(frame, {"y": [1.0]}), flexure.FlexureError, "no time column"),
    ]:
        with pytest.raises(error, match=message):
            call()


def test_the_examples_in_the_documentation_run():
    runner = doctest.DocTestRunner()
    for example in doctest.DocTestFinder().find(prepare):
        logging.getLogger().setLevel(logging.WARNING)
        runner.run(example)
    assert runner.tries > 30 and runner.failures == 0
