"""Plots of identified systems with matplotlib, fit for a paper.

Every function draws into axes of its own or into the ones that are given, and returns the axes.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from flexure._core import ParameterError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

    from flexure.results import Block, LinearPart, Nonlinearity, Surface, Verdict
    from flexure.systems import System

__all__ = ["bode", "comparison", "nonlinearity", "residual_tests", "surface", "system"]

# Told apart by colour-blind readers too (Okabe and Ito 2008).
BLUE, ORANGE, GREY = "#0072b2", "#d55e00", "#666666"
# Decades below the highest frequency that a Bode plot covers.
_DECADES = 3.0
_FREQUENCIES = 400
# Samples that a comparison shows, unless it is given which.
_SHOWN = 300


def _axes(axes: Axes | None, **size: Any) -> Axes:
    if axes is not None:
        return axes
    import matplotlib.pyplot as plt  # an optional dependency

    made: Axes = plt.subplots(layout="constrained", **size)[1]
    return made


def _calm(axes: Axes) -> Axes:
    """Only the lines that are read."""
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(color="#e6e6e6", linewidth=0.6)
    axes.set_axisbelow(True)
    return axes


def nonlinearity(
    found: Nonlinearity, *, input: str = "input", output: str = "nonlinearity", truth: Any = None, axes: Axes | None = None
) -> Axes:
    """The curve with its pointwise 95 % band and its breakpoints; dashed, `truth(x)` where that is given."""
    axes = _calm(_axes(axes, figsize=(4.5, 3.2)))
    hidden = np.zeros(len(found.x), dtype=bool)
    for low, high in found.undetermined:
        hidden |= (found.x >= low) & (found.x <= high)
    if found.lower is not None and found.upper is not None:
        axes.fill_between(found.x, found.lower, found.upper, where=~hidden, color=BLUE, alpha=0.2, linewidth=0, label="95 % band")
    axes.plot(found.x, np.where(hidden, np.nan, found.y), color=BLUE, linewidth=1.4, label="estimate")
    if truth is not None:
        axes.plot(found.x, truth(found.x), "--", color=ORANGE, linewidth=1.2, label="truth")
    breaks = [at for at, kind in found.breakpoints if kind != "knot"]
    if breaks:
        axes.plot(breaks, found(breaks), "o", color=BLUE, markersize=4, markerfacecolor="white", label="jump or kink")
    axes.set(xlabel=input, ylabel=output)
    axes.ticklabel_format(style="sci", scilimits=(-3, 4))
    if len(axes.get_legend_handles_labels()[1]) > 1:
        axes.legend(frameon=False, fontsize="small")
    return axes


def surface(
    found: Surface, *, inputs: Sequence[str] = ("input 1", "input 2"), output: str = "nonlinearity", axes: Axes | None = None
) -> Axes:
    """A nonlinearity of several inputs as lines of equal height over the first two, the others at the middles of their ranges."""
    if len(found.axes) < 2:
        raise ParameterError("the nonlinearity has one input; draw it over that")
    axes = _axes(axes, figsize=(4.5, 3.4))
    across, values = found.grid()
    filled = axes.contourf(*across, values.T, levels=14, cmap="PuOr_r")
    axes.contour(*across, values.T, levels=filled.levels, colors=GREY, linewidths=0.4)
    axes.get_figure().colorbar(filled, ax=axes, label=output)  # type: ignore[union-attr]
    axes.set(xlabel=inputs[0], ylabel=inputs[1])
    return axes


def bode(part: LinearPart, *, axes: tuple[Axes, Axes] | None = None) -> tuple[Axes, Axes]:
    """Gain and phase over frequency: in Hz, or in cycles a sample where the sample time is not known."""
    if axes is None:
        import matplotlib.pyplot as plt

        _, pair = plt.subplots(2, 1, sharex=True, layout="constrained", figsize=(4.5, 4.2))
        axes = (pair[0], pair[1])
    highest = 0.5 / (part.dt or 1.0)
    frequency = np.logspace(np.log10(highest) - _DECADES, np.log10(highest), _FREQUENCIES)
    response = part.frequency_response(2 * np.pi * frequency)
    with np.errstate(divide="ignore"):
        gain = 20 * np.log10(np.abs(response))
    for ax, values, label in zip(
        axes, (gain, np.degrees(np.unwrap(np.angle(response)))), ("gain / dB", "phase / °"), strict=True
    ):
        _calm(ax).semilogx(frequency, values, color=BLUE, linewidth=1.4)
        ax.set_ylabel(label)
    axes[1].set_xlabel("frequency / Hz" if part.dt else "frequency / cycles a sample")
    return axes


def residual_tests(verdict: Verdict, *, axes: Axes | None = None) -> Axes:
    """Every test's statistic in shares of its limit: beyond 1 it fails."""
    tests = verdict.tests[::-1]
    axes = _axes(axes, figsize=(5.5, 0.45 * len(tests) + 0.9))
    shares = [test.statistic / test.limit for test in tests]
    axes.barh(range(len(tests)), shares, color=[BLUE if test.passed else ORANGE for test in tests], height=0.6)
    axes.axvline(1, color=GREY, linewidth=1)
    axes.set_yticks(range(len(tests)), [test.name for test in tests], fontsize="small")
    axes.set_xlabel("statistic / limit")
    axes.set_xlim(0, max(1.25, *(1.05 * share for share in shares)) if shares else 1.25)
    axes.spines[["top", "right"]].set_visible(False)
    return axes


