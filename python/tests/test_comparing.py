"""Several models on one record: the numbers of their own verdicts, in order, and the page."""

import json
import subprocess

import flexure
import numpy as np
import pytest


@pytest.fixture(scope="module")
def signals():
    rng = np.random.default_rng(3)
    u = rng.uniform(-2, 2, 3000)
    y = np.convolve(np.clip(u, -1, 1), [0.0, 0.5, 0.3, 0.1])[:3000] + 0.02 * rng.normal(size=3000)
    return u, y


def test_models_are_ordered_and_have_their_own_verdicts(signals, tmp_path):
    u, y = signals
    models = {"line": flexure.Linear().fit(u[:2000], y[:2000]), "curve": flexure.Hammerstein().fit(u[:2000], y[:2000])}
    compared = flexure.compare(models, u[2000:], y[2000:], skip=50)
    assert [model["model"] for model in compared.models] == ["curve", "line"]
    for model in compared.models:
        own = models[model["model"]].validate(u[2000:], y[2000:], skip=50)
        assert model["fit_percent"] == own.fit_percent and model["holds"] == own.holds
    assert compared.models[0]["holds"] and not compared.models[1]["holds"]
    frame = compared.to_frame()
    assert list(frame["model"]) == ["curve", "line"] and frame["fit_percent"].is_monotonic_decreasing
    assert "curve" in compared.summary() and "<pre>" in compared._repr_html_()
    compared.report(tmp_path / "page.html")
    assert "curve" in (tmp_path / "page.html").read_text()


def test_it_is_what_the_command_says(signals, tmp_path, program):
    u, y = signals
    model = flexure.Hammerstein().fit(u[:2000], y[:2000], dt=0.01)
    model.save(tmp_path / "m.json")
    names = list(model.inputs_), model.output_
    record = np.column_stack([0.01 * np.arange(1000), u[2000:], y[2000:]])
    header = ",".join(["t", *names[0], names[1]])
    np.savetxt(tmp_path / "r.csv", record, delimiter=",", header=header, comments="", fmt="%.17g")
    command = [program, "compare", "m.json", "m.json", "r.csv", "--json"]
    said = json.loads(subprocess.run(command, cwd=tmp_path, capture_output=True, check=True, text=True).stdout)
    own = flexure.compare([model], u[2000:], y[2000:]).models[0]
    assert own["fit_percent"] == pytest.approx(said["models"][0]["fit_percent"], rel=1e-9)


def test_missing_outputs_and_wrong_use(signals):
    u, y = signals
    gaps = y.copy()
    gaps[::17] = np.nan
    model = flexure.Linear(missing=True).fit(u, gaps)
    assert any("missing" in warning for warning in model.warnings_)
    whole = flexure.Linear().fit(u, y)
    assert abs(model.linear_.static_gain / whole.linear_.static_gain - 1) < 0.02
    fits = [flexure.compare([m], u, gaps).models[0]["fit_percent"] for m in (model, flexure.Linear(missing=True).fit(u, y))]
    assert abs(fits[0] - fits[1]) < 1
    with pytest.raises(flexure.ParameterError, match="no model"):
        flexure.compare([], u, y)
    with pytest.raises(flexure.DataError, match="is NaN"):
        flexure.Linear().fit(u, gaps)
