"""What fitted objects say of themselves, and arrays of shape (n, 1) wherever one of shape (n,) goes."""

import doctest
import importlib
import json

import flexure
import numpy as np
import pandas as pd
import pytest
from conftest import simulated, write_csv


@pytest.fixture(scope="module")
def axis_log():
    """A prismatic axis of 95 kg with friction 20 v + 8 sign v, in a position loop."""
    n, dt = 8000, 0.001
    t = np.arange(n) * dt
    w, amplitude = 2 * np.pi * np.array([0.4, 1.1, 2.3, 3.7]), np.array([0.1, 0.05, 0.02, 0.008])
    phase = np.array([0.3, 1.0, 2.0, 4.0])
    inner = np.outer(t, w) + phase
    q, v, a = np.sin(inner) @ amplitude, np.cos(inner) @ (amplitude * w), -np.sin(inner) @ (amplitude * w**2)
    force = 95 * a + 20 * v + 8 * np.tanh(200 * v)
    rng = np.random.default_rng(4)
    return {"t": t, "q": q + 1e-6 * rng.normal(size=n), "u": force / 35 + 0.002 * rng.normal(size=n), "qg": q + v / 160}


@pytest.fixture(scope="module")
def axis(axis_log):
    log = axis_log
    return flexure.identify_joint(log["u"], position=log["q"], dt=0.001, prismatic=True, torque_constant=35.0)


def column(values):
    return np.asarray(values)[:, np.newaxis]


def test_columns_of_shape_n_1_are_signals():
    record = simulated(n=1500)
    plain = flexure.Hammerstein().fit(record.u, record.y, dt=0.01)
    for u, y in [
        (column(record.u), column(record.y)),
        (pd.DataFrame({"u": record.u}), pd.DataFrame({"y": record.y})),
        (np.asfortranarray(column(record.u)), record.y),
    ]:
        model = flexure.Hammerstein().fit(u, y, dt=0.01)
        np.testing.assert_array_equal(model.linear_.b, plain.linear_.b)
        np.testing.assert_array_equal(model.simulate(u), plain.simulate(record.u))
        np.testing.assert_array_equal(model.predict(u, y, 3), plain.predict(record.u, record.y, 3))
        assert model.validate(u, y).fit_percent == plain.validate(record.u, record.y).fit_percent
        assert model.score(u, y) == plain.score(record.u, record.y)
    several = flexure.MultipleInputs().fit(column(record.u), column(record.y), dt=0.01)
    assert several.verdict_.fit_percent > 80
    np.testing.assert_array_equal(several.simulate(column(record.u)), several.simulate(record.u))


@pytest.mark.filterwarnings("ignore::sklearn.exceptions.DataConversionWarning")
def test_columns_of_shape_n_1_are_regressands():
    rng = np.random.default_rng(1)
    x, y = rng.uniform(-1, 1, 300), rng.normal(size=300)
    at = np.linspace(-1, 1, 7)
    for regressor in (flexure.KernelRegressor, flexure.SplineRegressor, flexure.KNNRegressor, flexure.SeriesRegressor):
        expected = regressor().fit(x[:, np.newaxis], y).predict(at[:, np.newaxis])
        np.testing.assert_array_equal(regressor().fit(column(x), column(y)).predict(column(at)), expected)


def test_columns_of_shape_n_1_are_logs_of_joints(axis_log, axis):
    log = {name: column(values) for name, values in axis_log.items()}
    found = flexure.identify_joint(log["u"], position=log["q"], dt=0.001, prismatic=True, torque_constant=35.0)
    assert found.inertia == axis.inertia
    with pytest.raises(flexure.DataError, match=r"'torque' has the shape \(5, 3\)"):
        flexure.identify_joint(np.zeros((5, 3)), position=np.zeros(5), dt=0.1)


