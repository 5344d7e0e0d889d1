"""Parts of the page of a model that the browser computes or draws from numbers."""

import itertools

import pytest
from test_report import needs, severe

DATA = "return JSON.parse(document.getElementById('page-data').textContent)"


def columns(report, plot):
    """The table of the card of a plot: its names, and its rows of text."""
    report.js("document.getElementById(arguments[0]).closest('figure').querySelector('[data-save=table]').click()", plot)
    return report.js(
        """const table = document.getElementById(arguments[0]).closest("figure").querySelector(".data-table table");
           const text = (row) => [...row.cells].map((cell) => cell.textContent.replaceAll("−", "-"));
           return [text(table.tHead.rows[0]), [...table.tBodies[0].rows].map(text)]""",
        plot,
    )


def test_step_response_adds_up_the_impulse_response(report):
    needs(report, "#plot-step-0", "linear part")
    linear = report.js(DATA)["linear"][0]
    sums = list(itertools.accumulate(linear["impulse"]))
    names, rows = columns(report, "plot-step-0")
    unit, step = linear["response_unit"], linear.get("sample_time", 1)
    time = "s" if "sample_time" in linear else "samples"
    assert names == [f"time since the step ({time})", f"step response ({unit})" if unit else "step response"]
    for row in rows:
        assert float(row[1]) == pytest.approx(sums[round(float(row[0]) / step)], rel=1e-4, abs=1e-4)
    assert severe(report) == []


def test_regions_of_poles_hold_what_their_covariance_says(report):
    needs(report, "#plot-roots-0", "poles")
    part = report.js(DATA)["linear"][0]
    known = [(p, c) for p, c in zip(part["poles"], part.get("pole_covariances", []), strict=False) if None not in c]
    drawn = report.js(
        """return [...document.querySelectorAll("#plot-roots-0 .root-region")].map((e) =>
             ["cx", "cy", "rx", "ry"].map((name) => Number(e.getAttribute(name))))"""
    )
    assert len(drawn) == len(known)
    # The unit circle tells how many pixels 1 is.
    scale = report.js("return Number(document.querySelector('#plot-roots-0 .root-circle').getAttribute('r'))")
    for (_, (real, both, imaginary)), (_, _, rx, ry) in zip(known, drawn, strict=True):
        if imaginary == 0:
            assert rx == pytest.approx(1.96 * real**0.5 * scale, rel=1e-3)
        else:
            # The ellipse's area is 5.991 pi times the root of the determinant.
            area = 5.991 * (real * imaginary - both**2) ** 0.5 * scale**2
            assert rx * ry == pytest.approx(area, rel=1e-3) or ry == 1.5


def test_bode_bands_are_there_where_they_are_known(report):
    needs(report, "#plot-magnitude-0", "Bode diagram")
    part = report.js(DATA)["linear"][0]
    bands = report.js("return document.querySelectorAll('#plot-magnitude-0 .u-legend .band, #plot-phase-0 .u-legend .band').length")
    assert bands == (2 if part.get("magnitude_error") else 0)
    names, rows = columns(report, "plot-magnitude-0")
    if not bands:
        return
    low, high, middle = (names.index(name) for name in ("lower 95 % (dB)", "upper 95 % (dB)", "magnitude (dB)"))
    for row in rows:
        assert float(row[low]) < float(row[middle]) < float(row[high])


def test_joints_have_the_verdict_of_models(report):
    if report.path.stem not in ("joints", "axis", "report"):
        pytest.skip("is not the page of a model or a joint")
    mark, heading, text = report.js(
        """const v = document.querySelector("main > .verdict");
           return [v.querySelectorAll("svg").length, v.querySelector("h2").textContent, v.querySelector("p").textContent]"""
    )
    assert mark == 1 and heading and text.endswith(".")


def test_cards_of_a_row_are_of_one_height(report):
    rows = report.js(
        """return [...document.querySelectorAll(".pair, .choices")].map((row) => [...row.children].map((card) => {
             const box = card.getBoundingClientRect(); return [box.top, box.height, box.right, row.getBoundingClientRect().right]; }))"""
    )
    for row in rows:
        for _, same in itertools.groupby(row, key=lambda card: round(card[0])):
            same = list(same)
            assert max(c[1] for c in same) - min(c[1] for c in same) < 1
            assert same[-1][2] == pytest.approx(same[-1][3], abs=2), "the row has a hole"
