"""What can be taken from a page: data, pictures, code; and what its plots say under the pointer."""

import csv
import io
import re
import time
import xml.etree.ElementTree as ElementTree

import pytest
from selenium.webdriver.common.action_chains import ActionChains
from test_report import needs, point_at, severe

CARDS = "return [...document.querySelectorAll('figure.card')].filter((card) => card.querySelector('.save')).length"


@pytest.fixture
def downloads(browser, tmp_path):
    """Where the browser's downloads go."""
    browser.execute_cdp_cmd("Browser.setDownloadBehavior", {"behavior": "allow", "downloadPath": str(tmp_path)})
    return tmp_path


def saved(report, downloads, card, kind):
    """What a button of the card of this number saves; what was saved before is gone."""
    for path in downloads.iterdir():
        path.unlink()
    report.js(f"[...document.querySelectorAll('.save')][{card}].id = 'save-{card}'")
    # True clicks, no faster than ten a second: the browser drops the rest, and stops a page that saves many files on its own.
    time.sleep(0.15)
    report.click(f"#save-{card} [data-save={kind}]")
    deadline = time.monotonic() + 15
    while time.monotonic() < deadline:
        new = [path for path in downloads.iterdir() if path.suffix == f".{kind}" and path.stat().st_size]
        if new:
            return new[0]
        time.sleep(0.05)
    pytest.fail(f"card {card} of {report.path.name} saves no {kind}")


def buttons(report, card):
    return report.js(f"return [...[...document.querySelectorAll('.save')][{card}].children].map((b) => b.dataset.save)")


def test_every_card_with_a_plot_has_buttons(report):
    bare = report.js(
        "return [...document.querySelectorAll('figure.card')].filter((card) => card.querySelector('.plot, .svg-plot')"
        " && !card.querySelector('.save')).map((card) => card.textContent.slice(0, 60))"
    )
    assert bare == []
    unnamed = report.js("return [...document.querySelectorAll('.save button')].filter((b) => !b.getAttribute('aria-label')).length")
    assert unnamed == 0


def test_csv_has_the_data_of_every_card_with_names(report, downloads):
    cards = report.js(CARDS)
    assert cards > 0
    for card in range(cards):
        if "csv" not in buttons(report, card):
            continue
        rows = list(csv.reader(io.StringIO(saved(report, downloads, card, "csv").read_text())))
        names = rows[0]
        assert len(names) >= 2 and all(names) and len(set(names)) == len(names), names
        assert len(rows) > 1 and {len(row) for row in rows} == {len(names)}, "the rows differ in length"
        assert all(len(name) <= 80 and "narrower" not in name for name in names), names
        numbers = [cell for row in rows[1:] for cell in row if cell]
        digits = [re.sub(r"^-?[0.]*|e.*|\.", "", cell) for cell in numbers]
        assert all(len(cell) <= 9 for cell in digits), "digits that are rounding"
        kinds = {"pole", "zero"}
        assert numbers and all(cell in kinds or float(cell) is not None for cell in numbers)
        for name in names:
            assert name.count("(") <= 2 and not re.search(r"\(([^()]*)\) \(\1\)", name), f"the unit stands twice: {name}"
    assert severe(report) == []


