"""The Python code at the end of a page makes the same page again."""

import html
import json
import re
import subprocess

import numpy as np
import pandas
import pytest
from conftest import simulated


def carried(page):
    """The numbers that a page plots."""
    return json.loads(re.search(r'id="page-data">(.*?)</script>', page, re.DOTALL)[1])


def code_of(page):
    """The code block of Python."""
    found = re.search(r'data-copy="The same in Python"><pre tabindex="0"><code>(.*?)</code>', page, re.DOTALL)
    return html.unescape(found[1])


@pytest.mark.parametrize(
    "options",
    ["", "--order 1 --fresh 0.4", "--method plain --kernel gaussian", "--known 1=0.5 -1=-0.5", "--structure wiener", "--structure static"],
)
def test_identified_again(tmp_path, monkeypatch, program, options):
    record = simulated(1200)
    pandas.DataFrame({"u": record.u, "y": record.y}).to_csv(tmp_path / "record.csv", index=False)
    monkeypatch.chdir(tmp_path)
    command = f"identify record.csv --input u --output y --sample-time 0.01 {options} --report page.html"
    subprocess.run([program, *command.split()], check=True, capture_output=True)
    by_command = (tmp_path / "page.html").read_text()
    (tmp_path / "page.html").unlink()
    exec(code_of(by_command), {})
    assert carried((tmp_path / "page.html").read_text()) == carried(by_command)


def joint_log():
    """Instants, angle and torque of an axis."""
    rng = np.random.default_rng(3)
    t = np.arange(3000) * 0.005
    w, phase = 2 * np.pi * 0.1 * np.arange(1, 9), rng.uniform(0, 2 * np.pi, 8)
    q, v, a = (np.sin(np.outer(t, w) + phase + k * np.pi / 2) @ (w**k * 0.3 / np.arange(1, 9)) for k in range(3))
    torque = 3 * a + 2 * v + 0.5 * np.tanh(20 * v) + 0.02 * rng.normal(size=t.size)
    return t, q + 1e-5 * rng.normal(size=t.size), torque


@pytest.mark.parametrize(
    ("names", "scales", "options"),
    [(("q", "tau"), (1, 1), ""), (("q_deg", "tau_mNm"), (180 / np.pi, 1000), ""), (("q", "i"), (1, 1 / 20), "--torque-constant 0.2 --gear-ratio 100")],
)
def test_joint_again(tmp_path, monkeypatch, program, names, scales, options):
    t, q, torque = joint_log()
    pandas.DataFrame({"t": t, names[0]: scales[0] * q, names[1]: scales[1] * torque}).to_csv(tmp_path / "log.csv", index=False)
    monkeypatch.chdir(tmp_path)
    command = f"joint log.csv --position {names[0]} --torque {names[1]} {options} --report page.html"
    subprocess.run([program, *command.split()], check=True, capture_output=True)
    by_command = (tmp_path / "page.html").read_text()
    (tmp_path / "page.html").unlink()
    exec(code_of(by_command), {})
    again = carried((tmp_path / "page.html").read_text())
    for one, other in zip(again["curves"], carried(by_command)["curves"], strict=True):
        # None, where the curve jumps, becomes NaN.
        one, other = (np.array(curves["curve"]["y"], dtype=float) for curves in (one, other))
        np.testing.assert_allclose(one, other, rtol=1e-5)


def test_no_code_where_python_reads_otherwise(tmp_path, program):
    record = simulated(600)
    text = "\n".join(["u [V];y [rad]", *(f"{a:.6f};{b:.6f}" for a, b in zip(record.u, record.y, strict=True))])
    (tmp_path / "record.csv").write_text(text + "\n")
    command = "identify record.csv --input u --output y --report page.html"
    subprocess.run([program, *command.split()], check=True, capture_output=True, cwd=tmp_path)
    page = (tmp_path / "page.html").read_text()
    assert "The same in Python" not in page and "This page was made by" in page
