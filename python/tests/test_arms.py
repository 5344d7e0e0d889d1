"""Arms and joints: the command line's numbers, and the truth that was simulated."""

import json
import pickle
import re

import numpy as np
import pandas as pd
import pytest
from conftest import write_csv

import flexure


def test_a_simulation_is_the_command_lines(tmp_path, command):
    arm = flexure.Arm.preset("space-arm")
    path = tmp_path / "arm.toml"
    path.write_text(arm.toml)
    command("simulate", path, "-o", tmp_path / "record.csv")
    theirs = np.genfromtxt(tmp_path / "record.csv", delimiter=",", names=True)
    own = flexure.Arm.from_toml(path).simulate()
    assert tuple(own) == theirs.dtype.names
    for name, values in own.items():
        np.testing.assert_array_equal(values, theirs[name])
    assert len(own["t"]) == round(arm.duration / arm.dt) + 1


def test_own_torques():
    arm = flexure.Arm.preset("frictionless")
    torque = np.random.default_rng(1).normal(size=(201, 2))
    record = arm.simulate(torque)
    np.testing.assert_array_equal(record["tau1"], torque[:, 0])
    np.testing.assert_allclose(np.diff(record["t"]), arm.dt)
    batch = arm.simulate_batch([torque, 2 * torque, torque[:50]])
    np.testing.assert_array_equal(batch[0]["q2"], record["q2"])
    assert np.ptp(batch[1]["q2"]) > np.ptp(batch[0]["q2"]) and len(batch[2]["t"]) == 50
    bent = arm.simulate(deflection=0.01 * torque)
    np.testing.assert_allclose(bent["qm1"] - bent["q1"], 0.01 * torque[:, 0], atol=1e-12)


def test_frames_out():
    record = flexure.Arm.preset("frictionless").simulate(np.zeros((5, 2)))
    frame = pd.DataFrame(record)
    assert list(frame.columns)[:3] == ["t", "tau1", "tau2"] and len(frame) == 5
    polars = pytest.importorskip("polars")
    assert polars.DataFrame(record).shape == frame.shape


def test_what_is_wrong_is_said(tmp_path):
    with pytest.raises(flexure.FlexureError, match="no preset 'x'; the presets are: space-arm"):
        flexure.Arm.preset("x")
    with pytest.raises(flexure.FileError, match="cannot read"):
        flexure.Arm.from_toml(tmp_path / "none.toml")
    text = flexure.Arm.preset("space-arm").toml
    with pytest.raises(flexure.FlexureError, match="line [0-9]+: .*mass"):
        flexure.Arm.from_text(text.replace("mass = 1.5075", "mass = -1", 1))
    arm = flexure.Arm.from_text(text)
    with pytest.raises(flexure.DataError, match=r"'torque' has the shape \(5,\)"):
        arm.simulate(np.zeros(5))
    with pytest.raises(flexure.TooShortError, match="has 1 rows, but a simulation needs at least 2"):
        arm.simulate(np.zeros((1, 2)))
    with pytest.raises(flexure.DataError, match="tau1.*NaN|NaN.*tau1"):
        arm.simulate(np.full((5, 2), np.nan))
    with pytest.raises(flexure.ParameterError, match="not both"):
        arm.simulate(np.zeros((5, 2)), deflection=np.zeros((5, 2)))
    with pytest.raises(flexure.ParameterError, match="max_steps is 3, but must be at least the number of samples"):
        flexure.Arm.from_text(text.replace("[run]", "[run]\nmax_steps = 3")).simulate()


def _without(theirs, *names):
    return {k: v for k, v in theirs.items() if k not in ("samples", "sample_time", "report", *names)}


_RUN = """
[run]
duration = 20.0
sample_time = 0.002

[excitation]
kind = "multisine"
amplitude = [40.0, 20.0]
f_min = 0.05
f_max = 3.0

[noise]
std = { tau1 = 0.4, tau2 = 0.2, q1 = 1e-5, q2 = 1e-5 }
"""


@pytest.fixture(scope="module")
def two_links():
    """Both joints under multisines, 20 s, with the noise of torques and encoders."""
    text = flexure.Arm.preset("space-arm").toml
    run = _RUN.replace("q2 = 1e-5", "q2 = 1e-5, qm1 = 1e-5, qm2 = 1e-5")
    return flexure.Arm.from_text(text[: text.index("[run]")] + run).simulate()


