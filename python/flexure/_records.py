"""Records of whatever kind as named signals of one sample time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from flexure._arrays import Array, samples
from flexure._core import DataError, ParameterError, sample_time

# The relative difference of two sample times that counts as none (printed digits).
_SAME = 1e-3


@dataclass
class Signals:
    """The input and the output of one experiment."""

    u: Array
    y: Array
    names: tuple[str, str]
    dt: float | None


def signals(u: Any, y: Any, dt: float | None, input: str | None, output: str | None) -> Signals:
    """Input and output out of two arrays or series, or out of the columns of one table.

    A table is anything with columns by name: a pandas or polars frame, an xarray data set, a dict of arrays; or python-control's
    ``TimeResponseData``. The sample time comes from `dt`, from the index of a pandas object or the coordinate of an xarray one
    where that is time, or from a column ``t``.
    """
    if y is None:
        u, y, told, input, output = _columns(u, input, output)
    else:
        told = _time(u)
        told = _time(y) if told is None else told
    names = (input or _name(u) or "u", output or _name(y) or "y")
    if names[0] == names[1]:
        names = ("u", "y")
    step = None if told is None or len(told) < 2 else sample_time(np.ascontiguousarray(told, dtype=np.float64))
    if dt is not None and step is not None and abs(step - dt) > _SAME * step:
        raise DataError(f"the record's sample time is {step:g} s, but dt is {dt:g} s; leave dt out, or correct the times")
    signal = Signals(samples(u, names[0]), samples(y, names[1]), names, dt if dt is not None else step)
    if len(signal.u) != len(signal.y):
        raise DataError(
            f"'{names[1]}' has {len(signal.y)} samples where {len(signal.u)} were expected; input and output must have the "
            "same length"
        )
    return signal


def input_signal(u: Any, name: str) -> Array:
    """The input out of an array or a series, or the column of this name out of a table."""
    return samples(_take(u, name) if _is_table(u) else u, name)


def is_several(u: Any) -> bool:
    """Whether `u` is a list of experiments rather than one."""
    return isinstance(u, list | tuple) and len(u) > 0 and all(np.ndim(part) > 0 or _is_table(part) for part in u)


def _is_table(data: Any) -> bool:
    if isinstance(data, dict):
        return True
    return hasattr(data, "columns") or hasattr(data, "data_vars") or _is_response(data)


def _is_response(data: Any) -> bool:
    return all(hasattr(data, name) for name in ("time", "outputs", "inputs", "output_labels"))


def _columns(data: Any, input: str | None, output: str | None) -> tuple[Any, Any, Any, str, str]:
    """Input and output of a table, its instants, and the names of both."""
    if not _is_table(data):
        raise DataError("there is no output: give u and y, or a table with the names of its columns as input and output")
    if _is_response(data):
        input, u = _labelled(data, "input", input)
        output, y = _labelled(data, "output", output)
        return u, y, np.asarray(data.time), input, output
    if input is None or output is None:
        raise ParameterError("name the table's columns: fit(table, input='...', output='...')")
    u, y = _take(data, input), _take(data, output)
    told = _time(u)
    if told is None and "t" in _names(data) and "t" not in (input, output):
        told = samples(_take(data, "t"), "t")
    return u, y, told, input, output


def _labelled(response: Any, what: str, name: str | None) -> tuple[str, Any]:
    """The label and the samples of an input or output of python-control's response: the one named, or the only one."""
    values, labels = getattr(response, f"{what}s"), list(getattr(response, f"{what}_labels") or ())
    if values is None:
        raise DataError(f"the response has no {what}s; simulate it with control.forced_response")
    if name is None and len(labels) > 1:
        raise ParameterError(f"the response has the {what}s {', '.join(labels)}; name one by {what}=")
    if name is not None and name not in labels:
        raise DataError(f"no {what} '{name}'; the {what}s are: {', '.join(labels)}")
    values = np.asarray(values)
    place = 0 if name is None else labels.index(name)
    return labels[place], values.reshape(-1, values.shape[-1])[place]


def _names(data: Any) -> list[str]:
    if isinstance(data, dict):
        return [str(name) for name in data]
    return [str(name) for name in (data.columns if hasattr(data, "columns") else data.data_vars)]


def _take(data: Any, name: str) -> Any:
    if _is_response(data):
        return _labelled(data, "input", name)[1]
    if name not in _names(data):
        raise DataError(f"no column '{name}'; the columns are: {', '.join(_names(data))}")
    return data[name]


def _name(values: Any) -> str | None:
    name = getattr(values, "name", None)
    return name if isinstance(name, str) and name else None


def _time(values: Any) -> Any:
    """The instants that belong to a series: a pandas index or an xarray coordinate, where that is time."""
    index = getattr(values, "index", None)
    if index is None or callable(index):
        coordinates = getattr(values, "coords", None)
        if coordinates is None or getattr(values, "ndim", 0) != 1 or values.dims[0] not in coordinates:
            return None
        index, name = np.asarray(coordinates[values.dims[0]]), values.dims[0]
    else:
        index, name = np.asarray(index), getattr(index, "name", None)
    if index.dtype.kind in "mM":
        return (index - index[0]) / np.timedelta64(1, "s") if len(index) else None
    return index.astype(np.float64) if name in ("t", "time") and index.dtype.kind in "fiu" else None
