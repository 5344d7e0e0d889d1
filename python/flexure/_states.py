"""States of chains, poses of their bases and gravity, checked."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from flexure._arrays import finite_number, samples
from flexure._core import DataError, ParameterError

Array = npt.NDArray[np.float64]


def vector(values: Any, name: str, width: int) -> Array:
    """One state's values."""
    array = np.asarray(values)
    if array.shape != (width,):
        raise DataError(f"'{name}' has the shape {array.shape}, but must have ({width},)")
    return samples(array, name)


def vectors(values: Any, name: str, width: int) -> Array:
    """The values of one state, or of those of several runs in the first axis."""
    array = np.asarray(values)
    if array.ndim != 2 or array.shape[1] != width or not len(array):
        return vector(array, name, width)
    return samples(array.reshape(-1), name).reshape(-1, width)


def starts(parts: Sequence[Array], torque: Any) -> tuple[int | None, Array]:
    """The number of runs, if any part of the state or the torques have them, and the states at the start, shape (runs, values)."""
    counts = {len(part) for part in parts if part.ndim == 2}
    if torque is not None and torque.ndim == 3:
        counts.add(len(torque))
    if len(counts) > 1 or 0 in counts:
        raise DataError(f"the arrays have {' and '.join(map(str, sorted(counts)))} runs in the first axis, but must have one number of runs")
    runs = counts.pop() if counts else None
    return runs, np.concatenate([np.broadcast_to(part, (runs or 1, part.shape[-1])) for part in parts], axis=1)


def torques(torque: Any, driven: Sequence[str], instants: int, runs: int | None) -> list[Array]:
    """A column a driven joint, one run after the other."""
    joints = len(driven)
    if torque.shape == (joints,):
        torque = np.broadcast_to(torque, (instants, joints))
    if torque.ndim not in (2, 3) or torque.shape[-1] != joints:
        raise DataError(f"'torque' has the shape {torque.shape}, but this chain needs ({joints},), (instants, {joints}) or (runs, instants, {joints})")
    torque = np.broadcast_to(torque, (runs or 1, *torque.shape[-2:]))
    return [samples(torque[..., i].reshape(-1), f"tau_{name}") for i, name in enumerate(driven)]


def poses(base: Any, instants: int) -> Array:
    """The poses of a base, one after the other."""
    if base.shape != (instants, 7):
        raise DataError(f"'base' has the shape {base.shape}, but this run needs ({instants}, 7)")
    return samples(base.reshape(-1), "base")


def gravity_vector(values: Sequence[float]) -> tuple[float, float, float]:
    numbers = [finite_number(value, "gravity") for value in values]
    if len(numbers) != 3:
        raise ParameterError(f"gravity has {len(numbers)} values, but must have 3: an acceleration in x, y and z")
    x, y, z = numbers
    return x, y, z
