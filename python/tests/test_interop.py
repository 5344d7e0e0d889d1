"""Tables of other libraries in and out, and agreement with libraries that compute the same."""

import numpy as np
import pandas as pd
import pytest
from conftest import simulated
from scipy.signal import freqz

import flexure


@pytest.fixture(scope="module")
def short():
    return simulated(n=1200, seed=11)


@pytest.fixture(scope="module")
def expected(short):
    return flexure.Hammerstein().fit(short.u, short.y, dt=0.01, input="torque", output="speed").to_dict()


def _times(n, step="10ms"):
    return pd.date_range("2026-01-01", periods=n, freq=step)


def test_pandas(short, expected):
    frame = pd.DataFrame({"torque": short.u, "speed": short.y, "other": 0.0}, index=_times(len(short.u)))
    by_name = flexure.Hammerstein().fit(frame, input="torque", output="speed")
    series = flexure.Hammerstein().fit(frame["torque"], frame["speed"])
    column = frame.reset_index(drop=True).assign(t=0.01 * np.arange(len(frame)))
    timed = flexure.Hammerstein().fit(column, input="torque", output="speed")
    for model in (by_name, series):
        assert model.to_dict() == expected
    assert timed.dt_ == pytest.approx(0.01) and timed.input_ == "torque"
    np.testing.assert_array_equal(by_name.simulate(frame), by_name.simulate(short.u))
    np.testing.assert_array_equal(by_name.predict(frame, horizon=3), by_name.predict(short.u, short.y, 3))
    assert by_name.score(frame) == by_name.score(short.u, short.y)
    nullable = frame.astype({"torque": "Float64", "speed": "Float32"})
    assert flexure.Hammerstein().fit(nullable, input="torque", output="speed").dt_ == pytest.approx(0.01)


def test_polars(short, expected):
    polars = pytest.importorskip("polars")
    frame = polars.DataFrame({"torque": short.u, "speed": short.y, "t": 0.01 * np.arange(len(short.u))})
    model = flexure.Hammerstein().fit(frame, input="torque", output="speed")
    assert model.dt_ == pytest.approx(0.01)
    assert model.to_dict()["block"] == expected["block"]
    assert flexure.Hammerstein().fit(frame["torque"], frame["speed"], dt=0.01).to_dict() == expected


def test_xarray(short, expected):
    xarray = pytest.importorskip("xarray")
    data = xarray.Dataset(
        {"torque": ("time", short.u), "speed": ("time", short.y)}, coords={"time": _times(len(short.u))}
    )
    assert flexure.Hammerstein().fit(data, input="torque", output="speed").to_dict() == expected
    assert flexure.Hammerstein().fit(data["torque"], data["speed"]).to_dict() == expected


def test_dicts(short, expected):
    data = {"torque": short.u, "speed": short.y}
    assert flexure.Hammerstein().fit(data, dt=0.01, input="torque", output="speed").to_dict() == expected


def test_python_control(short):
    control = pytest.importorskip("control")
    plant = control.tf([0.2, 0.15], [1, -1.2, 0.55], 0.01)
    time = 0.01 * np.arange(3000)
    u = np.random.default_rng(1).normal(size=3000)
    response = control.forced_response(plant, time, u)
    model = flexure.Hammerstein().fit(response)
    assert model.dt_ == pytest.approx(0.01) and (model.input_, model.output_) == ("u[0]", "y[0]")
    tf, ss = model.to_control(), model.to_control("ss")
    omega = np.logspace(-1, np.log10(0.99 * np.pi / 0.01), 50)
    own = model.linear_.frequency_response(omega)
    for system in (tf, ss):
        assert system.dt == pytest.approx(0.01)
        np.testing.assert_allclose(np.squeeze(system(np.exp(1j * omega * 0.01))), own, rtol=1e-6, atol=1e-12)
    scale = plant(1) / own[0].real
    np.testing.assert_allclose(own * scale.real, plant(np.exp(1j * omega * 0.01)), rtol=0.05, atol=0.02)
    np.testing.assert_allclose(
        np.sort_complex(model.linear_.poles), np.sort_complex(control.poles(tf)[np.abs(control.poles(tf)) > 1e-9]), rtol=1e-6
    )
    with pytest.raises(flexure.DataError, match="no input 'v'"):
        flexure.Hammerstein().fit(response, input="v")


def test_scipy_agrees(fitted):
    part = fitted.linear_
    omega = np.linspace(0.01, 3.1, 60)
    _, response = freqz(part.b, part.a, omega)
    np.testing.assert_allclose(part.frequency_response(omega / part.dt), response, rtol=1e-9)
    assert part.static_gain == pytest.approx(1.0)


def test_statsmodels_agrees():
    """The local constant and local linear estimates of `KernelReg`, which has the Gaussian kernel."""
    kernel = pytest.importorskip("statsmodels.nonparametric.kernel_regression")
    rng = np.random.default_rng(3)
    x = rng.uniform(-1, 1, 300)
    y = np.sin(3 * x) + 0.1 * rng.normal(size=300)
    at = np.linspace(-0.8, 0.8, 17)
    for degree, kind in ((0, "lc"), (1, "ll")):
        theirs = kernel.KernelReg(y, x, "c", reg_type=kind, bw=[0.15]).fit(at)[0]
        own = flexure.KernelRegressor(degree, bandwidth=0.15, kernel="gaussian").fit(x[:, None], y).predict(at[:, None])
        np.testing.assert_allclose(own, theirs, rtol=1e-8)


