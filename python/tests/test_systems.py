"""Identified systems: the truth, the command line's numbers, and what can be done with a model."""

import json
import pickle
import subprocess
from types import SimpleNamespace

import matplotlib
import numpy as np
import pytest
from conftest import A, B, dead_zone, installed_program, simulated, write_csv
from scipy.signal import lfilter
from sklearn.base import clone
from sklearn.utils.estimator_checks import check_estimator

import flexure
from flexure.systems import EXPECTED_FAILED_CHECKS


def test_the_truth_is_found(fitted, record):
    x = np.linspace(-1.8, 1.8, 200)
    assert np.sqrt(np.mean((fitted.nonlinearity_(x) - dead_zone(x) * B.sum() / A.sum()) ** 2)) < 0.01
    assert fitted.verdict_.holds and fitted.verdict_.fit_percent > 90
    assert (fitted.order_, fitted.delay_, fitted.dt_) == (2, 1, 0.01)
    np.testing.assert_allclose(fitted.linear_.a, A, atol=0.02)
    assert np.all(np.abs(fitted.linear_.a - A)[1:] < 4 * fitted.linear_.a_errors[1:])
    assert len(fitted.verdict_.tests) >= 3 and all(test.passed for test in fitted.verdict_.tests if test.refutes)
    kinks = [at for at, kind in fitted.nonlinearity_.breakpoints if kind == "kink"]
    np.testing.assert_allclose(kinks, [-0.5, 0.5], atol=0.05)
    errors = fitted.nonlinearity_.kink_errors
    assert np.all(np.abs(np.subtract(kinks, [-0.5, 0.5])) < 4 * errors) and np.all(errors < 0.05)
    band = fitted.nonlinearity_.upper - fitted.nonlinearity_.lower
    assert np.all(band > 0) and fitted.predicted_.shape == record.y.shape


CASES = {
    "hammerstein": (flexure.Hammerstein(), []),
    "plain": (flexure.Hammerstein(method="plain", order=2, parameter=0.2), ["--method", "plain", "--order", "2", "--bandwidth", "0.2"]),
    "form": (flexure.Hammerstein(form="dead-zone", unit="first-coefficient"), ["--form", "dead-zone", "--unit", "first-coefficient"]),
    "known": (flexure.Hammerstein(known=((0, 0), (1, 0.5))), ["--known", "0=0", "1=0.5"]),
    "wiener": (flexure.Wiener(fresh=0.3), ["--structure", "wiener", "--fresh", "0.3"]),
    "auto": (flexure.Auto(), ["--structure", "auto"]),
    "feedback": (flexure.Feedback(), ["--structure", "feedback"]),
    "parallel": (flexure.Parallel(branches=1), ["--structure", "parallel", "--branches", "1"]),
    "narx": (flexure.NARX(), ["--structure", "narx"]),
    "volterra": (flexure.Volterra(fresh=0.3), ["--structure", "volterra", "--fresh", "0.3"]),
    "multiple-inputs": (flexure.MultipleInputs(), ["--structure", "multiple-inputs"]),
    "joint-inputs": (flexure.JointInputs(), ["--structure", "joint-inputs"]),
    "static": (flexure.Static(), ["--structure", "static"]),
}


def of_two_inputs(n, seed):
    """A sum of a Hammerstein system of each of two inputs, in an array of shape (n, 2)."""
    first, second = simulated(n=n, seed=seed), simulated(n=n, seed=seed + 50, phi=lambda u: u**2)
    return SimpleNamespace(u=np.column_stack([first.u, second.u]), y=first.y + lfilter([0, 0.5], [1, -0.5], second.u**2))


def of_a_product(n, seed):
    """A nonlinearity of both inputs that is no sum."""
    rng = np.random.default_rng(seed)
    u = rng.uniform(-2, 2, (n, 2))
    y = lfilter([0, 0.5], [1, -0.5], u[:, 0] * np.abs(u[:, 1]))
    return SimpleNamespace(u=u, y=y + 0.02 * rng.normal(size=n))


