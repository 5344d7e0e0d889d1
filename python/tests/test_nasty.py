"""Numbers and arrays that are made to do harm: a result of finite numbers or an error in words, and every layout gives the same result."""

import pickle

import numpy as np
import pytest

import flexure
from flexure import StreamedKernelRegressor
from flexure.control import Cusum, RecursiveFriction, RecursiveHammerstein, RecursiveLinear, Scenario

N = 240
RANDOM = np.random.default_rng(5)
GOOD = RANDOM.uniform(-1, 1, N)

# Columns; the message of a refusal must not be empty, and no number of a result may be infinite.
NASTY = {
    "nan": np.where(np.arange(N) == 50, np.nan, GOOD),
    "inf": np.where(np.arange(N) == 50, np.inf, GOOD),
    "all nan": np.full(N, np.nan),
    "huge": 1e308 * GOOD,
    "outlier": np.where(np.arange(N) == 50, 1e200, GOOD),
    "tiny": 1e-200 * GOOD,
    "denormal": 5e-324 * np.round(3 * GOOD),
    "constant": np.full(N, 3.25),
    "zero": np.zeros(N),
    "offset": 1e16 + GOOD,
    "whole": np.round(5 * GOOD).astype("i8"),
    "bool": GOOD > 0,
    "half": GOOD.astype("f2"),
    "empty": np.array([]),
    "one": np.array([1.0]),
    "two": np.array([1.0, 2.0]),
    "longer": np.append(GOOD, 1.0),
}
# The errors that a caller may expect: the package's own, and those of NumPy and scikit-learn.
REFUSALS = (flexure.FlexureError, ValueError, TypeError)


def numbers(value):
    """All numbers in a result."""
    if isinstance(value, dict):
        value = list(value.values())
    if isinstance(value, (list, tuple)):
        return np.concatenate([numbers(item) for item in value] or [np.array([])])
    if value is None or isinstance(value, (str, bytes)):
        return np.array([])
    return np.asarray(value, float).ravel()


def learner(model, *columns):
    """What a learner has learnt, also through a checkpoint."""
    model.push(*columns)
    again = type(model).from_bytes(model.to_bytes())
    if hasattr(model, "estimate"):
        # The model still learns.
        model.push(*[GOOD for _ in columns])
        return [again.estimate, model.estimate]
    return again.mean_delay


def chain(q, v):
    arm = flexure.Chain.preset("seven-joint-arm")
    states = [np.resize(np.asarray(x, float), (3, arm.nv)) for x in (q, v)]
    return [arm.forward_dynamics(*states, states[1]), arm.inverse_dynamics(*states, states[1]), *arm.energy(*states)]


def chain_run(q, tau):
    arm = flexure.Chain.preset("six-joint-arm")
    with np.errstate(over="ignore"):
        torque = np.resize(np.asarray(tau, float), len(arm.joints))
    return arm.simulate(0.02, 0.01, torque, q=np.resize(np.asarray(q, float), arm.nq))


def fit(estimator):
    def run(u, y):
        model = estimator().fit(u, y)
        return [model.simulate(GOOD), model.to_json()]

    return run


def exported(folder):
    def run(u, y):
        model = flexure.Hammerstein().fit(u, y)
        for form in ("c", "python", "matlab", "onnx", "fmu"):
            model.export(form, folder / "out", name="model")

    return run


def own_system(u, y):
    gains = np.resize(np.asarray(u, float), (2, 4))
    empty = {"A": np.zeros((0, 0)), "B": np.zeros((0, 4)), "C": np.zeros((2, 0)), "D": gains, "dt": 0.01}
    scenario = Scenario.from_text(SCENARIO)
    results = scenario.compare({"mine": type("System", (), empty)})
    return [row["tip_error_max_m"] for row in results if row["failure"] is None]


SCENARIO = """
[plant]
arm = "space-arm"
[trajectory]
kind = "moves"
postures = [[0.0, 0.6], [0.1, 0.7]]
duration = 0.2
[loop]
sample_time = 0.01
[[controller]]
kind = "pd-feedforward"
kp = [400.0, 300.0]
kd = [30.0, 20.0]
"""

JOBS = {
    "recursive Hammerstein": lambda u, y: learner(RecursiveHammerstein(2, 2), u, y),
    "recursive linear, forgetting": lambda u, y: learner(RecursiveLinear(1, forgetting=0.9), u, y),
    "recursive linear, drift": lambda u, y: learner(RecursiveLinear(1, drift=1e-3), u, y),
    "recursive friction": lambda u, y: learner(RecursiveFriction(0.01), u, y),
    "cusum": lambda u, y: learner(Cusum(1.0), u),
    "streamed kernel": lambda u, y: StreamedKernelRegressor(bandwidth=0.2, block=20).fit(u, y).predict(GOOD[:9]),
    "chain": chain,
    "chain in time": chain_run,
    "feedback": fit(lambda: flexure.Feedback()),
    "Hammerstein": fit(flexure.Hammerstein),
    "linear": fit(flexure.Linear),
    "NARX": fit(flexure.NARX),
    "joint inputs": lambda u, y: flexure.JointInputs().fit(np.column_stack([u, y, y]), y).to_json(),
    "joint": lambda u, y: flexure.identify_joint(u, position=y, dt=0.01).summary(),
    "flexible joint": lambda u, y: flexure.identify_joint(u, motor=y, link=u, dt=0.01).summary(),
    "prepare": lambda u, y: flexure.prepare.outliers({"u": u, "y": y}),
    "own controller": own_system,
}


