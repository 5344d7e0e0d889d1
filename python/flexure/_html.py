"""The blocks of an identified system as HTML with SVG inside, for notebooks."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from flexure.results import LinearPart, Nonlinearity

if TYPE_CHECKING:
    from flexure.systems import System

Array = npt.NDArray[np.float64]

_WIDTH, _HEIGHT, _MARGIN = 190, 110, 6
_POINTS = 160
_STYLE = "border:1px solid #999;border-radius:4px;background:#fff;color:#222;padding:4px 8px"


def html(model: System) -> str:
    """The blocks in the signal's order, each with its curve or its gain, and the verdict."""
    arrow = '<span style="padding:0 8px;font-size:130%">&rarr;</span>'
    cells = arrow.join(_cell(name, block) for name, block in model.blocks_)
    title = "&#8209;".join(word.capitalize() for word in model.structure_.split("-")) + " model"
    colour = "#1a7f37" if model.verdict_.holds else "#b35900"
    warnings = "".join(f"<li>{escape(text)}</li>" for text in model.warnings_)
    return (
        f'<div style="font-family:sans-serif;font-size:13px"><b>{title}</b>, fit on fresh data '
        f"{model.verdict_.fit_percent:.2f} %"
        f'<div style="display:flex;align-items:center;flex-wrap:wrap;margin:6px 0">'
        f"<i>{escape(model.input_)}</i>{arrow}{cells}{arrow}<i>{escape(model.output_)}</i></div>"
        f'<div style="color:{colour};max-width:60em">{escape(model.verdict_.words)}</div>'
        + (f'<ul style="margin:4px 0">{warnings}</ul>' if warnings else "")
        + "</div>"
    )


def _cell(name: str, block: Nonlinearity | LinearPart) -> str:
    if isinstance(block, Nonlinearity):
        drawing, words = _curve(block), f"{block.x[0]:.3g} to {block.x[-1]:.3g}"
    else:
        drawing, words = _gain(block), f"order {block.order}, delay {block.delay}, gain {block.static_gain:.3g}"
    label = escape(name.replace("_", " "))
    return f'<div style="{_STYLE}"><div>{label}</div>{drawing}<div style="color:#666">{escape(words)}</div></div>'


def _curve(block: Nonlinearity) -> str:
    x = np.linspace(block.x[0], block.x[-1], _POINTS)
    bands = [] if block.lower is None or block.upper is None else [block.lower, block.upper]
    edges = [np.interp(x, block.x, edge) for edge in bands]
    return _svg(x, block(x), edges, "the nonlinearity")


def _gain(block: LinearPart) -> str:
    highest = np.pi / (block.dt or 1.0)
    omega = np.logspace(np.log10(highest) - 3, np.log10(highest), _POINTS)
    decibels = 20 * np.log10(np.maximum(np.abs(block.frequency_response(omega)), 1e-12))
    return _svg(np.log10(omega), np.maximum(decibels, decibels.max() - 80), [], "the gain over frequency, dB")


def _svg(x: Array, y: Array, edges: list[Array], what: str) -> str:
    low, high = min(v.min() for v in (y, *edges)), max(v.max() for v in (y, *edges))
    across = _MARGIN + (x - x[0]) / (x[-1] - x[0] or 1) * (_WIDTH - 2 * _MARGIN)

    def path(values: Array) -> str:
        down = _HEIGHT - _MARGIN - (values - low) / (high - low or 1) * (_HEIGHT - 2 * _MARGIN)
        return " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(across, down, strict=True))

    band = ""
    if edges:
        back = " ".join(reversed(path(edges[1]).split()))
        band = f'<polygon points="{path(edges[0])} {back}" fill="#0072b2" fill-opacity="0.2"/>'
    return (
        f'<svg width="{_WIDTH}" height="{_HEIGHT}" viewBox="0 0 {_WIDTH} {_HEIGHT}" role="img" aria-label="{escape(what)}">'
        f'{band}<polyline points="{path(y)}" fill="none" stroke="#0072b2" stroke-width="1.5"/></svg>'
    )
