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