@pytest.mark.parametrize("job", JOBS)
@pytest.mark.parametrize("place", [0, 1])
def test_numbers_are_used_or_refused(job, place):
    for name, column in NASTY.items():
        columns = [column, GOOD] if place == 0 else [GOOD, column]
        if name in ("empty", "one", "two") and place == 0:
            columns = [column, column]
        try:
            result = JOBS[job](*columns)
        except REFUSALS as error:
            assert str(error) and len(str(error)) < 2000, name
            assert "Flexure failed inside" not in str(error), name
        else:
            # The preparation takes an infinite sample as missing and keeps it.
            if not isinstance(result, str) and job != "prepare":
                found = numbers(result)
                assert not np.isinf(found).any(), (name, result)


def test_exports_are_written_or_refused(tmp_path):
    for name, column in NASTY.items():
        try:
            exported(tmp_path)(column, GOOD)
        except REFUSALS as error:
            assert str(error) and "Flexure failed inside" not in str(error), name


def layouts(column):
    """The same numbers in arrays of many kinds."""
    wide = np.asfortranarray(np.column_stack([column, column + 1, column]))
    frozen = column.copy()
    frozen.setflags(write=False)
    return [
        wide[:, 0],
        np.repeat(column, 3)[::3],
        column[::-1].copy()[::-1],
        frozen,
        column.astype(object),
        column.astype(">f8"),
        list(column),
        np.lib.stride_tricks.as_strided(column, column.shape, column.strides),
    ]


@pytest.mark.parametrize("job", [job for job in JOBS if job not in ("prepare", "own controller", "chain", "chain in time")])
def test_every_layout_gives_the_same(job):
    u = GOOD.astype("f4").astype(float)
    y = np.convolve(u + 0.3 * u**2, [0.5, 0.3, 0.1])[:N]

    def outcome(a, b):
        try:
            return pickle.dumps(JOBS[job](a, b))
        except flexure.FlexureError as error:
            return str(error)

    want = outcome(u, y)
    for a, b in zip(layouts(u), layouts(y), strict=True):
        assert outcome(a, b) == want
    assert outcome(u.astype("f4"), y) == want


def test_learners_lose_nothing_to_a_bad_sample():
    y = np.convolve(GOOD, [0.0, 0.5])[:N]
    plain = RecursiveLinear(1)
    plain.push(GOOD, y)
    for bad in (1e200, -1e300, np.nan, np.inf, 1e-200, 5e-324):
        model = RecursiveLinear(1)
        model.push([bad], [bad])
        model.push(GOOD, y)
        np.testing.assert_allclose(model.estimate["b"] * model.estimate["powers"], [0, 0.5], atol=1e-6)
    with pytest.raises(flexure.DataError, match="length"):
        plain.push(GOOD, y[:-1])
    with pytest.raises(flexure.DataError, match="length"):
        RecursiveFriction(0.01).push(GOOD, y[:-1])


@pytest.mark.parametrize(
    "made",
    [
        lambda: RecursiveHammerstein(2, 3, delay=1),
        lambda: RecursiveFriction(0.01, forgetting=0.99),
        lambda: Cusum(1.0),
        lambda: StreamedKernelRegressor(bandwidth=0.2, block=20).fit(GOOD, GOOD),
    ],
)
def test_changed_checkpoints_are_refused_or_go_on(made):
    model = made()
    if not isinstance(model, StreamedKernelRegressor):
        model.push(*([GOOD] if isinstance(model, Cusum) else [GOOD, GOOD]))
    good = model.to_bytes()
    rng = np.random.default_rng(2)
    read = model.from_bytes if isinstance(model, StreamedKernelRegressor) else type(model).from_bytes
    for _ in range(2000):
        data = bytearray(good)
        for _ in range(rng.integers(1, 4)):
            place = int(rng.integers(0, len(data)))
            data[place] = int(rng.choice([0, 1, 127, 128, 255, int(rng.integers(0, 256))]))
        if rng.integers(0, 4) == 0:
            del data[int(rng.integers(0, len(data))) :]
        try:
            again = read(bytes(data))
            if isinstance(again, StreamedKernelRegressor):
                again.predict(GOOD[:5])
            else:
                again.push(*([GOOD[:5]] if isinstance(again, Cusum) else [GOOD[:5], GOOD[:5]]))
        except REFUSALS as error:
            assert str(error) and "Flexure failed inside" not in str(error)


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: RecursiveHammerstein(-1, 2),
        lambda: RecursiveHammerstein(10**30, 2),
        lambda: RecursiveHammerstein(50, 10**6),
        lambda: RecursiveLinear(1, forgetting=float("nan")),
        lambda: RecursiveLinear(1, drift=float("inf")),
        lambda: RecursiveFriction(float("nan")),
        lambda: RecursiveFriction(1e-320, reversal=-1.0),
        lambda: Cusum(0.0),
        lambda: Cusum(1.0, quiet=float("inf")),
        lambda: StreamedKernelRegressor(bandwidth=float("nan")).fit(GOOD, GOOD).predict(GOOD),
        lambda: StreamedKernelRegressor(most_bins=10**12).fit(GOOD, GOOD),
        lambda: flexure.JointInputs().fit(np.zeros((3, 10**5)), np.zeros(3)),
        lambda: flexure.Chain.preset("six-joint-arm").simulate(1e300, 1e-300),
        lambda: flexure.Chain.preset("six-joint-arm").simulate(0.1, float("nan")),
        lambda: Scenario.from_text(SCENARIO).compare(seeds=0),
        lambda: Scenario.from_text(SCENARIO).compare(seeds=10**9),
    ],
)
def test_settings_without_sense_are_refused(wrong):
    with pytest.raises((*REFUSALS, OverflowError)) as refused:
        wrong()
    assert str(refused.value)
