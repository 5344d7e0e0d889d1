"""Dynamics of ten chains by Pinocchio, written as crates/flexure-io/tests/data/chains.json.

Needs `pin` from PyPI; run from the repository's root:

    python3 scripts/reference/chains.py

The chains are random: serial ones and trees of 2 to 8 joints that turn or slide about any axis, with links that are fixed to others.
Each is on a fixed and on a free base. With Flexure's Python package installed, the largest relative difference on random
states of every chain is printed by

    python3 scripts/reference/chains.py --states 1000
"""

import argparse
import json
import tempfile
from pathlib import Path

import numpy as np
import pinocchio as pin

DATA = Path("crates/flexure-io/tests/data/chains.json")
CHAINS = 10
KEPT_STATES = 2


def triple(values):
    return " ".join(repr(float(v)) for v in values)


def inertial(rng):
    rods = rng.uniform(-0.5, 0.5, (4, 3))
    moments = sum(np.eye(3) * (r @ r) - np.outer(r, r) for r in rods)
    named = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}
    values = " ".join(f'{name}="{moments[at]!r}"' for name, at in named.items()).replace("np.float64(", "").replace(")", "")
    origin = f'<origin xyz="{triple(rng.uniform(-0.3, 0.3, 3))}" rpy="{triple(rng.uniform(-3, 3, 3))}"/>'
    return f'<inertial>{origin}<mass value="{rng.uniform(0.5, 5.0)}"/><inertia {values}/></inertial>'


def urdf(number):
    """A chain of 2 to 8 joints; every third one is a tree."""
    rng = np.random.default_rng(number)
    links, joints = [f'<link name="base">{inertial(rng)}</link>'], []
    names = ["base"]
    moving = 2 + number % 7
    kinds = ["revolute" if rng.uniform() < 0.7 else "prismatic" for _ in range(moving)]
    for at in sorted(rng.integers(0, moving, 2), reverse=True):
        kinds.insert(at, "fixed")
    for i, kind in enumerate(kinds):
        parent = names[rng.integers(len(names))] if number % 3 == 2 else names[-1]
        names.append(f"link{i}")
        links.append(f'<link name="link{i}">{inertial(rng)}</link>')
        axis = np.eye(3)[rng.integers(3)] if rng.uniform() < 0.4 else rng.normal(size=3)
        axis = axis / np.linalg.norm(axis)
        joints.append(
            f'<joint name="joint{i}" type="{kind}"><parent link="{parent}"/><child link="link{i}"/>'
            f'<origin xyz="{triple(rng.uniform(-0.8, 0.8, 3))}" rpy="{triple(rng.uniform(-3, 3, 3))}"/>'
            f'<axis xyz="{triple(axis)}"/><limit lower="-3" upper="3" effort="100" velocity="10"/></joint>'
        )
    return f'<robot name="chain{number}">\n' + "\n".join(links + joints) + "\n</robot>\n"


def model(text, base):
    free = pin.JointModelFreeFlyer()
    return pin.buildModelFromXML(text, free) if base == "free" else pin.buildModelFromXML(text)


def states(model, rng, count):
    for _ in range(count):
        q = rng.uniform(-2, 2, model.nq)
        if model.nq > model.nv:
            q[3:7] /= np.linalg.norm(q[3:7])
        yield q, rng.uniform(-2, 2, model.nv), rng.uniform(-5, 5, model.nv)


def solved(model, q, v, a):
    data = model.createData()
    tau = pin.rnea(model, data, q, v, a)
    drive = np.linspace(-10.0, 10.0, model.nv)
    mass = pin.crba(model, data, q)
    mass = np.triu(mass) + np.triu(mass, 1).T
    regressor = pin.computeJointTorqueRegressor(model, data, q, v, a)
    of_torques = [matrix.copy() for matrix in pin.computeRNEADerivatives(model, data, q, v, a)[:2]]
    # Of the inverse of the inertia matrix, only the upper half is written.
    of_accelerations = pin.computeABADerivatives(model, data, q, v, drive)
    inverse = np.triu(of_accelerations[2]) + np.triu(of_accelerations[2], 1).T
    derivatives = {
        "torque_by_position": of_torques[0],
        "torque_by_velocity": of_torques[1],
        "acceleration_by_position": of_accelerations[0].copy(),
        "acceleration_by_velocity": of_accelerations[1].copy(),
        "acceleration_by_torque": inverse,
    }
    return {"derivatives": derivatives, "regressor": regressor, "tau": tau, "drive": drive, "acceleration": pin.aba(model, data, q, v, drive), "mass": mass}