@pytest.mark.parametrize("case", CASES)
def test_the_numbers_are_the_command_lines(case, tmp_path, command):
    estimator, options = CASES[case]
    several = case.endswith("inputs")
    make = {"multiple-inputs": of_two_inputs, "joint-inputs": of_a_product}.get(case, simulated)
    names = ["u1", "u2"] if several else ["u"]
    inputs = ["--input", ",".join(names)]

    def write(name, record):
        return write_csv(tmp_path / name, **dict(zip(names, np.reshape(record.u, (len(record.y), -1)).T)), y=record.y)

    record = make(n=1500, seed=3)
    path = write("record.csv", record)
    model, page = tmp_path / "model.json", tmp_path / "page.html"
    done = command(
        "identify", path, *inputs, "--output", "y", "--sample-time", "0.1", "-o", model, "--report", page, "--json", *options
    )
    fit = clone(estimator).fit(record.u, record.y, dt=0.1)
    assert fit.result_ == json.loads(done.stdout)
    (own,), (theirs,) = fit.to_dict()["records"], json.loads(model.read_text())["records"]
    assert (own["samples"], own["crc32"], theirs["name"]) == (1500, theirs["crc32"], "record.csv")
    assert fit.to_dict() | {"records": [theirs]} == json.loads(model.read_text())
    fit.report(tmp_path / "own.html")
    own, theirs = (tmp_path / "own.html").read_text(), page.read_text()
    assert own.count("<svg") == theirs.count("<svg") and abs(len(own) - len(theirs)) < 2000

    fresh = make(n=700, seed=4)
    path = write("fresh.csv", fresh)
    judged = json.loads(command("validate", model, path, *inputs, "--output", "y", "--json").stdout)
    verdict = fit.validate(fresh.u, fresh.y)
    assert (verdict.fit_percent, verdict.rms, verdict.text) == (judged["fit_percent"], judged["rms"], judged["verdict"])
    assert fit.score(fresh.u, fresh.y) == judged["r_squared"]
    for horizon in (None, 1, 5):
        out = tmp_path / "out.csv"
        ahead = ["--initial-state", "steady"] if horizon is None else ["--horizon", horizon]
        command("predict", model, path, *inputs, *ahead, "-o", out)
        own = fit.simulate(fresh.u) if horizon is None else fit.predict(fresh.u, fresh.y, horizon)
        np.testing.assert_array_equal(own, np.genfromtxt(out, delimiter=",", names=True)["predicted"])

    loaded = flexure.load(model)
    assert type(loaded) is type(fit) or case == "auto"
    same_blocks(fit, loaded)
    assert fit.predicted_.shape == record.y.shape and "<svg" in fit._repr_html_() or case == "narx" or case == "volterra"
    pickle.loads(pickle.dumps(fit)).plot()
    matplotlib.pyplot.close("all")


def same_blocks(one, other):
    """The blocks of two models, and those of their branches, have the same numbers."""
    assert [name for name, _ in one.blocks_] == [name for name, _ in other.blocks_]
    for (_, own), (_, theirs) in zip(one.blocks_, other.blocks_, strict=True):
        for field in ("x", "y", "a", "b", "axes", "coefficients", "breakpoints"):
            if hasattr(own, field):
                np.testing.assert_array_equal(getattr(own, field), getattr(theirs, field))


