"""Model files: their blocks by the names that they have in a result."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np


def _leaves(block: dict[str, Any]) -> Iterator[tuple[str, Any]]:
    """The kinds and contents of the blocks that have names, in their order in the model."""
    kind, value = next(iter(block.items()))
    if kind in ("series", "parallel", "inputs"):
        for part in value:
            yield from _leaves(part)
    elif kind != "offset":
        yield kind, value


def blocks_of(file: dict[str, Any]) -> dict[str, Any]:
    """What a result has of the blocks, out of a model file."""
    leaves = _leaves(file["block"])
    paths = []
    for path in file["paths"]:
        blocks: dict[str, Any] = {}
        for label, (kind, value) in zip(path["blocks"], leaves, strict=False):
            blocks.update(_named(label, kind, value))
        paths.append({**blocks, "input": ",".join(path["inputs"])})
    if file["is_sum"]:
        return {"branches": paths}
    found = paths[0] if paths else {}
    found.pop("input", None)
    return found


def _named(label: dict[str, Any], kind: str, value: Any) -> dict[str, Any]:
    """A block under its role; a model without blocks by its own names."""
    if kind == "narx":
        return {"past_outputs": value["outputs"], "past_inputs": value["inputs"], **value}
    if kind == "volterra":
        return {**value, "second": np.reshape(value["second"], (value["second_memory"], -1)).tolist()}
    if kind == "feedback":
        loop = {name: part for name, part in value.items() if name != "nonlinearity"}
        return {**_named(label, "static", value["nonlinearity"]), **_ways(loop), "state_space": loop}
    return {label["role"]: {**value, **{name: known for name, known in label.items() if name != "role"}}}


def _ways(loop: dict[str, Any]) -> dict[str, Any]:
    """The transfer functions of a loop's linear part, by where they come from and where they lead."""
    state = np.array(loop["state"])
    denominator = np.poly(state)

    def way(source: str, target: str, direct: float) -> dict[str, Any]:
        product = np.outer(loop[f"{source}_to_state"], loop[f"state_to_{target}"])
        numerator = np.poly(state - product) + (direct - 1) * denominator
        return {"b": numerator.tolist(), "a": denominator.tolist()}

    return {
        "input_to_output": way("input", "output", loop["input_to_output"]),
        "nonlinearity_to_output": way("nonlinearity", "output", loop["nonlinearity_to_output"]),
        "input_to_nonlinearity": way("input", "nonlinearity", loop["input_to_nonlinearity"]),
        "around": way("nonlinearity", "nonlinearity", 0.0),
    }
