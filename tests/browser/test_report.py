"""What a report page must do in a real browser.

    python tests/browser/test_report.py PAGE.html ...
    FLEXURE_REPORTS=PAGE.html pytest tests/browser
"""

import base64
import json
import os
import sys
from pathlib import Path

import pytest
from selenium.webdriver.common.action_chains import ActionChains

# Colours that differ from the most frequent one, on each canvas. A canvas scrolled out of view is drawn all the same.
DRAWN = """
return [...document.querySelectorAll("canvas")].map((canvas) => {
  const { width, height } = canvas;
  const where = canvas.closest("[id]").id || canvas.id;
  if (width === 0 || height === 0) return [where, 0, 0];
  const pixels = new Uint32Array(canvas.getContext("2d").getImageData(0, 0, width, height).data.buffer);
  const counts = new Map();
  for (const pixel of pixels) counts.set(pixel, (counts.get(pixel) ?? 0) + 1);
  const most = Math.max(...counts.values());
  return [where, counts.size, pixels.length - most];
});
"""

ARM_PICTURE = "return document.querySelector('#arm-canvas, #chain-canvas').toDataURL()"


def severe(report):
    return [entry["message"] for entry in report.driver.get_log("browser") if entry["level"] in ("SEVERE", "WARNING")]


def needs(report, selector, what):
    if not report.has(selector):
        pytest.skip(f"{report.path.name} has no {what}")


def drag(report, plot, start, end):
    """Drags across a plot, from and to a part of its width."""
    over = report.driver.find_element("css selector", f"#{plot} .u-over")
    report.js("arguments[0].scrollIntoView({block: 'center', behavior: 'instant'})", over)
    width = over.size["width"]
    actions = ActionChains(report.driver, duration=50)
    actions.move_to_element_with_offset(over, int((start - 0.5) * width), 0).click_and_hold()
    actions.move_to_element_with_offset(over, int((end - 0.5) * width), 5).release().perform()
    report.settle()


def test_opens_without_console_messages(report):
    assert severe(report) == []


def test_makes_no_request(report):
    sent = [json.loads(entry["message"])["message"] for entry in report.driver.get_log("performance")]
    urls = [m["params"]["request"]["url"] for m in sent if m["method"] == "Network.requestWillBeSent"]
    others = [url for url in urls if not url.startswith("data:") and url != report.path.as_uri()]
    assert others == []


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
@pytest.mark.parametrize("width", [1280, 390])
def test_every_plot_has_drawn_pixels(report, width, dark):
    report.open(width=width, dark=dark)
    canvases = report.js(DRAWN)
    assert canvases, "no plot at all"
    for where, colours, pixels in canvases:
        assert colours > 3 and pixels > 200, f"{where} is blank: {colours} colours, {pixels} pixels"


@pytest.mark.parametrize("width", [1280, 768, 390])
def test_nothing_overflows_sideways(report, width):
    report.open(width=width)
    shown, wide = report.js("return [innerWidth, document.documentElement.scrollWidth]")
    assert (shown, wide <= width) == (width, True), f"{wide} px of content in {shown}"


def test_no_box_is_empty(report):
    empty = report.js(
        """return [...document.querySelectorAll("section, figure, .card, .plot, table, ul, dl, pre")]
             .filter((e) => !e.querySelector("canvas, svg, input") && !e.textContent.trim()).map((e) => e.outerHTML)"""
    )
    assert empty == []


def test_drag_zooms_and_double_click_resets(report):
    needs(report, "#plot-prediction", "prediction")
    report.click("#tools-prediction [data-zoom=reset]:not(:disabled), #tools-prediction [data-zoom=in]")
    before = report.window("plot-prediction")
    drag(report, "plot-prediction", 0.3, 0.5)
    zoomed = report.window("plot-prediction")
    span = before[1] - before[0]
    assert zoomed[0] == pytest.approx(before[0] + 0.3 * span, abs=0.03 * span)
    assert zoomed[1] == pytest.approx(before[0] + 0.5 * span, abs=0.03 * span)
    assert report.window("plot-error") == zoomed, "the error does not follow"
    over = report.driver.find_element("css selector", "#plot-prediction .u-over")
    ActionChains(report.driver).double_click(over).perform()
    report.settle()
    low, high = report.window("plot-prediction")
    assert low <= before[0] and high >= before[1] and high - low >= span