def test_branches_of_several_inputs_are_the_truth():
    record = of_two_inputs(4000, 1)
    model = flexure.MultipleInputs().fit({"a": record.u[:, 0], "b": record.u[:, 1], "y": record.y}, input=["a", "b"], output="y")
    assert model.inputs_ == ("a", "b") and model.verdict_.fit_percent > 90
    first, second = model.branches_
    assert (first.input, second.input) == ("a", "b") and [name for name, _ in first.blocks] == ["nonlinearity", "linear"]
    x = np.linspace(-1.8, 1.8, 50)
    for branch, phi in ((first, dead_zone), (second, np.square)):
        assert np.corrcoef(branch.nonlinearity(x), phi(x))[0, 1] > 0.999
    np.testing.assert_array_equal(model.simulate({"b": record.u[:, 1], "a": record.u[:, 0]}), model.simulate(record.u))
    assert list(model.to_frame().columns[:3]) == ["a", "b", "y"] and set(model.to_control()) == {"linear_1", "linear_2"}
    with pytest.raises(flexure.DataError, match="has the 2 inputs a, b, but 3 were given"):
        model.simulate(np.zeros((100, 3)))
    with pytest.raises(flexure.DataError, match=r"shape \(2, 4000\), but m inputs of n samples have the shape"):
        flexure.MultipleInputs().fit(record.u.T, record.y)
    with pytest.raises(flexure.ParameterError, match="several inputs: input="):
        flexure.JointInputs().fit({"a": record.u[:, 0], "y": record.y}, input="a", output="y")
    with pytest.raises(flexure.ParameterError, match="'a,b' must have no comma"):
        flexure.JointInputs().fit(record.u, record.y, input=["a,b", "c"])


def test_a_surface_is_the_truth_and_the_models():
    rng = np.random.default_rng(2)
    u = rng.uniform(-2, 2, (5000, 2))
    v = u[:, 0] * np.abs(u[:, 1])
    model = flexure.JointInputs().fit(u, lfilter([0, 1, 0.3], [1, -0.6], v) + 0.05 * rng.normal(size=len(u)))
    at = rng.uniform(-1.8, 1.8, (500, 2))
    assert np.corrcoef(model.nonlinearity_(at), at[:, 0] * np.abs(at[:, 1]))[0, 1] > 0.99
    assert model.nonlinearity_(at.reshape(50, 10, 2)).shape == (50, 10)
    y = lfilter(model.linear_.b, model.linear_.a, model.nonlinearity_(u)) + model.output_offset_
    np.testing.assert_allclose(model.simulate(u)[200:], y[200:], atol=1e-9)
    with pytest.raises(flexure.DataError, match="2 inputs need"):
        model.nonlinearity_(np.zeros(3))


def test_references_are_their_formulas(record):
    """A free run by hand, once the start is forgotten."""
    series = flexure.Volterra().fit(record.u, record.y)
    u = np.concatenate([np.zeros(100), record.u[:300] - series.input_level_])
    past = np.array([u[100 - series.delay_ - lag :][:300] for lag in range(max(len(series.first_), len(series.second_)))])
    first, second = series.first_ @ past[: len(series.first_)], past[: len(series.second_)]
    y = series.constant_ + first + np.einsum("in,ij,jn->n", second, series.second_, second)
    np.testing.assert_allclose(series.simulate(record.u)[:300], y, atol=1e-9)
    assert np.array_equal(series.second_, series.second_.T)

    model = flexure.NARX().fit(record.u, record.y)
    (u_mean, u_spread), (y_mean, y_spread) = model.result_["input_scale"], model.result_["output_scale"]
    u, y = (record.u - u_mean) / u_spread, np.zeros(400)
    for n in range(50, 400):
        local = {f"y[n-{i}]": y[n - i] for i in range(1, 20)} | {f"u[n-{i}]": u[n - i] for i in range(1, 20)} | {"u[n]": u[n]}
        y[n] = sum(c * np.prod([local[factor] for factor in term.split()]) for term, c in model.terms_.items())
    np.testing.assert_allclose(model.simulate(record.u)[300:400], y_mean + y_spread * y[300:], atol=1e-3)
    assert model.verdict_.fit_percent > 80 and "polynomial of past outputs" in model._repr_html_()
    with pytest.raises(flexure.FlexureError, match="a narx model has no linear part"):
        model.to_control()


