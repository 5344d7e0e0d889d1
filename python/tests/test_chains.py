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
