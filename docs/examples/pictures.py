"""Small SVG plots whose text and axes take the colour of the page around them, so that they can be read in light and in dark."""

import re
from contextlib import contextmanager
from pathlib import Path

import matplotlib

matplotlib.use("svg")
from matplotlib import pyplot

INK = "#010203"  # Stands for the page's own colour.
BLUE, ORANGE, GREY = "#3d85c6", "#e08a1e", "#8a8f98"

matplotlib.rcParams.update({
    "svg.fonttype": "none",
    "svg.hashsalt": "flexure",
    "font.family": "sans-serif",
    "font.size": 10,
    "text.color": INK,
    "axes.edgecolor": GREY,
    "axes.labelcolor": INK,
    "axes.titlesize": 10,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "xtick.color": INK,
    "ytick.color": INK,
    "axes.grid": True,
    "grid.color": GREY,
    "grid.alpha": 0.25,
    "legend.frameon": False,
    "legend.fontsize": 9,
    "lines.linewidth": 1.8,
    "path.simplify": True,
    "path.simplify_threshold": 0.5,
})


@contextmanager
def picture(path: Path, panels=1, size=(6.4, 2.9)):
    """Yields the axes; then writes them as an SVG without fixed size, fonts or date."""
    figure, axes = pyplot.subplots(1, panels, figsize=size, layout="constrained")
    yield axes
    figure.savefig(path, format="svg", transparent=True, metadata={"Date": None, "Creator": None, "Format": None, "Type": None})
    pyplot.close(figure)
    svg = path.read_text()
    svg = svg[svg.index("<svg") :]
    svg = re.sub(r"<metadata>.*?</metadata>\s*", "", svg, flags=re.DOTALL)
    svg = re.sub(r'(<svg[^>]*?) width="[^"]*"', r"\1", re.sub(r'(<svg[^>]*?) height="[^"]*"', r"\1", svg, count=1), count=1)
    svg = re.sub(r"font: ([0-9.]+)px [^;\"]*", r"font: \1px sans-serif", svg)
    svg = re.sub(r"(\d+\.\d\d)\d+", r"\1", svg.replace(INK, "currentColor"))
    # Identifiers of several pictures on one page must differ.
    prefix = path.stem
    svg = re.sub(r'id="([^"]+)"', rf'id="{prefix}-\1"', svg)
    svg = re.sub(r'(url\(|href=")#', rf"\1#{prefix}-", svg)
    path.write_text("\n".join(line.rstrip() for line in svg.splitlines()) + "\n")