@pytest.fixture(scope="module")
def axis():
    """The elbow of a rigid arm whose shoulder is locked."""
    text = flexure.Arm.preset("space-arm").toml.replace('model = "nonlinear"', 'model = "rigid"')
    text = text.replace("[[arm.joint]] ", "[[arm.joint]]\nlocked = true ", 1)
    return flexure.Arm.from_text(text[: text.index("[run]")] + _RUN).simulate()


def same_page(found, page, folder):
    """The page of the command line, except for the file's name and the command that makes it."""
    found.report(folder / "own.html")
    own, theirs = (re.sub(r"<!--.*?-->", "", path.read_text(), flags=re.DOTALL) for path in (folder / "own.html", page))
    assert own.count("<svg") == theirs.count("<svg") and own.count("<table") == theirs.count("<table")
    assert abs(len(own) - len(theirs)) < 2000


def test_a_flexible_joint_in_an_arm(tmp_path, command):
    text = flexure.Arm.preset("space-arm").toml.replace("[[arm.joint]] ", "[[arm.joint]]\nlocked = true ", 1)
    log = flexure.Arm.from_text(text[: text.index("[run]")] + _RUN.replace("q2 = 1e-5", "q2 = 1e-5, qm2 = 1e-5")).simulate()
    path = write_csv(tmp_path / "log.csv", t=log["t"], m=log["qm2"], q=log["q2"], tau=log["tau2"])
    page, file = tmp_path / "page.html", tmp_path / "arm.toml"
    command("joint", path, "--motor", "m", "--link", "q", "--torque", "tau", "--arm-joint", "2", "--arm", file, "--report", page)
    joint = flexure.identify_joint(log["tau2"], motor=log["qm2"], link=log["q2"], dt=0.002)
    assert joint.kind == "flexible" and joint.arm(2).toml == file.read_text()
    same_page(joint, page, tmp_path)
    again = joint.arm(2).simulate(np.column_stack([np.zeros_like(log["tau2"]), log["tau2"]]))
    assert np.std(again["q2"] - log["q2"]) < 0.05 * np.std(log["q2"])
    with pytest.raises(flexure.ParameterError, match="joint is 3, but must be 1"):
        joint.arm(3)


def test_an_arm_is_identified_as_on_the_command_line(two_links, tmp_path, command):
    path = write_csv(tmp_path / "log.csv", **two_links)
    page, file = tmp_path / "page.html", tmp_path / "other" / "arm.toml"
    file.parent.mkdir()
    columns = ["--motor", "qm1,qm2", "--link", "q1,q2", "--torque", "tau1,tau2"]
    done = command("joint", path, *columns, "--report", page, "--arm", file, "--json")
    log = two_links
    pair = lambda name: np.column_stack([log[f"{name}1"], log[f"{name}2"]])  # noqa: E731
    arm = flexure.identify_joint(pair("tau"), motor=pair("qm"), link=pair("q"), dt=0.002)
    assert arm.result == _without(json.loads(done.stdout), "replay", "written")
    assert arm.arm().toml == file.read_text()
    arm.arm().to_toml(tmp_path / "own.toml")
    assert flexure.Arm.from_toml(tmp_path / "own.toml").toml == file.read_text()
    same_page(arm, page, tmp_path)
    with pytest.raises(flexure.FlexureError, match="report needs the log"):
        pickle.loads(pickle.dumps(arm)).report(tmp_path / "none.html")
    truth = 2.544 + 1.5075 * 2.25**2
    assert abs(arm.elbow.value - truth) < 4 * arm.elbow.error + 0.01 * truth
    shoulder = arm.joints[0]
    assert shoulder.kind == "flexible" and abs(shoulder.motor_inertia.value - 1.0) < 0.05
    slope = np.polyfit(shoulder.stiffness.x, shoulder.stiffness.y, 1)[0]  # N m/rad; the truth bends around 500
    assert 400 < slope < 600 and np.all(shoulder.friction.lower < shoulder.friction.upper)


