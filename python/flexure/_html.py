"""The blocks of an identified system as HTML with SVG inside, for notebooks."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from flexure.results import Block, LinearPart, Nonlinearity, Surface

if TYPE_CHECKING:
    from flexure._system import System
    from flexure.joints import Joint, TwoLinkArm

Array = npt.NDArray[np.float64]

_WIDTH, _HEIGHT, _MARGIN = 190, 110, 6
# The heights of the plots of gain and phase, one above the other.
_HIGHER, _LOWER = 62, 48
_POINTS = 160
_SQUARES = 24
_BLUE, _ORANGE = (0x00, 0x72, 0xB2), (0xD5, 0x5E, 0x00)
_TITLES = {"narx": "NARX model", "multiple-inputs": "Model of several inputs", "joint-inputs": "Joint Hammerstein model"}
_WORDS = {"narx": "a polynomial of past outputs and inputs", "volterra": "a Volterra series of second order"}
_TEXT = "font-family:sans-serif;font-size:13px"
_STYLE = "border:1px solid #999;border-radius:4px;background:#fff;color:#222;padding:4px 8px"


def html(model: System) -> str:
    """The blocks in the signal's order, each with its curve or its gain, and the verdict."""
    arrow = '<span style="padding:0 8px;font-size:130%">&rarr;</span>'
    rows = []
    for enters, blocks in model.paths_:
        without_blocks = escape(_WORDS.get(model.structure_, ""))
        cells = arrow.join(_cell(name, block) for name, block in blocks) or f"<span>{without_blocks}</span>"
        rows.append(
            f'<div style="display:flex;align-items:center;flex-wrap:wrap;margin:6px 0"><i>{escape(enters)}</i>{arrow}{cells}{arrow}'
            f"<i>{escape(model.output_)}</i></div>"
        )
    if len(rows) > 1:
        rows.append(f"<div>{escape(model.output_)} is the sum of these.</div>")
    title = _TITLES.get(model.structure_) or "&#8209;".join(word.capitalize() for word in model.structure_.split("-")) + " model"
    colour = "#1a7f37" if model.verdict_.holds else "#b35900"
    warnings = "".join(f"<li>{escape(text)}</li>" for text in model.warnings_)
    return (
        f'<div style="{_TEXT}"><b>{title}</b>, fit on fresh data '
        f"{model.verdict_.fit_percent:.2f} %" + "".join(rows) + f'<div style="color:{colour};max-width:60em">'
        f"{escape(model.verdict_.text)}</div>" + (f'<ul style="margin:4px 0">{warnings}</ul>' if warnings else "") + "</div>"
    )


def joint_html(joint: Joint) -> str:
    """A joint's inertias, its curves with their bands, and what to know."""
    what = "Rigid axis" if joint.kind == "rigid" else "Flexible joint"
    return f'<div style="{_TEXT}"><b>{what}</b>{_joint(joint)}</div>'


def arm_html(arm: TwoLinkArm) -> str:
    """The inertias of an arm, and those and the curves of both joints."""
    constants = {"shoulder": arm.shoulder, "elbow": arm.elbow, "coupling": arm.coupling}
    values = ", ".join(f"{name} {value} kg m²" for name, value in constants.items())
    joints = "".join(f"<div><b>{name}</b>{_joint(joint)}</div>" for name, joint in zip(("Shoulder", "Elbow"), arm.joints, strict=True))
    return f'<div style="{_TEXT}"><b>Two-link arm</b>: {escape(values)}{joints}</div>'


def _joint(joint: Joint) -> str:
    position, torque = joint.units
    unit = "kg" if position == "m" else "kg m²"
    inertias = {"inertia": joint.inertia} if joint.motor_inertia is None else {"link's inertia": joint.inertia, "motor's inertia": joint.motor_inertia}
    values = ", ".join(f"{name} {value} {unit}" for name, value in inertias.items())
    curves = [("friction", joint.friction, f"{position}/s", joint.best_friction.name)]
    if joint.stiffness is not None:
        curves.append(("stiffness", joint.stiffness, position, joint.best_stiffness.name))
    cells = "".join(
        f'<div style="{_STYLE};margin-right:8px"><div>{name}: {escape(form.replace("_", " "))}</div>{_curve(curve)}'
        f'<div style="color:#666;font-size:11px">{_range(curve.x)} {across}<br/>onto {_range(curve.y)} {torque}</div></div>'
        for name, curve, across, form in curves
    )
    findings = "".join(f"<li>{escape(text)}</li>" for text in joint.findings)
    listed = f'<ul style="margin:4px 0">{findings}</ul>' if findings else ""
    return f': {escape(values)}<div style="display:flex;flex-wrap:wrap;margin:6px 0">{cells}</div>{listed}'


