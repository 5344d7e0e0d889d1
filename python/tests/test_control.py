"""Control scenarios and models that learn: the command line's numbers, and the truth that was simulated."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

import flexure
from flexure.control import Cusum, RecursiveFriction, RecursiveHammerstein, RecursiveLinear, Scenario

SHORT = """
[plant]
arm = "space-arm"
[trajectory]
kind = "moves"
postures = [[0.0, 0.6], [0.3, 1.0]]
duration = 2.0
[loop]
sample_time = 0.01
[[controller]]
kind = "pd-feedforward"
kp = [400.0, 300.0]
kd = [30.0, 20.0]
"""


def test_the_figures_are_the_command_lines(tmp_path, command):
    path = tmp_path / "scenario.toml"
    path.write_text(Scenario.preset("rest-to-rest").toml)
    theirs = json.loads(command("control", path, "--json").stdout)["results"]
    own = Scenario.from_toml(path).compare()
    assert [dict(row) for row in own] == theirs
    assert own["pd"].record is not None and "true_dqm2" in own["pd"].record


def test_a_linear_system_is_a_controller():
    gains = np.hstack([np.diag([400.0, 300.0]), np.diag([30.0, 20.0])])
    empty = SimpleNamespace(A=np.zeros((0, 0)), B=np.zeros((0, 4)), C=np.zeros((2, 0)), D=gains, dt=0.01)
    results = Scenario.from_text(SHORT).compare({"mine": empty})
    assert results["mine"]["tip_error_max_m"] == pytest.approx(results["pd-feedforward"]["tip_error_max_m"], rel=1e-9)
    with pytest.raises(KeyError, match="there are: pd-feedforward"):
        Scenario.from_text(SHORT).compare()["x"]


def test_systems_of_python_control_are_controllers():
    control = pytest.importorskip("control")
    gains = np.hstack([np.diag([400.0, 300.0]), np.diag([30.0, 20.0])])
    # PD behind a lag in continuous time, and the same sampled by python-control.
    lag = control.ss(-50 * np.eye(2), 50 * gains, np.eye(2), np.zeros((2, 4)))
    systems = {
        "unused states": control.ss(0.5 * np.eye(2), np.eye(2, 4), np.zeros((2, 2)), gains, 0.01),
        "no sample time": control.ss(0.5 * np.eye(2), np.eye(2, 4), np.zeros((2, 2)), gains, True),
        "continuous": lag,
        "sampled": control.sample_system(lag, 0.01),
    }
    results = Scenario.from_text(SHORT).compare(systems)
    error = {name: results[name]["tip_error_max_m"] for name in ["pd-feedforward", *systems]}
    assert error["unused states"] == pytest.approx(error["pd-feedforward"], rel=1e-9)
    assert error["no sample time"] == error["unused states"]
    assert error["continuous"] == pytest.approx(error["sampled"], rel=1e-9)
    assert error["continuous"] != pytest.approx(error["pd-feedforward"], rel=1e-3)


def test_systems_that_do_not_fit_are_refused_in_words():
    def system(states=2, inputs=4, outputs=2, dt=0.01):
        sizes = {"A": (states, states), "B": (states, inputs), "C": (outputs, states), "D": (outputs, inputs)}
        return SimpleNamespace(dt=dt, **{name: np.zeros(size) for name, size in sizes.items()})

    for wrong, message in [
        (system(dt=0.02), "'x' has a sample time of 0.02 s, but the loop one of 0.01 s"),
        (system(inputs=1, outputs=1), "'x' has 1 outputs and 1 inputs; it must have 2 outputs"),
        (system(inputs=4, outputs=1), "'x' has 1 outputs and 4 inputs"),
        (system(inputs=3), "'x' has 2 outputs and 3 inputs"),
        (SimpleNamespace(num=1, den=2), r"'x' has no A, B, C and D; make it a state space, as control.ss\(system\) does"),
        (SimpleNamespace(**{**vars(system()), "A": np.zeros((3, 3))}), "the number of elements of A"),
        (SimpleNamespace(**{**vars(system()), "A": np.full((2, 2), np.nan)}), "an element of A, B, C or D is NaN"),
    ]:
        with pytest.raises(flexure.ParameterError, match=message):
            Scenario.from_text(SHORT).compare({"x": wrong})
    for name, message in [
        ("pd-feedforward", "the name of system 1: 'pd-feedforward' is the name of another controller"),
        ("x" * 100_000, "the name of system 1: a name has at most 60 characters"),
    ]:
        with pytest.raises(flexure.FlexureError, match=message):
            Scenario.from_text(SHORT).compare({name: system()})


def test_a_flexible_link_learns_its_payload():
    results = Scenario.preset("flexible-link").compare()
    adaptive, fixed = results["model-reference differences"], results["model-reference, not adapted"]
    assert adaptive["tip_error_rms_m"] < 0.5 * fixed["tip_error_rms_m"]
    assert set(adaptive) == set(fixed)


def test_bad_scenarios_say_the_line():
    with pytest.raises(flexure.FlexureError, match=r"line 10: controller\[1\].kd: missing"):
        Scenario.from_text(SHORT.replace("kd = [30.0, 20.0]\n", "") + "\n")
    with pytest.raises(flexure.FlexureError, match="the presets are: square"):
        Scenario.preset("x")


def test_models_learn_what_was_simulated():
    rng = np.random.default_rng(1)
    u = rng.normal(size=20_000)
    w = u + 0.3 * u**2
    y = np.zeros(len(u))
    for k in range(2, len(u)):
        y[k] = 1.2 * y[k - 1] - 0.5 * y[k - 2] + 0.4 * w[k - 1]
    model = RecursiveHammerstein(2, 2)
    model.push(u[:100], y[:100])
    model = RecursiveHammerstein.from_bytes(model.to_bytes())
    model.push(u[100:], y[100:])
    np.testing.assert_allclose(model.estimate["a"], [1, -1.2, 0.5], atol=1e-8)
    np.testing.assert_allclose(model.estimate["b"][1] * model.estimate["powers"], [0.4, 0.12], atol=1e-8)
    linear = RecursiveLinear(1, forgetting=0.99)
    assert linear.estimate is None

    t = 0.01 * np.arange(4000)
    v = np.sin(2 * t) + 0.3 * np.sin(5.3 * t)
    dry = np.tanh(v / 0.01)
    middle = lambda x: 0.5 * (x[1:] + x[:-1])  # noqa: E731
    torque = np.concatenate([[0.0], 3 * np.diff(v) / 0.01 + middle(dry) + 0.5 * middle(v)])
    friction = RecursiveFriction(0.01)
    missed = friction.push(torque, v)
    assert abs(missed[-1]) < 1e-8
    found = friction.estimate
    np.testing.assert_allclose([found["inertia"], found["coulomb"], found["viscous"]], [3, 1, 0.5], atol=1e-8)

    # In a loop the input depends on the noise. An equation with white noise is still estimated without bias.
    e = 0.1 * rng.normal(size=100_000)
    u, y = np.zeros(len(e)), np.zeros(len(e))
    for k in range(1, len(e)):
        y[k] = 0.9 * y[k - 1] + 0.5 * u[k - 1] + e[k]
        u[k] = -0.6 * y[k] + 0.05 * rng.normal()
    looped = RecursiveLinear(1, delay=1)
    looped.push(u, y)
    np.testing.assert_allclose(looped.estimate["a"], [1, -0.9], atol=0.02)
    np.testing.assert_allclose(looped.estimate["b"] * looped.estimate["powers"], [0.5, 0], atol=0.03)

    detector = Cusum(1.0, quiet=1e5)
    noise = rng.normal(size=2000)
    noise[1000:] += 1
    detector.push(noise[:500])
    detector = Cusum.from_bytes(detector.to_bytes())
    (place, upwards), *_ = [(k + 500, up) for k, up in detector.push(noise[500:])]
    assert 1000 <= place < 1000 + 5 * detector.mean_delay and upwards
