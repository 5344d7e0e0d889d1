"""Chains with flexible joints in time, by Pinocchio's forward dynamics and SciPy's DOP853, written as crates/flexure-io/tests/data/chain_runs.json.

Needs `pin` and `scipy` from PyPI; run from the repository's root:

    python3 scripts/reference/chain_runs.py

The chains are those of `chains.json`, on the ground and free in orbit. Every joint has a motor, a spring with soft wind-up, damping and
friction at motor and link. The torques are held for a tenth of a second each.
"""

import json
from pathlib import Path

import numpy as np
import pinocchio as pin
from scipy.integrate import DOP853

FOLDER = Path("crates/flexure-io/tests/data")
STEP, ROWS = 0.1, 101
CASES = [(1, "fixed"), (3, "fixed"), (1, "free"), (4, "free")]


def rubbing(g, v):
    return g[0] * (np.tanh(g[1] * v) - np.tanh(g[2] * v)) + g[3] * np.tanh(g[4] * v) + g[5] * v


def run(number, base):
    urdf = json.loads((FOLDER / "chains.json").read_text())[number]["urdf"]
    joint = [pin.JointModelFreeFlyer()] if base == "free" else []
    model = pin.buildModelFromXML(urdf, *joint)
    model.gravity.linear = np.array([0, 0, -9.81]) if base == "fixed" else np.zeros(3)
    data = model.createData()
    first = 7 if base == "free" else 0
    n = model.nq - first
    rng = np.random.default_rng(100 + number)
    drives = [
        {
            "motor_inertia": rng.uniform(0.2, 0.6),
            "linear": rng.uniform(300, 500),
            "cubic": rng.uniform(0, 500),
            "windup": rng.uniform(5, 20),
            "windup_sharpness": 300.0,
            "damping": rng.uniform(0.2, 1.0),
            "friction": [0.3, 6.0, 2.0, 0.5, 8.0, rng.uniform(3, 6)],
            "motor_friction": [0.0, 1.0, 1.0, 0.4, 9.0, rng.uniform(1, 2)],
        }
        for _ in range(n)
    ]
    torques = rng.normal(size=(ROWS, n)) * 3

    def derivative(tau):
        def of(_, x):
            q, qm = x[: model.nq], x[model.nq : model.nq + n]
            v, vm = x[model.nq + n : -n], x[-n:]
            links, forces, left = v[model.nv - n :], np.zeros(model.nv), np.zeros(n)
            for i, k in enumerate(drives):
                d = qm[i] - q[first + i]
                slope = k["cubic"] * d * d + k["linear"] - k["windup"] * np.exp(-k["windup_sharpness"] * d * d)
                elastic = slope * d + k["damping"] * (vm[i] - links[i])
                forces[model.nv - n + i] = elastic - rubbing(k["friction"], links[i])
                left[i] = (tau[i] - elastic - rubbing(k["motor_friction"], vm[i])) / k["motor_inertia"]
            unit = q.copy()
            rate = v
            if first:
                unit[3:7] /= np.linalg.norm(q[3:7])
                turn = pin.Quaternion(unit[3:7]).matrix()
                w = pin.Quaternion(0.0, *v[3:6])
                spin = (pin.Quaternion(*q[[6, 3, 4, 5]]) * w).coeffs() / 2
                rate = np.concatenate([turn @ v[:3], spin, v[6:]])
            return np.concatenate([rate, vm, pin.aba(model, data, unit, v, forces), left])

        return of

    x = np.concatenate([pin.neutral(model), np.zeros(n + model.nv + n)])
    for k in range(ROWS - 1):
        solver = DOP853(derivative(torques[k]), 0.0, x, STEP, rtol=1e-12, atol=1e-13)
        while solver.status == "running":
            solver.step()
        x = solver.y
    if first:
        x[3:7] /= np.linalg.norm(x[3:7])
    return {"chain": number, "base": base, "drives": drives, "torques": torques.T.tolist(), "last": x.tolist()}


runs = [run(*case) for case in CASES]
(FOLDER / "chain_runs.json").write_text(json.dumps(runs) + "\n")
for found in runs:
    print(found["chain"], found["base"], np.round(found["last"], 4))