def written():
    chains = []
    for number in range(CHAINS):
        text = urdf(number)
        for base in ["fixed", "free"]:
            of = model(text, base)
            rng = np.random.default_rng(1000 + number)
            kept = []
            for q, v, a in states(of, rng, KEPT_STATES):
                found = solved(of, q, v, a)
                data = of.createData()
                regressor, derivatives = found.pop("regressor"), found.pop("derivatives")
                row = {"q": q, "v": v, "a": a, **found, "mass": found["mass"][np.triu_indices(of.nv)]}
                # The regressor, times parameters that are no inertias.
                row["regressed"] = regressor @ np.linspace(-1.0, 1.0, regressor.shape[1])
                # Every derivative along one direction.
                for name, matrix in derivatives.items():
                    row[name] = matrix @ np.linspace(-1.0, 1.0, of.nv)
                row["energy"] = [pin.computeKineticEnergy(of, data, q, v), pin.computePotentialEnergy(of, data, q)]
                if base == "free":
                    momentum = pin.computeCentroidalMomentum(of, data, q, v)
                    row["momentum"] = [*momentum.linear, *momentum.angular]
                    row["com"] = pin.centerOfMass(of, data, q)
                kept.append({key: [float(x) for x in np.ravel(value)] for key, value in row.items()})
            chains.append({"base": base, "urdf": text, "joints": [n for n in of.names if n.startswith("joint")], "states": kept})
    DATA.parent.mkdir(parents=True, exist_ok=True)
    DATA.write_text(json.dumps(chains, indent=1) + "\n")
    print(f"{DATA}: {len(chains)} chains by Pinocchio {pin.__version__}")


def measured(count):
    import flexure

    worst = dict.fromkeys(["tau", "acceleration", "mass", "regressor", "torque's derivatives", "acceleration's derivatives"], 0.0)
    with tempfile.TemporaryDirectory() as folder:
        for number in range(CHAINS):
            path = Path(folder) / "chain.urdf"
            path.write_text(urdf(number))
            for base in ["fixed", "free"]:
                of, chain = model(path.read_text(), base), flexure.Chain.from_urdf(path, base=base)
                drawn = list(states(of, np.random.default_rng(7 * number), count))
                q, v, a = (np.array(x) for x in zip(*drawn))
                theirs = [solved(of, *state) for state in drawn]
                drive = np.array([row["drive"] for row in theirs])
                ours = {
                    "tau": chain.inverse_dynamics(q, v, a),
                    "acceleration": chain.forward_dynamics(q, v, drive),
                    "mass": chain.mass_matrix(q),
                    "regressor": chain.regressor(q, v, a),
                }
                for of_what, changes in [
                    ("torque", chain.inverse_dynamics_derivatives(q, v, a)),
                    ("acceleration", chain.forward_dynamics_derivatives(q, v, drive)),
                ]:
                    for by, matrices in changes._asdict().items():
                        for mine, row in zip(matrices, theirs):
                            want = row["derivatives"][f"{of_what}_{by}"]
                            off = np.abs(mine - want).max() / np.abs(want).max()
                            worst[f"{of_what}'s derivatives"] = max(worst[f"{of_what}'s derivatives"], off)
                for name, values in ours.items():
                    for mine, row in zip(values, theirs):
                        off = np.abs(mine - row[name]).max() / np.abs(row[name]).max()
                        worst[name] = max(worst[name], off)
    for name, off in worst.items():
        print(f"{name:<26} largest relative difference {off:.1e} on {2 * CHAINS * count} states")


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--states", type=int)
    count = parser.parse_args().states
    if count:
        measured(count)
    else:
        written()
