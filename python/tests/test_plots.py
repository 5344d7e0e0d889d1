"""Plots and notebooks' drawings show what was found."""

from xml.etree import ElementTree

import matplotlib
import numpy as np
import pytest
from conftest import dead_zone

import flexure
from flexure import plots

matplotlib.use("Agg")


def test_the_curve_is_the_estimate(fitted):
    axes = plots.nonlinearity(fitted.nonlinearity_, input="torque", truth=dead_zone)
    estimate, truth, breaks = axes.get_lines()
    np.testing.assert_array_equal(estimate.get_ydata(), fitted.nonlinearity_.y)
    np.testing.assert_array_equal(truth.get_ydata(), dead_zone(fitted.nonlinearity_.x))
    assert len(breaks.get_xdata()) == 2 and len(axes.collections) == 1 and axes.get_xlabel() == "torque"


def test_a_curve_has_a_gap_where_it_is_not_determined():
    x = np.linspace(-1, 1, 5)
    band = {"x": list(x), "y": list(x), "lower": list(x - 1), "upper": list(x + 1)}
    found = flexure.results.Nonlinearity.of({**band, "undetermined": [[-0.1, 0.6]]})
    axes = plots.nonlinearity(found)
    np.testing.assert_array_equal(axes.get_lines()[0].get_ydata(), [-1, -0.5, np.nan, np.nan, 1])
    assert flexure.results.Nonlinearity.of(band).undetermined == ()


def test_bode_is_the_response(fitted):
    gain, phase = plots.bode(fitted.linear_)
    line = gain.get_lines()[0]
    response = fitted.linear_.frequency_response(2 * np.pi * line.get_xdata())
    np.testing.assert_allclose(line.get_ydata(), 20 * np.log10(np.abs(response)))
    assert line.get_xdata()[-1] == pytest.approx(50) and phase.get_xlabel() == "frequency / Hz"


def test_bars_are_the_tests(fitted):
    axes = plots.residual_tests(fitted.verdict_)
    tests = fitted.verdict_.tests[::-1]
    assert [bar.get_width() for bar in axes.patches] == [test.statistic / test.limit for test in tests]
    assert [label.get_text() for label in axes.get_yticklabels()] == [test.name for test in tests]


def test_everything_in_one_figure(fitted, record):
    figure = fitted.plot(truth=dead_zone)
    axes = figure.axes
    assert len(axes) == 5
    shown = next(a for a in axes if a.get_ylabel() == "y").get_lines()
    np.testing.assert_array_equal(shown[0].get_ydata(), record.y[fitted.fitted_ :][:300])
    assert f"fit {fitted.verdict_.fit_percent:.1f} %" in shown[1].get_label()
    loaded = flexure.Hammerstein.from_json(fitted.to_json()).plot()
    assert len(loaded.subfigs) == 2
    matplotlib.pyplot.close("all")


def test_notebooks_draw_the_blocks(fitted):
    html = fitted._repr_html_()
    tree = ElementTree.fromstring(html.replace("&rarr;", "").replace("&#8209;", "-"))
    drawings = list(tree.iter("svg"))
    assert [len(list(d.iter("polygon"))) for d in drawings] == [1, 0, 0]  # the curve with its band, gain, phase
    points = [tuple(map(float, p.split(","))) for p in drawings[0].find("polyline").get("points").split()]
    across, down = np.array(points).T
    assert np.all(np.diff(across) > 0) and np.all((down >= 0) & (down <= 110))
    curve = fitted.nonlinearity_(np.linspace(-2, 2, len(down)))
    assert np.corrcoef(-down, curve)[0, 1] > 0.999
    for drawing, highest in zip(drawings[1:], (62, 48), strict=True):
        down = [float(p.split(",")[1]) for p in drawing.find("polyline").get("points").split()]
        assert 0 <= min(down) < 0.2 * highest and 0.8 * highest < max(down) <= highest  # each has all of its height
    assert "model holds" in html and "order 2, delay 1" in html
    assert fitted._repr_mimebundle_()["text/html"] == html
    assert flexure.Wiener()._repr_html_() == "<pre>Wiener()</pre>"