def _cell(name: str, block: Block) -> str:
    if isinstance(block, Surface):
        drawing, caption = _map(block), " by ".join(str(pieces) for *_, pieces in block.axes) + " pieces"
    elif isinstance(block, Nonlinearity):
        drawing, caption = _curve(block), f"{_range(block.x)}\nonto {_range(block.y)}"
    else:
        drawing, ranges = _bode(block)
        caption = f"order {block.order}, delay {block.delay}, gain {block.static_gain:.3g}\n{ranges}"
    label, lines = escape(name.replace("_", " ")), escape(caption).replace("\n", "<br/>")
    return f'<div style="{_STYLE}"><div>{label}</div>{drawing}<div style="color:#666;font-size:11px">{lines}</div></div>'


def _range(values: Array) -> str:
    return f"{values.min():.3g} to {values.max():.3g}"


def _map(block: Surface) -> str:
    """The values over the first input (across) and the second (up), blue where low and orange where high."""
    if len(block.axes) < 2:
        return ""
    _, values = block.grid(_SQUARES)
    low, high = float(values.min()), float(values.max())
    share = (values - low) / (high - low or 1)
    wide, tall = (_WIDTH - 2 * _MARGIN) / _SQUARES, (_HEIGHT - 2 * _MARGIN) / _SQUARES
    squares = []
    for i in range(_SQUARES):
        for j in range(_SQUARES):
            colour = "#" + "".join(f"{round(_colour(share[i, j], k)):02x}" for k in range(3))
            x, y = _MARGIN + i * wide, _HEIGHT - _MARGIN - (j + 1) * tall
            squares.append(f'<rect x="{x:.1f}" y="{y:.1f}" width="{wide + 0.3:.1f}" height="{tall + 0.3:.1f}" fill="{colour}"/>')
    return (
        f'<svg width="{_WIDTH}" height="{_HEIGHT}" viewBox="0 0 {_WIDTH} {_HEIGHT}" role="img" '
        f'aria-label="the nonlinearity of the inputs">{"".join(squares)}</svg>'
    )


def _colour(share: float, channel: int) -> float:
    """Between blue, white and orange."""
    ends = _BLUE if share < 0.5 else _ORANGE
    away = abs(2.0 * share - 1.0)
    return 255.0 + (ends[channel] - 255.0) * away


def _curve(block: Nonlinearity) -> str:
    x = np.linspace(block.x[0], block.x[-1], _POINTS)
    bands = [] if block.lower is None or block.upper is None else [block.lower, block.upper]
    edges = [np.interp(x, block.x, edge) for edge in bands]
    return _svg(x, block(x), edges, "the nonlinearity")


def _bode(block: LinearPart) -> tuple[str, str]:
    """Gain above phase over three decades of frequency, and their ranges as text."""
    highest = np.pi / (block.dt or 1.0)
    omega = np.logspace(np.log10(highest) - 3, np.log10(highest), _POINTS)
    response = block.frequency_response(omega)
    decibels = 20 * np.log10(np.maximum(np.abs(response), 1e-12))
    decibels = np.maximum(decibels, decibels.max() - 80)
    phase = np.degrees(np.unwrap(np.angle(response)))
    # From 0 on: no axis is drawn where the frequency is 1.
    across = np.log10(omega) - np.log10(omega[0])
    drawing = _svg(across, decibels, [], "the gain over frequency, dB; the line is 0 dB", _HIGHER)
    drawing += "<br/>" + _svg(across, phase, [], "the phase over frequency; the line is 0", _LOWER)
    end = f"{highest / (2 * np.pi):.3g} Hz" if block.dt else "half a cycle a sample"
    return drawing, f"{_whole(decibels)} dB, {_whole(phase)}°\nup to {end}"


def _whole(values: Array) -> str:
    """From the highest to the lowest, in whole numbers."""
    highest, lowest = (round(float(v)) for v in (values.max(), values.min()))
    return f"{highest} to {lowest}"


def _svg(x: Array, y: Array, edges: list[Array], what: str, height: int = _HEIGHT) -> str:
    low, high = min(v.min() for v in (y, *edges)), max(v.max() for v in (y, *edges))
    across = _MARGIN + (x - x[0]) / (x[-1] - x[0] or 1) * (_WIDTH - 2 * _MARGIN)

    def path(values: Array) -> str:
        down = height - _MARGIN - (values - low) / (high - low or 1) * (height - 2 * _MARGIN)
        return " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(across, down, strict=True))

    # The axes, where they are within.
    lines = [f"M0,{at:.1f}H{_WIDTH}" for at in (height - _MARGIN + low / (high - low or 1) * (height - 2 * _MARGIN),) if low < 0 < high]
    lines += [f"M{np.interp(0.0, x, across):.1f},0V{height}"] if x[0] < 0 < x[-1] else []
    band = f'<path d="{" ".join(lines)}" stroke="#ddd" fill="none"/>'
    if edges:
        back = " ".join(reversed(path(edges[1]).split()))
        band += f'<polygon points="{path(edges[0])} {back}" fill="#0072b2" fill-opacity="0.2"/>'
    return (
        f'<svg width="{_WIDTH}" height="{height}" viewBox="0 0 {_WIDTH} {height}" role="img" aria-label="{escape(what)}">'
        f'{band}<polyline points="{path(y)}" fill="none" stroke="#0072b2" stroke-width="1.5"/></svg>'
    )