def test_strip_chooses_the_window(report):
    needs(report, "#plot-overview", "overview")
    whole = report.window("plot-overview")
    drag(report, "plot-overview", 0.6, 0.8)
    shown = report.window("plot-prediction")
    span = whole[1] - whole[0]
    assert shown[0] == pytest.approx(whole[0] + 0.6 * span, abs=0.03 * span)
    assert shown[1] == pytest.approx(whole[0] + 0.8 * span, abs=0.03 * span)
    assert report.window("plot-overview") == whole, "the strip itself must not zoom"


@pytest.mark.parametrize("name, plot", [("prediction", "plot-prediction"), ("record", "plot-record .plot")])
def test_buttons_zoom_pan_and_reset(report, name, plot):
    tools = f"#tools-{name}"
    needs(report, tools, name)
    shown = f"const d = document.querySelector('#{plot}').dataset; return [Number(d.xMin), Number(d.xMax)]"
    if report.js(f"return !document.querySelector('{tools} [data-zoom=reset]').disabled"):
        report.click(f"{tools} [data-zoom=reset]")
    whole = report.js(shown)
    span = whole[1] - whole[0]
    report.click(f"{tools} [data-zoom=in]")
    report.click(f"{tools} [data-zoom=in]")
    low, high = report.js(shown)
    assert high - low == pytest.approx(span / 4, rel=1e-6)
    report.click(f"{tools} [data-zoom=right]")
    assert report.js(shown)[0] == pytest.approx(low + span / 8, rel=1e-6)
    report.click(f"{tools} [data-zoom=left]")
    report.click(f"{tools} [data-zoom=out]")
    assert report.js(shown)[1] - report.js(shown)[0] == pytest.approx(span / 2, rel=1e-6)
    report.click(f"{tools} [data-zoom=reset]")
    assert report.js(shown) == pytest.approx(whole)
    assert severe(report) == []


def test_theme_button_changes_colours_and_plots(report):
    colour = "return getComputedStyle(document.body).backgroundColor"
    picture = "return document.querySelector('canvas').toDataURL()"
    before = report.js(colour), report.js(picture)
    report.click("#theme")
    dark = report.js(colour), report.js(picture)
    assert dark[0] != before[0], "the page keeps its colours"
    assert dark[1] != before[1], "the plots keep their colours"
    report.click("#theme")
    assert (report.js(colour), report.js(picture)) == before


def test_a_chain_turns_as_it_is_dragged(report):
    needs(report, "#chain-canvas", "chain")
    canvas = report.driver.find_element("css selector", "#chain-canvas")
    report.js("arguments[0].scrollIntoView({block: 'center', behavior: 'instant'})", canvas)
    before = report.js(ARM_PICTURE)
    actions = ActionChains(report.driver, duration=50)
    actions.move_to_element(canvas).click_and_hold().move_by_offset(60, -20).release().perform()
    report.settle()
    turned = report.js(ARM_PICTURE)
    assert turned != before, "the picture does not turn"
    actions = ActionChains(report.driver, duration=50)
    actions.move_to_element(canvas).move_by_offset(40, 10).perform()
    report.settle()
    assert report.js(ARM_PICTURE) == turned, "the picture turns without being dragged"


def test_arm_plays_pauses_and_seeks(report):
    needs(report, "#arm-play", "arm")
    where = "return Number(document.getElementById('arm-time').value)"
    # A chain has no plots beside its picture.
    line = "return document.querySelector('.playhead')?.style.transform ?? document.getElementById('arm-clock').textContent"
    before = report.js(where), report.js(ARM_PICTURE), report.js(line)
    report.click("#arm-play")
    report.wait(f"Number(document.getElementById('arm-time').value) > {before[0] + 5}", "the slider does not move")
    assert report.js("return document.getElementById('arm-play').getAttribute('aria-label')") == "Pause"
    report.click("#arm-play")
    after = report.js(where), report.js(ARM_PICTURE), report.js(line)
    assert after[1] != before[1], "the picture stands still"
    assert after[2] != before[2], "the line in the plots, or the clock, stands still"
    report.settle()
    assert report.js(where) == after[0], "paused, but the time runs on"
    report.js("const s = document.getElementById('arm-time'); s.value = 0; s.dispatchEvent(new Event('input'))")
    assert report.js(ARM_PICTURE) != after[1], "the slider does not move the arm"
    assert severe(report) == []
    if not report.has("#arm-plots .u-over"):
        return
    report.click("#arm-plots .u-over")
    last = report.js("return Number(document.getElementById('arm-time').max)")
    assert report.js(where) == pytest.approx(last / 2, rel=0.03), "a click into a plot does not seek"
    assert severe(report) == []