def test_a_rigid_axis_is_identified_as_on_the_command_line(axis, tmp_path, command):
    path = write_csv(tmp_path / "log.csv", t=axis["t"], q=axis["q2"], tau=axis["tau2"])
    page, file = tmp_path / "page.html", tmp_path / "arm.toml"
    wanted = ["--arm-joint", "2", "--arm", file, "--report", page, "--json"]
    done = command("joint", path, "--position", "q", "--torque", "tau", *wanted)
    found = flexure.identify_joint(axis["tau2"], position=axis["q2"], dt=0.002)
    assert found.kind == "rigid" and found.motor_inertia is None and found.stiffness is None
    assert found.result == _without(json.loads(done.stdout), "replays", "friction_file", "arm")
    assert found.best_friction.name == found.result["best_form"]
    same_page(found, page, tmp_path)
    assert found.arm(2).toml == file.read_text()
    heavy = flexure.identify_joint(axis["tau2"], position=axis["q2"], dt=0.002, gravity=True)
    with pytest.raises(flexure.FlexureError, match="an arm file has no gravity or spring"):
        heavy.arm(2)
    truth = 2.544 + 1.5075 * 2.25**2
    assert abs(found.inertia.value - truth) < 4 * found.inertia.error + 0.01 * truth


def test_a_joint_is_judged_on_another_log_as_on_the_command_line(axis, two_links, tmp_path, command):
    half = len(axis["t"]) // 2
    first, second = ({name: axis[name][part] for name in ("t", "q2", "tau2")} for part in (slice(half), slice(half, None)))
    paths = [write_csv(tmp_path / f"{name}.csv", **log) for name, log in (("first", first), ("second", second))]
    done = command("joint", paths[0], "--position", "q2", "--torque", "tau2", "--validate", paths[1], "--json")
    theirs = json.loads(done.stdout)["later"]
    joint = flexure.identify_joint("tau2", position="q2", data=first)
    later = joint.validate("tau2", position="q2", data=second)
    assert later.holds and theirs["holds"]
    assert (later.torque_rms, later.torque_fit_percent) == (theirs["torque"]["rms"], theirs["torque"]["fit_percent"])
    assert later.own_torque_fit_percent == theirs["torque"]["own_fit_percent"]
    assert [motion.rms for motion in later.motions] == [motion["rms"] for motion in theirs["motions"]]
    # A torque of another unit by its constant, and an axis that is half as heavy.
    scaled = flexure.identify_joint(first["tau2"] / 5, position=first["q2"], dt=0.002, torque_constant=5)
    at_motor = flexure.identify_joint(first["tau2"] / 5, motor=5 * first["q2"], dt=0.002, gear_ratio=5)
    assert at_motor.kind == "rigid" and at_motor.inertia.value == pytest.approx(scaled.inertia.value, rel=1e-6)
    assert scaled.validate(second["tau2"] / 5, position=second["q2"], dt=0.002).torque_rms == pytest.approx(later.torque_rms, rel=1e-6)
    assert not joint.validate(second["tau2"] / 2, position=second["q2"], dt=0.002).holds
    with pytest.raises(flexure.ParameterError, match="needs the columns of the one that was fitted"):
        joint.validate("tau2", motor="qm2", link="q2", data=two_links)
    with pytest.raises(flexure.DataError, match="NaN"):
        joint.validate(np.where(second["t"] < 10.1, np.nan, second["tau2"]), position=second["q2"], dt=0.002)
    with pytest.raises(flexure.DataError, match="has 5 samples"):
        joint.validate(second["tau2"][:5], position=second["q2"], dt=0.002)
    pair = {"motor": ["qm1", "qm2"], "link": ["q1", "q2"], "data": two_links}
    arm = flexure.identify_joint(["tau1", "tau2"], **pair)
    again = arm.validate(["tau1", "tau2"], **pair)
    assert again.holds and np.isnan(again.torque_rms) and again.motions == arm.motions


def test_a_gear_between_motor_and_link(two_links):
    log = two_links
    direct = flexure.identify_joint(log["tau2"], motor=log["qm2"], link=log["q2"], dt=0.002)
    geared = flexure.identify_joint(log["tau2"] / 50, motor=50 * log["qm2"], link=log["q2"], dt=0.002, gear_ratio=50)
    assert geared.inertia.value == pytest.approx(direct.inertia.value, rel=1e-6)
    with pytest.raises(flexure.ParameterError, match="gear_ratio is -1"):
        flexure.identify_joint(log["tau2"], position=log["q2"], dt=0.002, gear_ratio=-1)