def test_kinks_of_a_wiener_system_are_reported_and_kept(tmp_path):
    rng = np.random.default_rng(5)
    u = lfilter([0.6], [1, -0.8], rng.normal(size=3000))
    w = lfilter([0.3], [1, -0.7], u)
    model = flexure.Wiener().fit(u, dead_zone(w) + 0.02 * rng.normal(size=3000))
    kinks = [at for at, kind in model.nonlinearity_.breakpoints if kind == "kink"]
    np.testing.assert_allclose(kinks, [-0.5, 0.5], atol=0.02)
    # Within four standard errors, as are the curve and the pole.
    found = model.nonlinearity_
    assert np.all(np.abs(np.subtract(kinks, [-0.5, 0.5])) < 4 * found.kink_errors) and np.all(found.kink_errors < 0.05)
    assert np.mean((found.lower < dead_zone(found.x)) & (dead_zone(found.x) < found.upper)) > 0.8
    assert abs(model.linear_.a[1] + 0.7) < 4 * model.linear_.a_errors[1] < 0.02
    model.save(tmp_path / "model.json")
    assert flexure.load(tmp_path / "model.json").nonlinearity_.breakpoints == model.nonlinearity_.breakpoints


def test_models_go_back_and_forth(fitted, record, tmp_path, command):
    fitted.save(tmp_path / "model.json")
    loaded = flexure.load(tmp_path / "model.json")
    again = flexure.Hammerstein.from_dict(fitted.to_dict())
    thawed = pickle.loads(pickle.dumps(fitted))
    for model in (loaded, again, thawed):
        assert isinstance(model, flexure.Hammerstein)
        np.testing.assert_array_equal(model.simulate(record.u), fitted.simulate(record.u))
        np.testing.assert_array_equal(model.linear_.b, fitted.linear_.b)
        np.testing.assert_array_equal(model.linear_.a_errors, fitted.linear_.a_errors)
        np.testing.assert_array_equal(model.nonlinearity_.y, fitted.nonlinearity_.y)
        assert model.nonlinearity_.breakpoints == fitted.nonlinearity_.breakpoints
        assert model.verdict_ == fitted.verdict_ and model.to_json() == fitted.to_json()
        with pytest.raises(flexure.FlexureError, match="report needs the record"):
            model.report(tmp_path / "page.html")
    np.testing.assert_array_equal(thawed.nonlinearity_.lower, fitted.nonlinearity_.lower)
    assert loaded.nonlinearity_.lower is None
    path = write_csv(tmp_path / "fresh.csv", u=record.u, y=record.y)
    command("validate", tmp_path / "model.json", path, "--input", "u", "--output", "y")
    with pytest.raises(flexure.FlexureError, match="structure is hammerstein, not wiener"):
        flexure.Wiener.from_json(fitted.to_json())
    with pytest.raises(flexure.FileError, match="not JSON|cut off"):
        flexure.Hammerstein.from_json("{")
    with pytest.raises(flexure.FileError, match="cannot read"):
        flexure.load(tmp_path / "none.json")


def test_the_model_is_its_blocks(fitted, record):
    """The free run from the blocks by SciPy, once the initial state is forgotten."""
    v = fitted.nonlinearity_(record.u)
    y = lfilter(fitted.linear_.b, fitted.linear_.a, v) + fitted.output_offset_
    np.testing.assert_allclose(fitted.simulate(record.u)[100:], y[100:], atol=1e-10)
    np.testing.assert_allclose(
        fitted.linear_.impulse_response(20), lfilter(fitted.linear_.b, fitted.linear_.a, np.eye(1, 20)[0]), atol=1e-15
    )


def test_the_noise_model_predicts(record):
    rng = np.random.default_rng(5)
    coloured = lfilter([1], [1, -0.95], 0.03 * rng.normal(size=len(record.u)))
    y = record.clean + coloured
    fit = flexure.Hammerstein().fit(record.u, y)
    error = {h: np.std((y - fit.predict(record.u, y, h))[50:]) for h in (1, 5)}
    free = np.std((y - fit.simulate(record.u))[50:])
    assert error[1] < 0.5 * free and error[1] < error[5] < free