def test_a_fitted_model_says_what_it_is(fitted):
    assert repr(flexure.Hammerstein(order=2)) == "Hammerstein(order=2)"
    fit = f"{fitted.verdict_.fit_percent:.2f}"
    assert repr(fitted).startswith(f"<Hammerstein from u to y: order {fitted.order_}, delay {fitted.delay_}; fit {fit} %")
    assert repr(fitted).endswith(", holds>") == fitted.verdict_.holds
    assert repr(flexure.Hammerstein.from_json(fitted.to_json())) == repr(fitted)


def test_a_model_that_does_not_hold_says_so():
    record = simulated(n=2000, phi=lambda u: u + u**2)
    linear = flexure.Linear().fit(record.u, record.y, dt=0.01)
    assert flexure.estimator("linear") is flexure.Linear
    assert linear.linear_.order > 0 and linear.form_ is None
    assert not linear.verdict_.holds and repr(linear).endswith("does not hold>")


def test_a_form_is_typed():
    record = simulated(n=2000)
    model = flexure.Hammerstein(form="dead-zone").fit(record.u, record.y, dt=0.01)
    form, found = model.form_, model.result_["form"]
    assert isinstance(form, flexure.FormTest) and form.name == found["name"] and form.holds is found["holds"]
    assert form.statistic < form.limit and form.p_value > 0.01
    for parameter in found["parameters"]:
        assert form.parameters[parameter["name"]].value == parameter["value"]
    ends = [p.value for p in form.parameters.values()]
    assert any(abs(end - 0.5) < 0.05 for end in ends) and any(abs(end + 0.5) < 0.05 for end in ends), form
    # Without a form that is asked for, it is one that suffices.
    free = flexure.Hammerstein().fit(record.u, record.y)
    assert free.form_.name == "dead-zone" and not free.result_["form"]["asked"]
    with pytest.raises(AttributeError):
        _ = flexure.Hammerstein().form_


def test_a_comparison_is_typed():
    record = simulated(n=2000)
    auto = flexure.Auto().fit(record.u, record.y, dt=0.01)
    comparison, found = auto.comparison_, auto.result_["comparison"]
    assert isinstance(comparison, flexure.Comparison)
    assert comparison.best == auto.structure_ == "hammerstein" and comparison.supported is found["supported"] is True
    assert [c.structure for c in comparison.candidates] == [c["structure"] for c in found["candidates"]]
    frame = comparison.to_frame()
    assert bool(frame.set_index("structure").loc["linear", "refuted"]) and list(frame["rms"]) == [c["rms"] for c in found["candidates"]]
    assert repr(auto).startswith("<Auto (hammerstein) from u to y: ")
    again = flexure.Auto.from_json(auto.to_json())
    assert again.comparison_ == comparison


def test_a_joint_is_summarised_as_on_the_command_line(axis_log, tmp_path, command):
    path = write_csv(tmp_path / "log.csv", **axis_log)
    options = ["--position", "q", "--torque", "u", "--torque-constant", "35", "--prismatic", "--reference", "qg", "--kp", "160", "--kv", "243"]
    # The command says besides what to type next.
    text = command("joint", path, *options).stdout.split("\nnext: ")[0]
    theirs = json.loads(command("joint", path, *options, "--json").stdout)
    found = flexure.identify_joint("u", position="q", reference="qg", kp=160, kv=243, prismatic=True, torque_constant=35.0, data=axis_log)
    # The names of the log differ, and so does where lines are wrapped.
    assert found.summary().split() == text.replace("log.csv", "the log").split()
    assert abs(found.inertia.value - 95) < 1
    assert [m.drive for m in found.motions] == ["under the recorded torque", "in the position loop"]
    assert [(m.rms, m.fit_percent) for m in found.motions] == [(m["rms"], m["fit_percent"]) for m in theirs["replays"]]
    assert len(flexure.identify_joint("u", position="q", data=axis_log).motions) == 1