def comparison(
    measured: npt.NDArray[np.float64],
    predicted: npt.NDArray[np.float64],
    *,
    dt: float | None = None,
    first: int = 0,
    samples: int = _SHOWN,
    output: str = "output",
    axes: Axes | None = None,
) -> Axes:
    """Measured and simulated output over time, `samples` of them from sample `first` on, with the fit over all samples."""
    axes = _calm(_axes(axes, figsize=(6.0, 3.0)))
    shown = slice(first, first + samples)
    time = np.arange(len(measured))[shown] * (dt or 1.0)
    valid = np.isfinite(measured)
    error = np.linalg.norm((measured - predicted)[valid]) / np.linalg.norm(measured[valid] - measured[valid].mean())
    axes.plot(time, measured[shown], color="#b0b0b0", linewidth=2.6, label="measured")
    axes.plot(time, predicted[shown], color=ORANGE, linewidth=1.0, label=f"free run, fit {100 * (1 - error):.1f} %")
    axes.set(xlabel="time / s" if dt else "sample", ylabel=output)
    axes.legend(frameon=False, fontsize="small", ncols=2, loc="lower left", bbox_to_anchor=(0, 1))
    return axes


def system(model: System, *, truth: Any = None) -> Figure:
    """All of it: the blocks in the signal's order, fresh data against the free run, and the residual's tests."""
    import matplotlib.pyplot as plt

    paths = [path for path in model.paths_ if path[1]]
    record = getattr(model, "_record", None)
    shown = None if record is None or model.predicted_ is None else (record[1], model.predicted_)
    heights = [1.35] * len(paths) + [1.0] * (1 if shown is None else 2)
    across = max([len(blocks) for _, blocks in paths], default=0)
    figure = plt.figure(figsize=(max(3.6 * across, 6.5), 2.4 * sum(heights) + 0.6))
    figure.set_layout_engine("constrained", w_pad=0.12, h_pad=0.06)
    parts = figure.subfigures(len(heights), 1, height_ratios=heights, squeeze=False)[:, 0]
    for (enters, blocks), part in zip(paths, parts, strict=False):
        for (name, block), place in zip(blocks, part.subfigures(1, len(blocks), squeeze=False)[0], strict=True):
            first = name == "nonlinearity" and blocks[0][0] == "nonlinearity"
            of = f" of {enters}" if len(paths) > 1 and first else ""
            entering = model.inputs_ if first and not of else [enters if first else "what enters it"]
            _block(place, name + of, block, entering, truth if name == "nonlinearity" else None)
    if shown is not None:
        measured, predicted = (values[model.fitted_ :] for values in shown)
        comparison(measured, predicted, dt=model.dt_, output=model.output_, axes=parts[-2].subplots())
    residual_tests(model.verdict_, axes=parts[-1].subplots())
    return figure


def _block(place: SubFigure, title: str, block: Block, inputs: Sequence[str], truth: Any) -> None:
    """One block with its title."""
    from flexure.results import LinearPart, Surface

    title = title[:1].upper() + title[1:].replace("_", " ")
    if isinstance(block, LinearPart):
        pair = place.subplots(2, 1, sharex=True)
        ax, _ = bode(block, axes=(pair[0], pair[1]))
        title += f", order {block.order}, delay {block.delay}"
    elif isinstance(block, Surface):
        ax = surface(block, inputs=inputs, axes=place.subplots())
    else:
        ax = nonlinearity(block, input=inputs[0], truth=truth, axes=place.subplots())
    ax.set_title(title, fontsize="medium", loc="left")
