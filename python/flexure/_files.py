"""Model files: their blocks by the names that they have in a result."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np


def _is_offset(curve: dict[str, Any]) -> bool:
    """Whether a static block only adds a number, as the last one of a model with an offset does."""
    return bool(curve["x"] == [0.0, 1.0] and curve["outside"] == "linear" and curve["y"][1] == 1.0 + curve["y"][0])


def _walk(block: dict[str, Any]) -> list[tuple[str, Any]]:
    """The kinds and contents of the blocks in cascade."""
    kind, value = next(iter(block.items()))
    return [found for part in value for found in _walk(part)] if kind == "series" else [(kind, value)]


def blocks_of(file: dict[str, Any]) -> dict[str, Any]:
    """What a result has of the blocks, out of a model file."""
    told = file["identification"]
    cascade = _walk(file["block"])
    for kind, value in cascade:
        if kind in ("parallel", "inputs"):
            names = told.get("inputs", ())
            kinks = told.get("kinks") or [()] * len(value)
            each = zip(value, told["breakpoints"], kinks, strict=True)
            own = [_cascade(_walk(branch), [at], [bent]) for branch, at, bent in each]
            return {"branches": [{**branch, **({"input": names[i]} if names else {})} for i, branch in enumerate(own)]}
        if kind == "surface":
            return {**_cascade([part for part in cascade if part[0] == "linear"]), "nonlinearity": value}
        if kind == "narx":
            return {"past_outputs": value["outputs"], "past_inputs": value["inputs"], **value}
        if kind == "volterra":
            return {**value, "second": np.reshape(value["second"], (value["second_memory"], -1)).tolist()}
    breakpoints = told.get("input_breakpoints", told.get("breakpoints", ()))
    kinks = told.get("input_kinks", told.get("kinks", ()))
    found = _cascade(
        cascade,
        [breakpoints, told.get("output_breakpoints", ())],
        [kinks, told.get("output_kinks", ())],
    )
    errors = told.get("linear") or {}
    return {name: {**errors, **value} if name in ("linear", "front", "back") else value for name, value in found.items()}


def _cascade(
    blocks: list[tuple[str, Any]], breakpoints: Sequence[Any] = (), kinks: Sequence[Any] = ()
) -> dict[str, Any]:
    """A cascade's blocks by name."""
    curves = [value for kind, value in blocks if kind == "static" and not _is_offset(value)]
    linear = [value for kind, value in blocks if kind == "linear"]
    named: dict[str, Any] = {}
    for name, curve, at, bent in zip(("nonlinearity", "output_nonlinearity"), curves, breakpoints, kinks, strict=False):
        named[name] = {**curve, "breakpoints": at, "kinks": bent}
    named.update(zip(("linear",) if len(linear) == 1 else ("front", "back"), linear, strict=False))
    return named
