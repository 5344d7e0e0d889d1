"""`flexure app` in the browser: from an untidy record to an FMU, two tabs, a cancelled fit."""

import json
import math
import os
import random
import subprocess
import sys
import time
import zipfile
from pathlib import Path

import pytest
from app_page import flexure, untidy
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.ui import Select

sys.path.append(str(Path(__file__).resolve().parents[2] / "docs/examples"))
import systems  # noqa: E402


@pytest.mark.parametrize("way", ["drop", "upload"])
def test_from_an_untidy_record_to_an_fmu_by_the_keyboard(way, app, browser, tmp_path):
    page = app().open()
    browser.get_log("browser")
    getattr(page, way)(untidy(tmp_path / "motor log.csv"))
    page.ended(1)
    page.wait("!document.querySelector('#columns').hidden")
    names = page.js("return [...document.querySelectorAll('#column-rows th')].map((cell) => cell.textContent)")
    assert names == ["Time", "Command", "Speed"]
    # The spike and the gap go, and the record that comes out is opened.
    page.js("document.querySelector('#prepare [name=outliers]').focus()")
    page.find("#prepare [name=outliers]").send_keys(Keys.SPACE)
    page.find("#prepare [name=fill]").send_keys("5")
    page.press("#prepare button")
    page.ended(3)
    page.wait("document.querySelector('#work-title').textContent === 'Work on motor log-prepared.csv'")
    for name, column in [("input", "Command"), ("output", "Speed")]:
        box = page.find(f"#column-rows [name={name}][value={column}]")
        if not box.is_selected():
            box.send_keys(Keys.SPACE)
    page.press("#identify button")
    item = page.ended(4)
    assert "fit" in item.text
    page.press("[aria-label='Open motor log-prepared-auto.json']")
    Select(page.find("#format")).select_by_value("fmu")
    page.press("#export button")
    page.ended(5)
    downloads = tmp_path / "downloads"
    browser.execute_cdp_cmd("Browser.setDownloadBehavior", {"behavior": "allow", "downloadPath": str(downloads)})
    page.press("#run-list > li a[download]")
    fmu = downloads / "motor_log_prepared_auto.fmu"
    deadline = time.monotonic() + 20
    while not fmu.exists() and time.monotonic() < deadline:
        time.sleep(0.1)
    with zipfile.ZipFile(fmu) as archive:
        assert "modelDescription.xml" in archive.namelist()
    # The command line understands what the app left.
    folder = tmp_path / "project"
    model = folder / "motor log-prepared-auto.json"
    done = subprocess.run([flexure(), "validate", model, folder / "motor log-prepared.csv", "--json"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    severe = [entry["message"] for entry in browser.get_log("browser") if entry["level"] == "SEVERE"]
    assert severe == []


def test_models_are_compared_reported_and_shown(app, tmp_path):
    folder = tmp_path / "project"
    folder.mkdir()
    untidy(folder / "raw.csv")
    tidy = ["prepare", "raw.csv", "--outliers", "all", "--fill", "5", "-o", "m.csv"]
    for arguments in [tidy] + [
        ["identify", "m.csv", "--input", "Command", "--output", "Speed", "--structure", structure, "--model", f"{structure}.json"]
        for structure in ("linear", "hammerstein")
    ]:
        subprocess.run([flexure(), *arguments], cwd=folder, check=True, capture_output=True)
    page = app().open()
    page.press("[aria-label='Open m.csv']")
    page.ended(1)
    for model in ("linear", "hammerstein"):
        page.find(f"#models [value='{model}.json']").send_keys(Keys.SPACE)
    page.press("#compare button")
    item = page.ended(2)
    assert "linear.json" in item.text and "hammerstein.json" in item.text
    assert page.find("#frame iframe").get_attribute("title") == "m-compared.html"
    # The page shows itself, and has nothing of the app.
    page.driver.switch_to.frame(page.find("#frame iframe"))
    page.wait("document.documentElement.dataset.ready === 'true'")
    assert page.js("return origin") == "null"
    page.driver.switch_to.default_content()
    page.press("[aria-label='Open linear.json']")
    Select(page.find("#report-record")).select_by_value("m.csv")
    page.press("#report button")
    page.ended(3)
    assert (folder / "linear-on-m.html").exists()


def test_a_joint_of_a_bag_is_found_and_its_friction_exported(app, tmp_path):
    log = systems.joint_log(duration=30.0)
    systems.write_bag(tmp_path / "arm.mcap", {"elbow": log, "wrist": {name: -values for name, values in log.items() if name != "t"}})
    page = app().open()
    page.upload(tmp_path / "arm.mcap")
    page.ended(1)
    page.wait("!document.querySelector('#topics').hidden")
    Select(page.find("#topic")).select_by_value("/joint_states")
    Select(page.find("#joint")).select_by_value("elbow")
    page.press("#read-topic")
    page.ended(2)
    page.wait("!document.querySelector('#columns').hidden")
    # The columns of a bag's joint are known by their names.
    assert [page.find(f"#robot-joint [name={name}]").get_attribute("value") for name in ("position", "torque")] == ["position", "effort"]
    assert not page.find("#robot-joint [name=motor]").is_displayed()
    page.press("#robot-joint button")
    page.ended(3)
    folder = tmp_path / "project"
    found = json.loads((folder / "arm-elbow-joint.json").read_text())
    assert found["inertia"]["value"] == pytest.approx(0.8, rel=0.02)
    assert page.find("#frame iframe").get_attribute("title") == "arm-elbow-joint.html"
    item = page.find("#run-list > li")
    links = [link.get_attribute("download") for link in item.find_elements("css selector", "a[download]")]
    assert links == ["arm-elbow-friction.csv", "arm-elbow-joint.json", "arm-elbow-joint.html"]
    page.press("#run-list > li button")
    Select(page.find("#format")).select_by_value("c")
    page.press("#export button")
    page.ended(4)
    assert "double arm_elbow_friction_step(" in (folder / "arm_elbow_friction.h").read_text()
    # The header is listed, and never written over.
    downloads = lambda: [link.get_attribute("download") for link in page.find("#run-list > li").find_elements("css selector", "a[download]")]
    assert sorted(downloads()) == ["arm_elbow_friction.c", "arm_elbow_friction.h"]
    (folder / "arm_elbow_friction.c").unlink()
    (folder / "arm_elbow_friction.h").write_text("mine")
    page.press("#export button")
    page.ended(5)
    assert sorted(downloads()) == ["arm_elbow_friction-2.c", "arm_elbow_friction-2.h"]
    assert (folder / "arm_elbow_friction.h").read_text() == "mine"


def test_a_flexible_joint_needs_its_angles_and_can_be_an_arm(app, tmp_path):
    folder = tmp_path / "project"
    folder.mkdir()
    for command in (["simulate", "--preset", "motor-log", "-o", "all.csv"], ["prepare", "all.csv", "--cut", "0:10", "-o", "log.csv"]):
        subprocess.run([flexure(), *command], cwd=folder, check=True, capture_output=True)
    page = app().open()
    page.press("[aria-label='Open log.csv']")
    page.ended(1)
    page.wait("!document.querySelector('#columns').hidden")
    Select(page.find("#robot-joint [name=kind]")).select_by_value("flexible")
    assert not page.find("#robot-joint [name=position]").is_displayed()
    for role, column in [("torque", "tau2"), ("motor", "qm2"), ("link", "q2")]:
        Select(page.find(f"#robot-joint [name={role}]")).select_by_value(column)
    page.find("#robot-joint [name=arm]").send_keys(Keys.SPACE)
    page.press("#robot-joint button")
    page.ended(2, seconds=300)
    assert {"log-stiffness.csv", "log-friction.csv", "log-arm.toml"} <= {path.name for path in folder.iterdir()}
    page.press("[aria-label='Export log-arm.toml']")
    formats = [option.get_attribute("value") for option in Select(page.find("#format")).options]
    assert formats == ["c", "fmu"]
    Select(page.find("#format")).select_by_value("fmu")
    page.press("#export button")
    page.ended(3)
    with zipfile.ZipFile(folder / "log_arm.fmu") as archive:
        assert "sources/log_arm.c" in archive.namelist()


def test_a_regression_is_shown_and_exported(app, tmp_path):
    folder = tmp_path / "project"
    folder.mkdir()
    rng = random.Random(4)
    rows = [(x, math.sin(x) + rng.gauss(0, 0.1)) for x in (rng.uniform(-2, 2) for _ in range(400))]
    (folder / "r.csv").write_text("x,y\n" + "".join(f"{x},{y}\n" for x, y in rows))
    page = app().open()
    page.press("[aria-label='Open r.csv']")
    page.ended(1)
    page.wait("!document.querySelector('#columns').hidden")
    for box in page.driver.find_elements("css selector", "#column-rows [name=input]:checked"):
        box.send_keys(Keys.SPACE)
    page.press("#regress button")
    assert "choose inputs and an output" in page.problem()
    for name, column in [("input", "x"), ("output", "y")]:
        page.find(f"#column-rows [name={name}][value={column}]").send_keys(Keys.SPACE)
    Select(page.find("#estimator")).select_by_value("spline")
    page.press("#regress button")
    page.ended(2)
    assert json.loads((folder / "r-curve.json").read_text())["estimator"] == "spline"
    assert page.find("#frame iframe").get_attribute("title") == "r-curve.html"
    page.press("[aria-label='Export r-curve.csv']")
    Select(page.find("#format")).select_by_value("python")
    page.press("#export button")
    page.ended(3)
    code = "import math, r_curve; assert max(abs(r_curve.r_curve().step(x / 10) - math.sin(x / 10)) for x in range(-15, 16)) < 0.1"
    subprocess.run([sys.executable, "-c", code], cwd=folder, check=True)


def test_two_tabs_work_beside_each_other_and_overwrite_nothing(app, browser, tmp_path):
    page = app().open()
    first = browser.current_window_handle
    page.upload(untidy(tmp_path / "a.csv"))
    page.ended(1)
    browser.switch_to.new_window("tab")
    try:
        page.open()
        page.upload(untidy(tmp_path / "a.csv", seed=2))
        page.ended(1)
        names = sorted(path.name for path in (tmp_path / "project").iterdir())
        assert names == ["a-2-look.html", "a-2.csv", "a-look.html", "a.csv"]
        assert (tmp_path / "project" / "a.csv").read_text() != (tmp_path / "project" / "a-2.csv").read_text()
    finally:
        browser.close()
        browser.switch_to.window(first)
    # The first tab sees what the second did.
    page.js("dispatchEvent(new Event('focus'))")
    page.wait("document.querySelector(\"[aria-label='Open a-2.csv']\") !== null")


def test_a_fit_is_cancelled_and_leaves_nothing(app, tmp_path):
    (tmp_path / "project").mkdir()
    untidy(tmp_path / "project" / "long.csv", samples=60_000)
    page = app().open()
    begun = page.js(
        "run({ command: 'identify', files: ['long.csv'], options: { structure: 'auto', input: 'Command', output: 'Time' },"
        " outputs: { model: 'long.json' } }); return true"
    )
    assert begun
    page.wait("document.querySelector('[data-job] progress') !== null")
    # The page shows what it is doing.
    page.wait("/running, \\d+ s identifying/.test(document.querySelector('[data-job]').textContent)")
    page.press("[data-job] button")
    page.ended(1, state="cancelled", seconds=20)
    # The button is gone; the keyboard goes on from its run.
    assert page.js("return document.activeElement.dataset.job") is not None
    assert [path.name for path in (tmp_path / "project").iterdir()] == ["long.csv"]


def test_commands_end_with_the_app_and_a_result_is_kept_without_the_page(app, tmp_path):
    folder = tmp_path / "project"
    folder.mkdir()
    untidy(folder / "short.csv", samples=600)
    untidy(folder / "long.csv", samples=60_000)
    page = app()

    def begun(**request):
        status, answer = page.asked("POST", page.prefix + "jobs", json.dumps(request))
        assert status == 200, answer

    options = {"x": "Time", "y": "Command"}
    begun(command="regress", files=["short.csv"], options=options, outputs={"out": "curve.csv", "json": "curve.json"})
    deadline = time.monotonic() + 60
    while not (folder / "curve.json").exists() and time.monotonic() < deadline:
        time.sleep(0.1)
    assert json.loads((folder / "curve.json").read_text())["out"] == "curve.csv"
    begun(command="identify", files=["long.csv"], options={"structure": "auto", "input": "Command", "output": "Time"}, outputs={"model": "m.json"})
    children = Path(f"/proc/{page.process.pid}/task/{page.process.pid}/children")
    of_threads = [own for task in children.parents[1].iterdir() for own in (task / "children").read_text().split()]
    assert of_threads
    page.process.terminate()
    page.process.wait(10)
    deadline = time.monotonic() + 10
    while any(Path(f"/proc/{child}").exists() for child in of_threads) and time.monotonic() < deadline:
        time.sleep(0.1)
    assert not any(Path(f"/proc/{child}").exists() for child in of_threads)
    assert sorted(path.name for path in folder.iterdir()) == ["curve.csv", "curve.json", "long.csv", "short.csv"]


def test_how_a_file_is_read_can_be_said(app, tmp_path):
    folder = tmp_path / "project"
    folder.mkdir()
    lines = [f"{1 + k % 7},{100 + k};{2 + k % 5},{200 + k}" for k in range(300)]
    (folder / "m.csv").write_text("u;y\n" + "\n".join(lines) + "\n")
    page = app().open()
    page.press("[aria-label='Open m.csv']")
    page.ended(1, state="failed")
    assert '"Decimal sign"' in page.problem() and "--" not in page.problem()
    assert page.js("return document.querySelector('#how').open")
    Select(page.find("#reading [name=decimal]")).select_by_value("comma")
    page.press("#reading button")
    page.ended(2)
    page.wait("!document.querySelector('#columns').hidden")
    least = page.js("return [...document.querySelectorAll('#column-rows tr')].map((row) => row.children[4].textContent)")
    assert least == ["1.100", "2.200"]
    # The identification reads it in the same way.
    page.js("for (const [name, value] of [['input', 'u'], ['output', 'y']])"
            " document.querySelector(`#column-rows [name=${name}][value=${value}]`).checked = true")
    Select(page.find("#structure")).select_by_value("linear")
    page.find("#identify [name=sample-time]").send_keys("0.01")
    page.press("#identify button")
    page.ended(3)
    page.press("[aria-label='Open m-linear.json']")
    Select(page.find("#format")).select_by_value("fmu")
    Select(page.find("#fmi select")).select_by_value("3")
    page.press("#export button")
    page.ended(4)
    with zipfile.ZipFile(folder / "m_linear.fmu") as archive:
        assert 'fmiVersion="3.0"' in archive.read("modelDescription.xml").decode()


def test_a_look_is_not_written_twice_and_the_keyboard_stays_where_it_was(app, tmp_path):
    folder = tmp_path / "project"
    folder.mkdir()
    untidy(folder / "m.csv")
    page = app().open()
    for runs in (1, 2):
        page.press("[aria-label='Open m.csv']")
        page.ended(runs)
        page.wait("!document.querySelector('#columns').hidden")
        assert page.find("#frame iframe").get_attribute("title") == "m-look.html"
    assert sorted(path.name for path in folder.iterdir()) == ["m-look.html", "m.csv"]
    page.js("document.querySelector(\"[aria-label='Open m.csv']\").focus(); return refresh()")
    page.wait("document.activeElement.getAttribute('aria-label') === 'Open m.csv'")


def test_what_is_wrong_is_said_in_the_words_of_the_page(app, tmp_path):
    folder = tmp_path / "project"
    folder.mkdir()
    untidy(folder / "m.csv")
    page = app().open()
    page.press("[aria-label='Open m.csv']")
    page.ended(1)
    page.wait("!document.querySelector('#columns').hidden")
    page.js("for (const [name, value] of [['input', 'Command'], ['output', 'Speed']])"
            " document.querySelector(`#column-rows [name=${name}][value=${value}]`).checked = true")
    page.js("document.querySelector('#identify [name=missing]').checked = false;"
            " for (const step of ['resample', 'hold', 'outliers', 'fill']) document.querySelector(`#identify [name=${step}]`).value = ''")
    page.press("#identify button")
    page.ended(2, state="failed")
    assert '"Outputs may be missing"' in page.problem() and "--" not in page.problem()
    # It stays in sight.
    page.js("scrollTo(0, document.body.scrollHeight)")
    assert page.js("const box = document.querySelector('#problem').getBoundingClientRect(); return box.top >= 0 && box.bottom <= innerHeight")
    page.find("#identify [name=missing]").send_keys(Keys.SPACE)
    page.press("#identify button")
    page.ended(3)
    assert page.problem() == ""


def test_an_uneven_log_is_identified_with_the_steps_that_the_look_suggests(app, tmp_path):
    folder = tmp_path / "project"
    folder.mkdir()
    rows, level, output, state = ["t,u,y"], 0.0, 0.0, 1
    for k in range(600):
        if k % 4 == 0:
            state = state * 48271 % 2147483647
            level = round(state / 2147483647, 2)
        rows.append(f"{k * 0.1 + (0.03 if k % 7 == 3 else 0):.3f},{level},{output:.5f}")
        output = 0.8 * output + 0.2 * max(level - 0.3, 0)
    (folder / "uneven.csv").write_text("\n".join(rows) + "\n")
    page = app().open()
    page.press("[aria-label='Open uneven.csv']")
    page.ended(1)
    page.wait("!document.querySelector('#columns').hidden")
    steps = "return ['resample', 'hold'].map((name) => document.querySelector(`#identify [name=${name}]`).value)"
    assert page.js(steps) == ["0.1", "u"]
    page.press("#identify button")
    page.ended(2)
    assert json.loads((folder / "uneven-auto.json").read_text())["reading"] == {"hold": "u", "resample": "0.1"}


def test_everything_has_a_name_and_fits_a_phone(app, tmp_path):
    (tmp_path / "project").mkdir()
    untidy(tmp_path / "project" / "m.csv")
    page = app()
    page.driver.execute_cdp_cmd(
        "Emulation.setDeviceMetricsOverride", {"width": 380, "height": 800, "deviceScaleFactor": 1, "mobile": True}
    )
    try:
        page.open()
        page.press("[aria-label='Open m.csv']")
        page.ended(1)
        page.wait("!document.querySelector('#columns').hidden")
        assert page.js("return document.documentElement.scrollWidth") <= 380
        unnamed = page.js(
            "return [...document.querySelectorAll('button, input, select, progress, iframe')].filter((e) => !(e.textContent.trim() ||"
            " e.getAttribute('aria-label') || e.title || e.labels?.length)).map((e) => e.outerHTML)"
        )
        assert unnamed == []
    finally:
        page.driver.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


def test_what_was_wrong_is_said(app, tmp_path):
    (tmp_path / "project").mkdir()
    (tmp_path / "project" / "bad.csv").write_text("u,y\n1,2\n3\n")
    page = app().open()
    page.press("[aria-label='Open bad.csv']")
    page.ended(1, state="failed")
    assert "bad.csv, line 3: 1 field where there are 2 columns" in page.problem()
    assert sorted(os.listdir(tmp_path / "project")) == ["bad.csv"]
