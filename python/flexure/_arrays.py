"""Whatever holds samples as one contiguous array of float64."""

from __future__ import annotations

import operator
from typing import Any

import numpy as np
import numpy.typing as npt

from flexure._core import DataError, ParameterError

Array = npt.NDArray[np.float64]


def samples(values: Any, name: str) -> Array:
    """The samples of one signal: shape (n,), contiguous, float64; the same memory where it is that already.

    Takes arrays of any real dtype and layout, of shape (n,) or (n, 1), sequences of numbers, and everything else that NumPy takes.
    Masked and missing values become NaN.

    Raises
    ------
    TypeError
        For complex numbers, text and instants.
    DataError
        For any other shape.
    """
    if isinstance(values, np.ma.MaskedArray):
        values = np.ma.filled(values.astype(np.float64), np.nan)
    elif hasattr(values, "to_numpy") and not isinstance(values, np.ndarray):
        values = values.to_numpy()
    try:
        array = np.asarray(values)
    except ValueError as error:
        raise DataError(f"'{name}' is no sequence of numbers: {error}") from None
    if array.dtype.kind == "O":
        array = _numbers(array, name)
    if array.dtype.kind not in "biuf":
        what = {"c": "complex numbers", "U": "text", "S": "text", "M": "instants", "m": "durations"}
        raise TypeError(f"'{name}' holds {what.get(array.dtype.kind, str(array.dtype))}, but real numbers are needed")
    if array.ndim == 2 and array.shape[1] == 1:
        array = array[:, 0]
    if array.ndim != 1:
        raise DataError(f"'{name}' has the shape {array.shape}, but one signal has the shape (n,)")
    with np.errstate(over="ignore"):  # to infinity, which is said with its sample
        return plain(array)


def plain(array: Any) -> Array:
    """The numbers one after the other as the processor has them: arrays out of files and messages may lie across its words."""
    return np.require(array, np.dtype("=f8"), ["C", "A"])


def whole(value: Any, name: str, least: int = 0) -> int:
    """A whole number from `least` that the library can count to."""
    try:
        number = operator.index(value)
    except TypeError:
        number = -1
    if not least <= number < 2**53:
        raise ParameterError(f"{name} is {value!r}, but must be a whole number from {least}")
    return number


def finite_number(value: Any, name: str) -> float:
    """A finite number."""
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = np.nan
    if not np.isfinite(number) or isinstance(value, str):
        raise ParameterError(f"{name} is {value!r}, but must be a finite number")
    return number


def _numbers(array: npt.NDArray[Any], name: str) -> Array:
    """An array of objects that are numbers, or None or pandas' missing value."""
    flat = [np.nan if value is None or type(value).__name__ == "NAType" else value for value in array.ravel()]
    if any(isinstance(value, str | bytes | complex) for value in flat):
        raise TypeError(f"'{name}' holds text or complex numbers, but real numbers are needed")
    try:
        return np.array([float(value) for value in flat]).reshape(array.shape)
    except (TypeError, ValueError):
        raise TypeError(f"'{name}' holds {type(flat[0]).__name__} objects, but real numbers are needed") from None
