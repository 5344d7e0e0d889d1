"""Instants that come with signals: indexes, coordinates and time columns."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import numpy.typing as npt

from flexure._arrays import Array, samples
from flexure._core import DataError, ParameterError, sample_time

# The relative difference of two sample times that counts as none (printed digits).
_SAME = 1e-3
# Names of columns, coordinates and indexes that hold seconds: t, time, with or without the unit.
_TIME = re.compile(r"(t|time)\s*([\[(/_]?\s*(s|sec|seconds)\s*[\])]?)?", re.IGNORECASE)


def is_time(name: Any) -> bool:
    """Whether a name says that seconds or instants are behind it."""
    return isinstance(name, str) and _TIME.fullmatch(name.strip()) is not None


def instants_of(values: Any) -> npt.NDArray[Any] | None:
    """The instants that belong to a series: a pandas index or an xarray coordinate, where that is time.

    That is one of instants, periods or durations, one of numbers with the name of time, and in pandas one of floating-point numbers
    without a name.
    """
    index = getattr(values, "index", None)
    if index is not None and not callable(index):
        given, name = index, getattr(index, "name", None)
        unnamed = name is None
    else:
        coordinates = getattr(values, "coords", None)
        if coordinates is None or getattr(values, "ndim", 0) != 1 or values.dims[0] not in coordinates:
            return None
        name, unnamed = values.dims[0], False
        given = coordinates[name]
    times = instants(given)
    if times is not None and (times.dtype.kind in "mM" or is_time(name) or (unnamed and times.dtype.kind == "f")):
        return times
    return None


def instants(values: Any) -> npt.NDArray[Any] | None:
    """Instants, durations or numbers as an array of one of these kinds; None for anything else."""
    kind = str(getattr(values, "dtype", ""))
    if kind.startswith("period"):
        values = values.dt.to_timestamp() if hasattr(values, "dt") else values.to_timestamp()
    if kind.startswith(("period", "datetime64", "timestamp")):  # also with a time zone, which NumPy does not have
        return np.asarray(values, dtype="datetime64[ns]")
    array = np.asarray(values.to_numpy() if hasattr(values, "to_numpy") else values)
    if array.dtype.kind == "O" and array.size and hasattr(array.flat[0], "isoformat"):
        array = array.astype("datetime64[us]")
    return array if array.dtype.kind in "mMfiu" and array.ndim == 1 else None


def step_of(times: npt.NDArray[Any] | None) -> float | None:
    """The sample time in s of uniform instants; None where there are too few.

    Raises
    ------
    DataError
        For instants that are not uniform, with the sample.
    """
    if times is None or len(times) < 2:
        return None
    return sample_time(seconds(times, times[0]))


def column_of_time(values: Any, name: str) -> npt.NDArray[Any]:
    """The instants of a column that has the name of time."""
    times = instants(values)
    return samples(values, name) if times is None else times


def given_step(dt: Any) -> float | None:
    """The sample time that a user gives, s."""
    if dt is None:
        return None
    try:
        step = float(dt)
    except (TypeError, ValueError):
        step = np.nan
    if not (0 < step < np.inf) or isinstance(dt, str):
        raise ParameterError(f"dt is {dt!r}, but must be positive and finite, in s")
    return step


def check_same_instants(first: npt.NDArray[Any] | None, second: npt.NDArray[Any] | None, name: str) -> None:
    """Two signals of one length whose instants are known must have the same ones.

    Raises
    ------
    DataError
        Where they have not.
    """
    if first is None or second is None or len(first) != len(second) or len(first) < 2 or first.dtype.kind != second.dtype.kind:
        return
    one, other = seconds(first, first[0]), seconds(second, first[0])
    apart = np.flatnonzero(np.abs(one - other) > _SAME * np.abs(one[-1] - one[0]) / (len(one) - 1))
    if len(apart):
        raise DataError(
            f"'{name}' is {other[apart[0]] - one[apart[0]]:g} s away from the input at sample {apart[0]}; align both to the same times first"
        )


def check_same_step(step: float | None, other: float | None, message: str) -> None:
    """Two sample times that are both known must be the same; `message` has places for both.

    Raises
    ------
    DataError
        Where they are not.
    """
    if step is not None and other is not None and abs(step - other) > _SAME * step:
        raise DataError(message.format(step, other))


def seconds(times: npt.NDArray[Any], origin: Any) -> Array:
    """Instants as seconds since one of them, numbers as they are."""
    if times.dtype.kind in "mM":
        return np.asarray((times - origin) / np.timedelta64(1, "s"), dtype=np.float64)
    return np.ascontiguousarray(times, dtype=np.float64)