def test_wrong_logs_are_said(two_links):
    log = two_links
    with pytest.raises(flexure.ParameterError, match="position of a rigid axis, its motor's angle, or motor and link"):
        flexure.identify_joint(log["tau1"], dt=0.002)
    with pytest.raises(flexure.ParameterError, match="two columns each"):
        flexure.identify_joint(log["tau1"], motor=np.zeros((9, 2)), link=np.zeros((9, 2)), dt=0.002)
    with pytest.raises(flexure.DataError, match="NaN"):
        flexure.identify_joint(log["tau1"], position=np.where(log["t"] == 0.02, np.nan, log["q1"]), dt=0.002)
    with pytest.raises(flexure.FlexureError, match="comes out negative"):
        flexure.identify_joint(-log["tau2"], motor=log["qm2"], link=log["q2"], dt=0.002)


def test_signals_out_of_a_table(two_links):
    """Signals by name, with the sample time from the times. Errors name signals that belong to another kind of joint."""
    frame = pd.DataFrame(two_links)
    log = {"torque": "tau2", "motor": "qm2", "link": "q2"}
    expected = flexure.identify_joint(two_links["tau2"], motor=two_links["qm2"], link=two_links["q2"], dt=0.002)
    for data in (frame, frame.drop(columns="t").set_index(pd.to_timedelta(frame["t"], unit="s"))):
        found = flexure.identify_joint(**log, data=data)
        assert found.result["link_inertia"]["value"] == pytest.approx(expected.result["link_inertia"]["value"], rel=1e-9)
    arm = flexure.identify_joint(["tau1", "tau2"], motor=["qm1", "qm2"], link=["q1", "q2"], data=two_links)
    assert arm.result["joint"] == "two_link_arm" and len(arm.plot().axes) == 4
    with pytest.raises(flexure.DataError, match="no column 'q3'"):
        flexure.identify_joint("tau1", motor="qm1", link="q3", data=frame)
    with pytest.raises(flexure.DataError, match="sample time is 0.002 s, but dt is 0.01 s"):
        flexure.identify_joint(**log, data=frame, dt=0.01)
    with pytest.raises(flexure.ParameterError, match="the sample time is not known; give dt"):
        flexure.identify_joint(**log, data=frame.drop(columns="t"))
    for name in ("velocity", "gravity", "spring", "prismatic"):
        with pytest.raises(flexure.ParameterError, match=f"{name} is for a rigid axis"):
            flexure.identify_joint(**log, data=frame, **{name: "dq2" if name == "velocity" else True})
    with pytest.raises(flexure.ParameterError, match="motor_inertia is for a flexible joint"):
        flexure.identify_joint("tau2", position="q2", data=frame, motor_inertia=1.0)


def test_an_arm_file_names_records_beside_it_unless_all_paths_are_allowed(tmp_path):
    (tmp_path / "arms").mkdir()
    (tmp_path / "tau.csv").write_text("tau1,tau2\n" + "1,2\n" * 21)
    (tmp_path / "secret.csv").write_text("user,password\nalice,hunter2\n")
    text = flexure.Arm.preset("frictionless").toml
    path = tmp_path / "arms" / "arm.toml"

    def named(name):
        path.write_text(text[: text.index("[excitation]")] + f'[excitation]\nkind = "record"\nfile = "{name}"\n')

    named("../tau.csv")
    with pytest.raises(flexure.FlexureError, match="allow_paths=True"):
        flexure.Arm.from_toml(path).simulate()
    allowed = pickle.loads(pickle.dumps(flexure.Arm.from_toml(path, allow_paths=True).with_(duration=2.0)))
    assert allowed.simulate()["tau2"][3] == 2
    named("../secret.csv")
    with pytest.raises(flexure.FlexureError) as error:
        flexure.Arm.from_toml(path, allow_paths=True).simulate()
    assert not any(word in str(error.value) for word in ("hunter2", "password", "alice"))


def test_arms_go_to_other_processes(tmp_path):
    (tmp_path / "arm.toml").write_text(flexure.Arm.preset("frictionless").toml)
    for arm in (flexure.Arm.preset("frictionless"), flexure.Arm.from_toml(tmp_path / "arm.toml")):
        again = pickle.loads(pickle.dumps(arm))
        assert again.toml == arm.toml and (again._core.name, again._core.folder) == (arm._core.name, arm._core.folder)
        np.testing.assert_array_equal(again.simulate(np.ones((20, 2)))["q1"], arm.simulate(np.ones((20, 2)))["q1"])
    with pytest.raises(TypeError, match="an arm is made by Arm.preset"):
        flexure.Arm("space-arm")