def test_a_position_loop_is_complete(axis_log):
    log = {"position": "q", "data": axis_log}
    for given in ({"reference": "qg"}, {"kp": 1.0}, {"reference": "qg", "kp": 1.0}):
        with pytest.raises(flexure.ParameterError, match="give all three, or none"):
            flexure.identify_joint("u", **log, **given)
    with pytest.raises(flexure.DataError, match="'reference' must have 8000 finite samples"):
        flexure.identify_joint(axis_log["u"], position=axis_log["q"], dt=0.001, reference=np.zeros(5), kp=1, kv=1)
    with pytest.raises(flexure.ParameterError, match="torque_constant is 'x'"):
        flexure.identify_joint("u", **log, torque_constant="x")
    with pytest.raises(flexure.ParameterError, match="kp is nan"):
        flexure.identify_joint("u", **log, reference="qg", kp=np.nan, kv=1)
    with pytest.raises(flexure.ParameterError, match="reference is for a rigid axis"):
        flexure.identify_joint("u", motor="q", link="q", reference="qg", kp=1, kv=1, data=axis_log)


def test_a_joint_shows_its_units(axis):
    assert axis.units == ("m", "N")
    assert repr(axis).startswith("<Rigid axis, inertia 9") and " kg, friction " in repr(axis)
    page = axis._repr_html_()
    assert "<svg" in page and "m/s" in page and page.count("<div") == page.count("</div")
    figure = axis.plot()
    labels = [(ax.get_xlabel(), ax.get_ylabel()) for ax in figure.axes]
    assert labels == [("velocity / (m/s)", "friction force / N")]


def test_parameters_of_forms_are_typed(axis):
    form = axis.best_friction
    for symbol, found in form.result["parameters"].items():
        parameter = form.parameters[symbol]
        assert (parameter.value, parameter.unit, parameter.identifiable) == (found["value"], found["unit"], found["identifiable"])
        assert parameter.error == found["standard_error"] or np.isnan(parameter.error)
    assert any("N" in parameter.unit and "m" not in parameter.unit for parameter in form.parameters.values())


def test_an_arm_with_other_values():
    arm = flexure.Arm.preset("space-arm")
    before = arm.toml
    other = arm.with_(duration=2, dt=0.002, model="rigid", joints=[{"locked": True}, {"friction": None}], initial={"q": np.array([0.1, 0.2])})
    assert (other.duration, other.dt) == (2.0, 0.002) and (arm.duration, arm.dt) == (10.0, 0.01) and arm.toml == before
    record = other.simulate()
    assert np.ptp(record["q1"]) == 0 and np.ptp(record["q2"]) > 0 and "qm1" not in record
    assert (record["q1"][0], record["q2"][0]) == (0.1, 0.2)
    assert "# A two-link space manipulator" in other.toml
    noisy = other.with_(noise={"std": {"q2": 1e-4}})
    assert np.std(noisy.simulate()["q2"] - record["q2"]) == pytest.approx(1e-4, rel=0.1)
    np.testing.assert_array_equal(noisy.with_(noise=False).simulate()["q2"], record["q2"])
    still = other.with_(excitation={"kind": "zero"}).simulate()
    assert np.ptp(still["tau2"]) == 0
    with pytest.raises(flexure.FlexureError, match="speed"):
        arm.with_(initial={"speed": 1})
    with pytest.raises(flexure.FlexureError, match="as many tables as the arm has"):
        arm.with_(joints=[{}, {}, {}])
    with pytest.raises(flexure.FlexureError, match="duration"):
        arm.with_(duration=-1)
    with pytest.raises(flexure.ParameterError, match="cannot have these values"):
        arm.with_(duration=np.nan)


def test_the_sample_time_is_a_short_decimal():
    record = simulated(n=1500)
    frame = {"t": 0.3 + np.arange(1500) * 0.01, "u": record.u, "y": record.y}
    assert flexure.Hammerstein().fit(frame, input="u", output="y").dt_ == 0.01
    index = pd.date_range("2024-05-01", periods=1500, freq="10ms")
    assert flexure.Hammerstein().fit(pd.Series(record.u, index), pd.Series(record.y, index)).dt_ == 0.01


@pytest.mark.parametrize("name", ["arms", "chains", "flexible_arms", "joints", "regression", "systems"])
def test_the_examples_in_the_documentation_run(name):
    results = doctest.testmod(importlib.import_module(f"flexure.{name}"))
    assert results.attempted > 0 and results.failed == 0
