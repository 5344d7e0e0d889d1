"""The numbers of every fitted object on seeded records: a change of structure leaves them as they are.

A change that improves accuracy renews them: ``FLEXURE_SNAPSHOTS=write python -m pytest test_snapshots.py``.
"""

import json
import os
from dataclasses import fields, is_dataclass
from pathlib import Path

import numpy as np
import pytest
from conftest import simulated
from scipy.signal import lfilter

import flexure

STORED = Path(__file__).with_name("snapshots.json")


def digest(value):
    """Every number of a value; of long arrays length, ends and sums; of texts nothing."""
    if isinstance(value, bool | int | float | np.number) or value is None:
        return None if value is None or not np.isfinite(value) else float(value)
    if isinstance(value, complex):
        return [value.real, value.imag]
    if isinstance(value, np.ndarray) and value.size > 8:
        flat = np.nan_to_num(np.concatenate([value.real.ravel(), value.imag.ravel()]), posinf=0, neginf=0)
        weights = np.arange(1, flat.size + 1) / flat.size
        return [value.size, *map(float, (flat[0], flat[-1], flat.sum(), flat @ weights, np.abs(flat).sum()))]
    if isinstance(value, np.ndarray | list | tuple):
        return [digest(item) for item in value]
    if isinstance(value, dict):
        return {str(key): digest(item) for key, item in value.items()}
    if is_dataclass(value):
        return {field.name: digest(getattr(value, field.name)) for field in fields(value) if not field.name.startswith("_")}
    return None


def attributes(fitted):
    """What a fitted object says: the public names that end in an underscore."""
    names = [name for name in dir(fitted) if name.endswith("_") and not name.startswith("_") and name != "result_"]
    return {name: digest(getattr(fitted, name)) for name in names if hasattr(fitted, name)}


def two_inputs():
    rng = np.random.default_rng(7)
    u = rng.uniform(-2, 2, (1200, 2))
    y = lfilter([0, 0.5], [1, -0.5], u[:, 0] * np.abs(u[:, 1])) + lfilter([1.0], [1, 0.3], np.tanh(u[:, 0]))
    return u, y + 0.02 * rng.normal(size=1200)


def joint_log():
    """A joint of inertia 3, friction 2 v + 0.5 tanh(20 v), stiffness 500 and motor inertia 1, moved by twelve sines."""
    rng = np.random.default_rng(8)
    t = np.arange(6000) * 0.005
    w, p, amplitude = 2 * np.pi * 0.1 * np.arange(1, 13), rng.uniform(0, 2 * np.pi, 12), 0.3 / np.arange(1, 13)
    v = {order: (amplitude * w**order) @ np.sin(np.outer(w, t) + p[:, None] + order * np.pi / 2) for order in range(5)}
    torque = 3 * v[2] + 2 * v[1] + 0.5 * np.tanh(20 * v[1])
    motor = v[0] + torque / 500
    coulomb = np.tanh(20 * v[1])
    # The second derivative of the Coulomb part.
    bend = 0.5 * (1 - coulomb**2) * (20 * v[3] - 2 * coulomb * (20 * v[2]) ** 2)
    drive = torque + v[2] + (3 * v[4] + 2 * v[3] + bend) / 500
    noise = {"q": 1e-5, "qm": 1e-5, "rigid": 0.02, "drive": 0.02}
    signals = {"q": v[0], "qm": motor, "rigid": torque, "drive": drive}
    noisy = {name: signals[name] + scale * rng.normal(size=t.size) for name, scale in noise.items()}
    # The last digits of sines differ from processor to processor, and a form with more parameters than the log determines amplifies them.
    return {name: samples.round(9) for name, samples in noisy.items()}


SYSTEMS = {
    "hammerstein": flexure.Hammerstein(),
    "plain": flexure.Hammerstein(method="plain"),
    "wiener": flexure.Wiener(),
    "wiener_hammerstein": flexure.WienerHammerstein(),
    "hammerstein_wiener": flexure.HammersteinWiener(),
    "parallel": flexure.Parallel(branches=1),
    "multiple_inputs": flexure.MultipleInputs(),
    "joint_inputs": flexure.JointInputs(),
    "narx": flexure.NARX(),
    "volterra": flexure.Volterra(),
    "auto": flexure.Auto(),
}
REGRESSORS = {
    "kernel": flexure.KernelRegressor(),
    "knn": flexure.KNNRegressor(),
    "series": flexure.SeriesRegressor(),
    "spline": flexure.SplineRegressor(),
}


def system(name):
    if name.endswith("inputs"):
        u, y = two_inputs()
    else:
        record = simulated(n=1200, seed=5)
        u, y = record.u, record.y
    fitted = SYSTEMS[name].fit(u, y, dt=0.1)
    return attributes(fitted) | {"simulate": digest(fitted.simulate(u[:300]))}


def regressor(name):
    record = simulated(n=600, seed=6)
    x, y = record.u[:, None], np.abs(record.u) + record.y
    fitted = REGRESSORS[name].fit(x, y)
    return attributes(fitted) | {"predict": digest(fitted.predict(np.linspace(-1.8, 1.8, 50)[:, None]))}


def rigid():
    log = joint_log()
    return digest(flexure.identify_joint(log["rigid"], position=log["q"], dt=0.005))


def flexible():
    log = joint_log()
    return digest(flexure.identify_joint(log["drive"], motor=log["qm"], link=log["q"], dt=0.005))


CASES = {
    **{f"system {name}": (system, name) for name in SYSTEMS},
    **{f"regressor {name}": (regressor, name) for name in REGRESSORS},
    "joint rigid": (rigid,),
    "joint flexible": (flexible,),
}


@pytest.mark.parametrize("case", CASES)
def test_the_numbers_stay(case):
    make, *arguments = CASES[case]
    now = json.loads(json.dumps(make(*arguments)))
    stored = json.loads(STORED.read_text()) if STORED.exists() else {}
    if os.environ.get("FLEXURE_SNAPSHOTS") == "write":
        lines = (f"{json.dumps(name)}: {json.dumps(numbers)}" for name, numbers in (stored | {case: now}).items())
        STORED.write_text("{\n" + ",\n".join(lines) + "\n}\n")
    else:
        assert close(now, stored[case])


def close(now, stored):
    """Whether two digests have equal numbers, except for the rounding of another processor."""
    if isinstance(stored, dict):
        return now.keys() == stored.keys() and all(close(now[key], stored[key]) for key in stored)
    if isinstance(stored, list):
        return len(now) == len(stored) and all(map(close, now, stored))
    if isinstance(stored, float) and isinstance(now, float):
        return np.isclose(now, stored, rtol=1e-6, atol=1e-9)
    return now == stored