def test_several_experiments(record):
    parts = [slice(0, 1500), slice(1500, 2500), slice(2500, 4000)]
    u, y = [record.u[p] for p in parts], [record.y[p] for p in parts]
    several = flexure.Hammerstein().fit(u, y, dt=0.01)
    assert several.verdict_.holds and several.predicted_.shape == record.y.shape
    np.testing.assert_allclose(several.linear_.a, A, atol=0.02)
    with pytest.raises(flexure.DataError, match="several experiments are for Hammerstein"):
        flexure.Wiener().fit(u, y)
    with pytest.raises(flexure.ParameterError, match="3 inputs, but 2 outputs"):
        flexure.Hammerstein().fit(u, y[:2])


def test_missing_outputs(record):
    y = record.y.copy()
    y[::17] = np.nan
    assert flexure.Hammerstein(missing=True).fit(record.u, y).verdict_.fit_percent > 90
    with pytest.raises(flexure.DataError, match="column 'y' is NaN at sample 0"):
        flexure.Hammerstein().fit(record.u, y)


def test_other_structures():
    rng = np.random.default_rng(7)
    u = rng.normal(size=6000)
    front = lfilter([0.3, 0.2], [1, -0.6], u)
    v = np.tanh(1.5 * front)
    wiener = flexure.Wiener().fit(u, v + 0.01 * rng.normal(size=len(u)))
    assert wiener.verdict_.fit_percent > 95
    assert [name for name, _ in wiener.blocks_] == ["linear", "nonlinearity"]
    y = lfilter([0.5], [1, -0.5], v) + 0.01 * rng.normal(size=len(u))
    wiener_hammerstein = flexure.WienerHammerstein().fit(u, y)
    assert wiener_hammerstein.verdict_.fit_percent > 95
    assert [name for name, _ in wiener_hammerstein.blocks_] == ["front", "nonlinearity", "back"]
    chosen = flexure.Auto().fit(u, v + 0.01 * rng.normal(size=len(u)))
    assert chosen.structure_ == "wiener" and chosen.comparison_ is not None
    ends = flexure.HammersteinWiener().fit(u, np.tanh(lfilter([0.4], [1, -0.5], dead_zone(u))) + 0.01 * rng.normal(size=len(u)))
    assert [name for name, _ in ends.blocks_] == ["nonlinearity", "linear", "output_nonlinearity"]
    for model in (wiener, wiener_hammerstein, chosen, ends):
        same_blocks(model, type(model).from_json(model.to_json()))


def test_every_structure_has_a_class():
    assert flexure.estimator("static") is flexure.Static
    assert flexure.estimator("wiener") is flexure.Wiener
    with pytest.raises(AttributeError, match="has no attribute 'Nothing'"):
        _ = flexure.Nothing
    with pytest.raises(flexure.ParameterError, match="there is no structure 'none'; the structures are"):
        flexure.estimator("none")
    u = np.random.default_rng(1).uniform(-1, 1, 600)
    model = flexure.estimator("static")().fit(u, np.tanh(2 * np.roll(u, 2)))
    assert [name for name, _ in model.blocks_] == ["linear", "nonlinearity"] and model.delay_ == 2
    assert type(pickle.loads(pickle.dumps(model))) is type(model)


def test_parameters_are_scikit_learns():
    system = flexure.Hammerstein(order=3)
    assert system.get_params()["order"] == 3
    assert clone(system.set_params(delay=2)).get_params() == system.get_params()
    assert repr(clone(system)) == "Hammerstein(delay=2, order=3)"


@pytest.mark.parametrize("estimator", [flexure.Hammerstein(), flexure.Wiener(), flexure.Auto()], ids=repr)
def test_scikit_learns_checks_as_far_as_declared(estimator):
    """Those that are not declared pass, and those that are fail."""
    results = check_estimator(estimator, expected_failed_checks=EXPECTED_FAILED_CHECKS, on_fail=None, on_skip=None)
    found = {(r["check_name"], r["status"]) for r in results if r["status"] != "skipped"}
    assert {name for name, status in found if status == "failed"} == set()
    expected = {name for name, status in found if status == "xfail"}
    assert set(EXPECTED_FAILED_CHECKS) - expected <= {"check_array_api_input"}  # skipped without SCIPY_ARRAY_API
    assert sum(status == "passed" for _, status in found) >= 10