def point_at(report, plot, right, down):
    """Moves the pointer into a plot, to a part of its width and of its height."""
    over = report.driver.find_element("css selector", f"#{plot} .u-over")
    report.js("arguments[0].scrollIntoView({block: 'center', behavior: 'instant'})", over)
    x, y = (right - 0.5) * over.size["width"], (down - 0.5) * over.size["height"]
    ActionChains(report.driver).move_to_element_with_offset(over, int(x), int(y)).perform()
    report.settle()


def test_curve_zooms_and_its_data_can_be_hidden(report):
    needs(report, "#plot-curve", "curve")
    low, high = report.window("plot-curve")
    drag(report, "plot-curve", 0.25, 0.5)
    zoomed = report.window("plot-curve")
    assert zoomed[0] == pytest.approx(low + 0.25 * (high - low), abs=0.03 * (high - low))
    assert zoomed[1] == pytest.approx(low + 0.5 * (high - low), abs=0.03 * (high - low))
    over = report.driver.find_element("css selector", "#plot-curve .u-over")
    ActionChains(report.driver).double_click(over).perform()
    report.settle()
    assert report.window("plot-curve") == pytest.approx((low, high))
    picture = "return document.querySelector('#plot-curve canvas').toDataURL()"
    before = report.js(picture)
    report.click("#plot-curve .u-legend .dots th")
    assert report.js(picture) != before, "the data stay"
    report.click("#plot-curve .u-legend .dots th")
    assert report.js(picture) == before, "the data do not come back"
    assert severe(report) == []


def test_surface_is_read_under_the_pointer(report):
    needs(report, "#plot-surface", "surface")
    words = "return document.getElementById('surface-readout').textContent"
    low, high = report.window("plot-surface")
    said = []
    for right in (0.3, 0.7):
        point_at(report, "plot-surface", right, 0.5)
        said.append(report.js(words))
        place = float(said[-1].split(" = ")[1].split(",")[0].replace("−", "-"))
        assert place == pytest.approx(low + right * (high - low), abs=0.03 * (high - low)), said[-1]
    assert said[0] != said[1]
    assert severe(report) == []


def test_plots_follow_the_width(report):
    needs(report, ".plot canvas", "plot")
    wide = report.js("return document.querySelector('.plot canvas').width")
    report.driver.execute_cdp_cmd(
        "Emulation.setDeviceMetricsOverride", {"width": 700, "height": 900, "deviceScaleFactor": 1, "mobile": False}
    )
    report.wait(f"document.querySelector('.plot canvas').width !== {wide}", "the plot keeps its width")


def test_prints(report):
    report.open(dark=True)
    report.js(
        """addEventListener("beforeprint", () => {
             window.printedDark = document.documentElement.classList.contains("dark");
           }, { once: true })"""
    )
    printed = report.driver.execute_cdp_cmd("Page.printToPDF", {"printBackground": True, "preferCSSPageSize": True})
    pdf = base64.b64decode(printed["data"])
    assert pdf.startswith(b"%PDF-") and len(pdf) > 20_000
    assert report.js("return window.printedDark") is False, "paper is light"
    assert report.js("return document.documentElement.classList.contains('dark')"), "the screen is dark again"
    assert severe(report) == []


if __name__ == "__main__":
    named = [str(Path(name).resolve()) for name in sys.argv[1:]]
    if named:
        os.environ["FLEXURE_REPORTS"] = os.pathsep.join(named)
    sys.exit(pytest.main(["-q", str(Path(__file__).parent)]))
