"""Chains: many states at once are the states one by one, and agree with Pinocchio (see `scripts/reference/chains.py`)."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

import flexure

REFERENCE = Path(__file__).parents[2] / "crates" / "flexure-io" / "tests" / "data" / "chains.json"
CHAINS = json.loads(REFERENCE.read_text())


def _off(found, want):
    return np.abs(np.ravel(found) - np.ravel(want)).max() / np.abs(want).max()


@pytest.mark.parametrize("reference", CHAINS, ids=range(len(CHAINS)))
def test_batches_are_pinocchios(reference, tmp_path):
    path = tmp_path / "chain.urdf"
    path.write_text(reference["urdf"])
    chain = flexure.Chain.from_urdf(path, base=reference["base"])
    assert chain.joints == reference["joints"]
    states = reference["states"]
    q, v, a, tau, drive, acceleration = (
        np.array([state[name] for state in states]) for name in ["q", "v", "a", "tau", "drive", "acceleration"]
    )
    assert _off(chain.inverse_dynamics(q, v, a), tau) < 1e-12
    assert _off(chain.forward_dynamics(q, v, drive), acceleration) < 1e-12
    mass = chain.mass_matrix(q)
    upper = [matrix[np.triu_indices(chain.nv)] for matrix in mass]
    assert _off(upper, [state["mass"] for state in states]) < 1e-12
    regressor = chain.regressor(q, v, a)
    assert _off(regressor @ chain.inertial_parameters, tau) < 1e-12
    assert _off(regressor @ np.linspace(-1, 1, regressor.shape[-1]), [state["regressed"] for state in states]) < 1e-12
    along = np.linspace(-1, 1, chain.nv)
    for name, changes in [
        ("torque", chain.inverse_dynamics_derivatives(q, v, a)),
        ("acceleration", chain.forward_dynamics_derivatives(q, v, drive)),
    ]:
        for by, matrices in changes._asdict().items():
            assert _off(matrices @ along, [state[f"{name}_{by}"] for state in states]) < 1e-12
    assert _off(chain.energy(q, v).kinetic, [state["energy"][0] for state in states]) < 1e-12
    np.testing.assert_array_equal(mass[1], chain.mass_matrix(q[1]))
    np.testing.assert_array_equal(chain.forward_dynamics(q, v, drive)[0], chain.forward_dynamics(q[0], v[0], drive[0]))
    if reference["base"] == "free":
        momentum = chain.centroidal_momentum(q, v)
        found = np.concatenate([momentum.linear_momentum, momentum.angular_momentum], axis=1)
        assert _off(found, [state["momentum"] for state in states]) < 1e-12


def test_more_states_than_a_block():
    chain = flexure.Chain.from_text(CHAINS[0]["urdf"])
    rng = np.random.default_rng(1)
    q, v, tau = (rng.normal(size=(70_001, chain.nv)) for _ in range(3))
    a = chain.forward_dynamics(q, v, tau)
    for i in [0, 32_767, 32_768, 65_536, 70_000]:
        np.testing.assert_array_equal(a[i], chain.forward_dynamics(q[i], v[i], tau[i]))
    none = np.zeros((7, 0, chain.nv))
    assert chain.forward_dynamics(none, none, none).shape == (7, 0, chain.nv)


def test_what_is_wrong_is_said(tmp_path):
    text = CHAINS[0]["urdf"]
    chain = flexure.Chain.from_text(text)
    zero = np.zeros(chain.nv)
    with pytest.raises(flexure.DataError, match=r"'v' has the shape \(1,\), but this chain needs \(\.\.\., 2\)"):
        chain.forward_dynamics(zero, [0.0], zero)
    with pytest.raises(flexure.DataError, match=r"'tau' has \(3,\) states, but 'q' has \(\)"):
        chain.forward_dynamics(zero, zero, np.zeros((3, chain.nv)))
    with pytest.raises(flexure.ParameterError, match="gravity has 2 values"):
        flexure.Chain.from_text(text, gravity=(0, 0))
    with pytest.raises(flexure.FlexureError, match="'floating'"):
        flexure.Chain.from_text(text, base="floating")
    with pytest.raises(flexure.FileError, match="cannot read"):
        flexure.Chain.from_urdf(tmp_path / "none.urdf")
    with pytest.raises(flexure.FileError, match="the robot, line [0-9]+: joint '.*' has the type 'planar'"):
        flexure.Chain.from_text(re.sub('type="revolute"|type="prismatic"', 'type="planar"', text))
    free = flexure.Chain.from_text(text, base="free")
    with pytest.raises(flexure.FlexureError, match="quaternion"):
        free.mass_matrix(np.zeros(free.nq))


CHAIN_FILE = """
[chain]
gravity = [0.0, 0.0, 0.0]
[[chain.link]]
name = "arm"
joint = "shoulder"
mass = 2.0
com = [0.5, 0.0, 0.0]
inertia = [0.01, 0.1, 0.1, 0.0, 0.0, 0.0]
[chain.link.drive]
model = "linear"
motor_inertia = 0.4
stiffness = 300.0
"""


def test_a_flexible_joint_swings_with_its_own_frequency(tmp_path):
    path = tmp_path / "arm.toml"
    path.write_text(CHAIN_FILE)
    chain = flexure.Chain.from_toml(path)
    # Motor 0.4, link 0.6 kg m^2: from rest, the spring bent by 0.1 rad.
    run = chain.simulate(2.0, 0.01, motor_q=[0.1], rtol=1e-11)
    w = np.sqrt(300.0 * (1 / 0.4 + 1 / 0.6))
    np.testing.assert_allclose(run["qm_shoulder"] - run["q_shoulder"], 0.1 * np.cos(w * run["t"]), atol=1e-8)
    np.testing.assert_allclose(0.4 * run["qm_shoulder"] + 0.6 * run["q_shoulder"], 0.04, atol=1e-10)
    assert list(run) == ["t", "tau_shoulder", "q_shoulder", "qm_shoulder", "dq_shoulder", "dqm_shoulder"]


def test_a_motion_repeats_the_dynamics():
    chain = flexure.Chain.preset("six-joint-arm")
    tau = 0.01 * np.sin(np.arange(6.0))
    run = chain.simulate(0.2, 0.001, tau, rtol=1e-12)
    q, v = (np.column_stack([run[f"{kind}_{name}"] for name in chain.joints]) for kind in ("q", "dq"))
    a = chain.forward_dynamics(q[1:-1], v[1:-1], np.broadcast_to(tau, q[1:-1].shape))
    np.testing.assert_allclose((v[2:] - v[:-2]) / 0.002, a, atol=1e-3 * np.abs(a).max())


def test_a_base_that_accelerates_changes_gravity():
    t = np.linspace(0, 0.3, 31)
    lift = np.zeros((31, 7))
    lift[:, 2], lift[:, 6] = 0.5 * 3.0 * t**2, 1.0
    text = CHAINS[0]["urdf"]
    moved = flexure.Chain.from_text(text).simulate(0.3, 0.01, base=lift)
    heavy = flexure.Chain.from_text(text, gravity=(0.0, 0.0, -12.81)).simulate(0.3, 0.01)
    for name, values in heavy.items():
        np.testing.assert_allclose(moved[name], values, atol=1e-8)
    np.testing.assert_allclose(moved["base_vz"], 3.0 * t, atol=1e-9)
    with pytest.raises(flexure.ParameterError, match="floating base"):
        flexure.Chain.preset("space-manipulator").simulate(0.3, 0.01, base=lift)


def test_many_runs_are_each_as_alone(tmp_path):
    path = tmp_path / "arm.toml"
    path.write_text(CHAIN_FILE)
    chain, rng = flexure.Chain.from_toml(path), np.random.default_rng(1)
    q, torque = rng.normal(size=(5, 1)), rng.normal(size=(5, 21, 1))
    base = np.zeros((21, 7))
    base[:, 1], base[:, 6] = np.linspace(0, 1, 21) ** 3, 1.0
    runs = chain.simulate(1.0, 0.05, torque, q=q, motor_v=[0.3], base=base)
    assert runs["base_x"].shape == runs["qm_shoulder"].shape == (5, 21)
    for i in range(5):
        alone = chain.simulate(1.0, 0.05, torque[i], q=q[i], motor_v=[0.3], base=base)
        assert list(alone) == list(runs)
        for name, values in alone.items():
            assert np.array_equal(values, runs[name][i]), name
    # What is given once is that of all runs.
    shared = chain.simulate(1.0, 0.05, torque[2], q=q)
    assert np.array_equal(shared["q_shoulder"][4], chain.simulate(1.0, 0.05, torque[2], q=q[4])["q_shoulder"])
    with pytest.raises(flexure.DataError, match="3 and 5 runs"):
        chain.simulate(1.0, 0.05, torque[:3], q=q)
    torque[3, 7] = np.nan
    with pytest.raises(flexure.DataError, match="tau_shoulder") as raised:
        chain.simulate(1.0, 0.05, torque)
    assert raised.value.__notes__ == ["in run 3, counted from 0"]


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"duration": -1.0, "dt": 0.1}, "duration is -1"),
        ({"duration": 1.0, "dt": 0.1, "base": np.ones((5, 7))}, r"'base' has the shape \(5, 7\), but this run needs \(11, 7\)"),
        ({"duration": 1.0, "dt": 0.1, "base": np.zeros((11, 7))}, "quaternion in row 1"),
        ({"duration": 1.0, "dt": 0.1, "torque": [1.0]}, "torque"),
        ({"duration": 1.0, "dt": 0.1, "torque": np.zeros((5, 6))}, "tau_joint1"),
        ({"duration": 1.0, "dt": 0.1, "q": [0.0]}, "'q' has the shape"),
        ({"duration": 1.0, "dt": 0.1, "motor_q": [0.0]}, "'motor_q' has the shape"),
        ({"duration": 1.0, "dt": 0.1, "rtol": 5.0}, "rtol is 5"),
    ],
)
def test_bad_runs_are_refused(given, words):
    with pytest.raises(flexure.FlexureError, match=words):
        flexure.Chain.preset("six-joint-arm").simulate(**given)


def test_bad_chain_files_are_refused_with_line_and_key(tmp_path):
    path = tmp_path / "arm.toml"
    path.write_text(CHAIN_FILE.replace("stiffness = 300.0", "stiffness = -1.0"))
    with pytest.raises(flexure.FlexureError, match=r"line 13: chain.link\[1\].drive.stiffness"):
        flexure.Chain.from_toml(path)
    with pytest.raises(flexure.FlexureError, match="unknown preset|preset"):
        flexure.Chain.preset("seven-links")


BEAM = """[chain]
gravity = [0.0, 0.0, 0.0]
[[chain.link]]
name = "beam"
joint = "root"
type = "fixed"
axis = [0.0, 0.0, 1.0]
[chain.link.beam]
length = 2.0
stiffness = 300.0
density = 0.7
count = 10
springs = "middle"
"""


def test_a_clamped_beam_of_segments_vibrates_as_beams_do_and_no_torque_acts_on_it(tmp_path):
    (tmp_path / "beam.toml").write_text(BEAM)
    chain = flexure.Chain.from_toml(tmp_path / "beam.toml")
    assert len(chain.joints) == 10 and chain.driven == []
    # (beta L)^2 of a clamped-free beam; the errors of ten segments are 0.23 % and 0.80 %.
    exact = np.array([3.5160152685, 22.0344915647]) * np.sqrt(300.0 / 0.7) / 2.0**2 / (2 * np.pi)
    found = [mode.frequency for mode in chain.modes()[:2]]
    assert found / exact - 1 == pytest.approx([0.0022989, 0.0080167], rel=1e-4)
    run = chain.simulate(0.5, 0.01, v=np.full(10, 0.1))
    assert "tau_beam_bend1" not in run
    # The moment falls from the clamped end to the free one.
    bends = [np.ptp(run[f"q_beam_bend{i}"]) for i in range(1, 11)]
    assert bends[0] > 0.01 and np.all(np.diff(bends) < 0)
    with pytest.raises(flexure.DataError, match=r"this chain needs \(0,\)"):
        chain.simulate(0.5, 0.01, [1.0])


def test_the_same_beam_of_elements_or_modes_is_a_flexible_arm(tmp_path):
    path = tmp_path / "beam.toml"
    text = BEAM.replace("count = 10\nsprings = \"middle\"", "model = \"modes\"").replace("type = \"fixed\"\n", "")
    path.write_text(text)
    arm = flexure.FlexibleArm.from_toml(path)
    assert (arm.joints, arm.driven, arm.nq) == (["root"], ["root"], 4)
    exact = np.array([3.5160152685, 22.0344915647]) * np.sqrt(300.0 / 0.7) / 2.0**2 / (2 * np.pi)
    assert [mode.frequency for mode in arm.modes(motors="held")[:2]] == pytest.approx(exact, rel=1e-9)
    run = arm.simulate(0.1, 0.01, [1.0], q=[0.2, 0.0, 0.0, 0.0])
    assert run["q_root"][0] == 0.2 and run["q_root"][-1] > 0.2 and run["tip_beam"][-1] < 0
    q = [run[name][-1] for name in ["q_root", "e1_beam", "e2_beam", "e3_beam"]]
    tip = arm.outline(q, 0, 2)[1]
    turn = np.array([[np.cos(q[0]), np.sin(q[0])], [-np.sin(q[0]), np.cos(q[0])]])
    assert (turn @ tip)[1] == pytest.approx(run["tip_beam"][-1], abs=1e-12)
    with pytest.raises(flexure.FlexureError, match="make a flexible arm and no chain"):
        flexure.Chain.from_toml(path)
    path.write_text(BEAM)
    with pytest.raises(flexure.ParameterError, match="no link is a beam of finite elements or modes"):
        flexure.FlexibleArm.from_toml(path)


def _log(chain, columns, factor=1.0):
    """A log of joints that follow sums of sines, whose drives have an inertia of 0.5 and friction of 3 tanh(200 v) + 4 v."""
    rng = np.random.default_rng(5)
    t = 0.002 * np.arange(8000)
    phases = [2 * np.pi * np.outer(t, [f * (1 + 0.11 * joint) for f in (0.13, 0.41, 0.97)]) + joint for joint in range(chain.nv)]
    sizes = np.array([0.5, 0.2, 0.08])
    rates = [2 * np.pi * np.array([f * (1 + 0.11 * joint) for f in (0.13, 0.41, 0.97)]) for joint in range(chain.nv)]
    q = np.column_stack([np.sin(phase) @ sizes for phase in phases])
    v = np.column_stack([np.cos(phase) @ (sizes * rate) for phase, rate in zip(phases, rates, strict=True)])
    a = -np.column_stack([np.sin(phase) @ (sizes * rate**2) for phase, rate in zip(phases, rates, strict=True)])
    tau = factor * (chain.inverse_dynamics(q, v, a) + 0.5 * a + 3 * np.tanh(200 * v) + 4 * v)
    log = {"t": t}
    for i, column in enumerate(columns):
        log[f"q{column}"] = q[:, i] + rng.normal(0, 1e-5, t.size)
        log[f"tau{column}"] = tau[:, i] + rng.normal(0, 0.05, t.size)
    return log


def test_joints_of_a_chain_have_their_drives():
    chain = flexure.Chain.preset("six-joint-arm")
    by_number = flexure.identify_axes(_log(chain, range(1, 7)), [2, 5], chain=chain, position="q{}")
    for axis in (2, 5):
        row = by_number.rows[str(axis)]
        for name, truth in [("drive_inertia", 0.5), ("coulomb", 3), ("viscous", 4)]:
            assert row[name]["value"] == pytest.approx(truth, rel=0.02), (axis, name)
    assert "each as a joint of the chain" in by_number.summary()
    log = _log(chain, chain.joints, factor=1.25)
    by_name = flexure.identify_axes(log, ["joint2"], chain=chain, position="q{}")
    factor = by_name.result["axes"][0]["chain"]["load_factor"]["value"]
    assert factor == pytest.approx(1.25, rel=0.04)
    assert list(flexure.identify_axes(log, chain=chain, position="q{}").joints) == chain.joints


def test_axes_that_are_no_joints_of_a_chain_are_refused():
    chain = flexure.Chain.preset("six-joint-arm")
    log = _log(chain, range(1, 7))
    with pytest.raises(flexure.ParameterError, match="numbers from 1 to 6"):
        flexure.identify_axes(log, [7], chain=chain, position="q{}")
    with pytest.raises(flexure.ParameterError, match="the chain says them"):
        flexure.identify_axes(log, [1], chain=chain, position="q{}", gravity=True)
    with pytest.raises(flexure.ParameterError, match="give the axes"):
        flexure.identify_axes(log, position="q{}")
    del log["q5"]
    with pytest.raises(flexure.DataError, match="q5"):
        flexure.identify_axes(log, [2], chain=chain, position="q{}")
    with pytest.raises(flexure.ParameterError, match="floating base"):
        flexure.identify_axes(_log(flexure.Chain.preset("seven-joint-arm"), range(1, 8)), [1], chain=flexure.Chain.preset("space-manipulator"), position="q{}")


def test_every_integrator_moves_a_stiff_chain_alike(tmp_path):
    path = tmp_path / "chain.toml"
    stiff = CHAIN_FILE.replace("motor_inertia = 0.4", "motor_inertia = 1e-4\ndamping = 60.0").replace("300.0", "1e7")
    path.write_text(stiff)
    chain = flexure.Chain.from_toml(path)
    runs = {name: chain.simulate(0.1, 0.01, [1.0], integrator=name) for name in ("auto", "dop853", "radau")}
    for run in runs.values():
        assert np.abs(run["q_shoulder"] - runs["dop853"]["q_shoulder"]).max() < 1e-9
    assert np.array_equal(chain.simulate(0.1, 0.01, [1.0])["dqm_shoulder"], runs["auto"]["dqm_shoulder"])
    assert not np.array_equal(runs["auto"]["dqm_shoulder"], runs["dop853"]["dqm_shoulder"])
    with pytest.raises(flexure.ParameterError, match="'euler'.*'auto', 'dop853' or 'radau'"):
        chain.simulate(0.1, 0.01, integrator="euler")