@pytest.mark.parametrize(
    ("estimator", "message"),
    [
        (flexure.Hammerstein(fresh=0.99), "the fresh share is 0.99, but must be between 0.05 and 0.9"),
        (flexure.Hammerstein(order=99), "the order is 99"),
        (flexure.Hammerstein(method="best"), "the method is 'best', but must be one of refined, plain"),
        (flexure.Hammerstein(unit="none"), "the unit is 'none'"),
        (flexure.Hammerstein(form="cube"), "the form: expected dead-zone"),
        (flexure.Hammerstein(nonlinearity="magic"), "the estimator is 'magic'"),
        (flexure.Wiener(fresh=-1), "fresh share is -1"),
        (flexure.Hammerstein(fresh="x"), "fresh is 'x', but must be a number"),
        (flexure.Hammerstein(order=-1), "order is -1, but must be a whole number from 0"),
        (flexure.Hammerstein(delay=2.5), "delay is 2.5, but must be a whole number"),
        (flexure.Hammerstein(missing="yes"), "missing is 'yes', but must be True or False"),
        (flexure.Hammerstein(known=((0, 0),)), r"known is \(\(0, 0\),\), but must be two points"),
        (flexure.Parallel(branches=9), "the number of branches is 9"),
    ],
)
def test_wrong_parameters_are_said(estimator, message, record):
    with pytest.raises(flexure.ParameterError, match=message):
        estimator.fit(record.u, record.y)


def test_wrong_records_are_said(record, fitted):
    fit = flexure.Hammerstein().fit
    with pytest.raises(flexure.TooShortError, match="at least"):
        fit(record.u[:50], record.y[:50])
    with pytest.raises(flexure.DataError, match="column 'u' is constant"):
        fit(np.ones(1000), record.y[:1000])
    with pytest.raises(flexure.DataError, match="'y' has 999 samples where 1000 were expected"):
        fit(record.u[:1000], record.y[:999])
    with pytest.raises(flexure.ParameterError, match="dt is -1.0, but must be positive"):
        fit(record.u, record.y, dt=-1.0)
    for horizon in (0, -1, 1.5, 2**70):
        with pytest.raises(flexure.ParameterError, match="horizon is"):
            fitted.predict(record.u, record.y, horizon)
    for skip in (-1, 4000, 1.5):
        with pytest.raises(flexure.ParameterError, match="skip is"):
            fitted.validate(record.u, record.y, skip=skip)
    with pytest.raises(ValueError, match="is not fitted yet"):
        flexure.Hammerstein().simulate(record.u)


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"parameter": 0.3}, "parameter is for method='plain', but the method is 'refined'"),
        ({"kernel": "box"}, "kernel is for method='plain'"),
        ({"method": "plain", "form": "dead-zone"}, "form is for method='refined', but the method is 'plain'"),
        ({"known": (("a", 0), (1, 1))}, "must be two points"),
        ({"known": [[0, 0], [1]]}, "must be two points"),
    ],
)
def test_settings_that_would_be_ignored_are_said(record, parameters, message):
    with pytest.raises(flexure.ParameterError, match=message):
        flexure.Hammerstein(**parameters).fit(record.u, record.y)


def test_known_points_may_be_an_array(record):
    u, y = record.u[:1000], record.y[:1000]
    points = ((0.0, 0.0), (1.0, 0.5))
    expected = flexure.Hammerstein(known=points).fit(u, y).to_json()
    assert flexure.Hammerstein(known=np.array(points)).fit(u, y).to_json() == expected


def test_the_drawing_has_gain_phase_and_their_ranges(fitted):
    page = fitted._repr_html_()
    assert page.count("<svg") == 3 and "the phase over frequency" in page and "up to 50 Hz" in page
    low, high = fitted.nonlinearity_.y.min(), fitted.nonlinearity_.y.max()
    assert f"onto {low:.3g} to {high:.3g}" in page


def test_the_package_brings_the_command():
    done = subprocess.run([installed_program(), "--version"], capture_output=True, text=True, check=True)
    assert done.stdout == f"flexure {flexure.__version__}\n"
