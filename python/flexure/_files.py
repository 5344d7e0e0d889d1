"""Model files: their blocks by the names that they have in a result."""

from __future__ import annotations

from typing import Any


def _is_offset(curve: dict[str, Any]) -> bool:
    """Whether a static block only adds a number, as the last one of a model with an offset does."""
    return bool(curve["x"] == [0.0, 1.0] and curve["outside"] == "linear" and curve["y"][1] == 1.0 + curve["y"][0])


def blocks_of(file: dict[str, Any]) -> dict[str, Any]:
    """The blocks of a model file by the names that they have in a result; of parallel branches the first."""

    def walk(block: dict[str, Any]) -> list[tuple[str, dict[str, Any]]]:
        kind, value = next(iter(block.items()))
        if kind == "series":
            return [found for part in value for found in walk(part)]
        return walk(value[0]) if kind == "parallel" else [(kind, value)]

    found = walk(file["block"])
    curves = [value for kind, value in found if kind == "static" and not _is_offset(value)]
    linear = [value for kind, value in found if kind == "linear"]
    told = file["identification"]
    breakpoints = told.get("input_breakpoints", told.get("breakpoints", ()))
    named: dict[str, Any] = {}
    for name, curve, at in zip(
        ("nonlinearity", "output_nonlinearity"), curves, (breakpoints, told.get("output_breakpoints", ())), strict=False
    ):
        named[name] = {**curve, "breakpoints": at}
    names = ("linear",) if len(linear) == 1 else ("front", "back")
    errors = told.get("linear") or {}
    named.update({name: {**errors, **value} for name, value in zip(names, linear, strict=False)})
    return named