def test_frames_out(fitted, record):
    frame = fitted.to_frame()
    assert list(frame.columns) == ["t", "u", "y", "simulated", "residual", "fresh"]
    np.testing.assert_array_equal(frame["simulated"] + frame["residual"], fitted.predicted_ + (record.y - fitted.predicted_))
    assert frame["fresh"].sum() == len(record.u) - fitted.fitted_
    assert list(fitted.nonlinearity_.to_frame().columns) == ["x", "y", "lower", "upper"]
    assert len(fitted.verdict_.to_frame()) == len(fitted.verdict_.tests)
    polars = pytest.importorskip("polars")
    assert isinstance(fitted.to_frame("polars"), polars.DataFrame)
    with pytest.raises(flexure.ParameterError, match="pandas or polars"):
        fitted.to_frame("excel")


INDEXES = {
    "zone": lambda n: _times(n).tz_localize("Europe/Warsaw"),
    "period": lambda n: pd.period_range("2024-01-01", periods=n, freq="10ms"),
    "objects": lambda n: pd.Index([time.to_pydatetime() for time in _times(n)], dtype=object),
    "unnamed": lambda n: pd.Index(0.01 * np.arange(n)),
    "with a unit": lambda n: pd.Index(0.01 * np.arange(n), name="Time [s]"),
}


@pytest.mark.parametrize("kind", INDEXES)
def test_every_index_of_times_gives_the_sample_time(short, expected, kind):
    frame = pd.DataFrame({"torque": short.u, "speed": short.y}, index=INDEXES[kind](len(short.u)))
    assert flexure.Hammerstein().fit(frame, input="torque", output="speed").to_dict() == expected
    with pytest.raises(flexure.DataError, match="not uniform: the step to sample 500"):
        flexure.Hammerstein().fit(frame.drop(frame.index[500]), input="torque", output="speed")


def test_columns_of_times_give_the_sample_time(short, expected):
    polars = pytest.importorskip("polars")
    numbers = 0.01 * np.arange(len(short.u))
    for name, column in (("t", _times(len(short.u)).to_numpy()), ("time", numbers), ("Time / s", numbers)):
        frame = polars.DataFrame({name: column, "torque": short.u, "speed": short.y})
        for table in (frame, frame.lazy()):
            assert flexure.Hammerstein().fit(table, input="torque", output="speed").to_dict() == expected
    fields = np.rec.fromarrays([short.u, short.y, numbers], names="torque,speed,t")
    assert flexure.Hammerstein().fit(fields, input="torque", output="speed").to_dict() == expected


def test_numbers_name_columns_without_a_header(short):
    frame = pd.DataFrame(np.column_stack([short.u, short.y]))
    model = flexure.Hammerstein().fit(frame, input=0, output=1)
    assert (model.input_, model.output_) == ("0", "1") and model.dt_ is None  # a plain count of rows is no time
    with pytest.raises(flexure.DataError, match="2 columns are called 'u'"):
        flexure.Hammerstein().fit(pd.DataFrame(frame.to_numpy(), columns=["u", "u"]), input="u", output="y")


def test_signals_at_different_times_are_said(short):
    u, y = (pd.Series(values, index=_times(len(short.u))) for values in (short.u, short.y))
    with pytest.raises(flexure.DataError, match="'y' is 0.01 s away from the input at sample 0"):
        flexure.Hammerstein().fit(u, y.shift(1, freq="10ms"))
    model = flexure.Hammerstein().fit(u, y)
    with pytest.raises(flexure.DataError, match="'y' is 0.01 s away from the input at sample 0"):
        model.predict(u, y.shift(1, freq="10ms"))
    slow = pd.date_range("2024-01-01", periods=len(u), freq="20ms")
    for use in (model.simulate, lambda u: model.predict(u, short.y), lambda u: model.score(u, y.set_axis(slow))):
        with pytest.raises(flexure.DataError, match="the model's sample time is 0.01 s, but the record's is 0.02 s"):
            use(u.set_axis(slow))
    np.testing.assert_array_equal(model.simulate(u.shift(3, freq="1h")), model.simulate(short.u))


@pytest.mark.parametrize("dt", [0, -1.0, np.nan, np.inf, "0.1", 1j, [0.1, 0.2]])
def test_wrong_sample_times_are_said(short, dt):
    with pytest.raises(flexure.ParameterError, match="dt is .*, but must be positive and finite, in s"):
        flexure.Hammerstein().fit(short.u, short.y, dt=dt)


def test_wrong_tables_are_said(short):
    frame = pd.DataFrame({"torque": short.u, "speed": short.y}, index=_times(len(short.u)))
    fit = flexure.Hammerstein().fit
    with pytest.raises(flexure.DataError, match="no column 'x'; the columns are: torque, speed"):
        fit(frame, input="x", output="speed")
    with pytest.raises(flexure.ParameterError, match="name the table's columns"):
        fit(frame)
    with pytest.raises(flexure.DataError, match="there is no output"):
        fit(short.u)
    with pytest.raises(flexure.DataError, match="sample time is 0.01 s, but dt is 0.02 s"):
        fit(frame, input="torque", output="speed", dt=0.02)
    with pytest.raises(flexure.DataError, match="the sample times are not uniform: the step to sample 500"):
        fit(pd.concat([frame[:500], frame[501:]]), input="torque", output="speed")
    with pytest.raises(flexure.DataError, match="the sample times do not increase"):
        fit(frame[::-1], input="torque", output="speed")
    with pytest.raises(TypeError, match="'torque' holds text"):
        fit(frame.astype({"torque": str}), input="torque", output="speed")


def test_simulating_needs_no_index(fitted):
    u = pd.Series([0.1, 0.2, -0.4], index=[5, 9, 1])
    np.testing.assert_array_equal(fitted.simulate(u), fitted.simulate(u.to_numpy()))