def test_csv_of_the_prediction_is_what_the_page_carries(report, downloads):
    needs(report, "#plot-prediction", "prediction")
    card = report.js("return [...document.querySelectorAll('.save')].indexOf(document.querySelector('#prediction-figure .save'))")
    rows = list(csv.reader(io.StringIO(saved(report, downloads, card, "csv").read_text())))
    carried = report.js("const p = JSON.parse(document.getElementById('page-data').textContent).prediction; return [p.measured, p.error, p.time]")
    measured, error, grid = carried
    assert len(rows) - 1 == len(measured) == grid["count"]
    assert rows[0][0] == grid["label"]
    for index in (0, len(measured) // 2, len(measured) - 1):
        row = [float(cell) if cell else None for cell in rows[index + 1]]
        assert row[1] == measured[index]
        assert row[-1] == error[index]
        assert row[0] == pytest.approx(grid["start"] + index * grid["step"])
    # Zooming changes the picture, not the data.
    report.click("#tools-prediction [data-zoom=in]")
    assert saved(report, downloads, card, "csv").read_text().count("\n") == len(measured) + 1


def test_svg_is_a_drawing_and_png_a_picture(report, downloads):
    report.open(dark=True)
    background = "return getComputedStyle(document.body).backgroundColor"
    before = report.js(background)
    for card in range(report.js(CARDS)):
        text = saved(report, downloads, card, "svg").read_text()
        root = ElementTree.fromstring(text)
        tags = [element.tag.rsplit("}", 1)[-1] for element in root.iter()]
        assert root.tag == "{http://www.w3.org/2000/svg}svg", root.tag
        assert tags.count("path") > 4 and tags.count("text") > 2, f"card {card} has no lines: {set(tags)}"
        assert "NaN" not in text and "undefined" not in text
        assert 'fill="#ffffff"' in text, "the picture is not light"
        png = saved(report, downloads, card, "png").read_bytes()
        assert png.startswith(b"\x89PNG") and len(png) > 2000
        width = int.from_bytes(png[16:20], "big")
        assert width == pytest.approx(2 * float(root.get("width")), abs=2)
    assert report.js(background) == before, "the page stays dark"
    assert severe(report) == []


def test_table_shows_the_data_and_goes_again(report):
    needs(report, "[data-save=table]", "data")
    button = "[data-save=table]"
    report.click(button)
    shown = report.js(
        """const box = document.querySelector(".data-table"); const card = box.closest("figure");
           return [card.querySelector("[data-save=table]").getAttribute("aria-expanded"), box.getAttribute("role"),
                   box.querySelector("caption").textContent, box.querySelectorAll("thead th").length,
                   [...box.querySelectorAll("tbody tr")].map((row) => row.cells.length)]"""
    )
    expanded, role, caption, columns, rows = shown
    assert (expanded, role) == ("true", "region") and caption
    assert columns >= 2 and 0 < len(rows) <= 20 and set(rows) == {columns}
    report.click(button)
    assert not report.has(".data-table")
    assert report.js(f"return document.querySelector('{button}').getAttribute('aria-expanded')") == "false"


def test_band_says_both_edges_under_the_pointer(report):
    plots = report.js("return [...document.querySelectorAll('.u-legend .band')].map((e) => e.closest('.plot').id)")
    if not plots:
        pytest.skip(f"{report.path.name} has no band")
    said = []
    for plot in plots:
        for right in (0.5, 0.4, 0.6, 0.75):  # a band may have gaps
            point_at(report, plot, right, 0.5)
            text = report.js(f"return document.querySelector('#{plot} .band .u-value').textContent").replace("−", "-")
            if text:
                break
        assert " to " in text, f"{plot} says {text!r}"
        low, high = (float(edge.split()[0]) for edge in text.split(" to "))
        assert low < high
        said.append((low, high))
    assert said


def test_values_under_the_pointer_have_their_unit(report):
    needs(report, "#plot-prediction", "prediction")
    label = report.js("return JSON.parse(document.getElementById('page-data').textContent).prediction.y_label")
    unit = re.search(r"\(([^()]*)\)$", label)
    if not unit:
        pytest.skip("the output has no unit")
    point_at(report, "plot-prediction", 0.5, 0.5)
    values = report.js("return [...document.querySelectorAll('#plot-prediction .u-value')].map((e) => e.textContent)")
    assert sum(value.endswith(f" {unit[1]}") for value in values) == 2, values


def test_code_can_be_copied(report):
    needs(report, "[data-copy]", "code")
    blocks = report.js("return [...document.querySelectorAll('[data-copy]')].map((b) => b.querySelector('code').textContent)")
    report.driver.execute_cdp_cmd("Browser.grantPermissions", {"permissions": ["clipboardReadWrite", "clipboardSanitizedWrite"]})
    for index, text in enumerate(blocks):
        button = report.driver.find_elements("css selector", "[data-copy] .copy")[index]
        report.js("arguments[0].scrollIntoView({block: 'center', behavior: 'instant'})", button)
        ActionChains(report.driver).move_to_element(button).click().perform()
        report.wait(f"document.querySelectorAll('[data-copy] .copy')[{index}].textContent === 'Copied'", "nothing was copied")
        held = report.driver.execute_async_script("navigator.clipboard.readText().then(arguments[0], (e) => arguments[0](String(e)))")
        assert held == text


@pytest.mark.parametrize("width", [1280, 390])
def test_the_diagram_is_readable(report, width):
    needs(report, "#diagram", "block diagram")
    report.open(width=width)
    drawn = report.js(
        """const svg = [...document.querySelectorAll("#diagram svg")].filter((s) => s.getBoundingClientRect().width > 0);
           const [box] = svg.map((s) => s.getBoundingClientRect());
           const texts = [...svg[0].querySelectorAll("text")].map((t) => t.getBoundingClientRect());
           const boxes = [...svg[0].querySelectorAll(".flow-box")].map((b) => b.getBoundingClientRect());
           const inside = (t) => t.left >= box.left - 1 && t.right <= box.right + 1 && t.top >= box.top - 1 && t.bottom <= box.bottom + 1;
           const cut = (t) => boxes.some((b) => t.top >= b.top && t.bottom <= b.bottom && t.left < b.right && t.right > b.left
                                             && (t.left < b.left || t.right > b.right));
           return [svg.length, texts.length, texts.filter((t) => !inside(t) || cut(t)).length, Math.min(...texts.map((t) => t.height)),
                   document.getElementById("diagram").getAttribute("aria-label")]"""
    )
    shown, texts, outside, least, label = drawn
    assert shown == 1, "one drawing at a time"
    assert texts >= 3 and outside == 0, f"{outside} of {texts} texts leave their place"
    assert least >= 8, f"letters {least} px high"
    assert label.startswith("Block diagram: ") and ", then " in label


def test_saving_is_not_printed(report):
    report.js("document.documentElement.classList.add('printing')")
    seen = report.js("return [...document.querySelectorAll('.save, .copy')].filter((e) => e.getBoundingClientRect().height > 0).length")
    assert seen == 0
