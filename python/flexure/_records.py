"""Records of whatever kind as named signals of one sample time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from flexure._arrays import Array, samples
from flexure._core import DataError, ParameterError, sample_time

# The relative difference of two sample times that counts as none (printed digits).
_SAME = 1e-3


@dataclass
class Signals:
    """The inputs and the output of one experiment."""

    u: list[Array]
    y: Array
    inputs: list[str]
    output: str
    dt: float | None


def signals(
    u: Any, y: Any, dt: float | None, input: str | Sequence[str] | None, output: str | None, several: bool = False
) -> Signals:
    """Inputs and output out of two arrays or series, or out of the columns of one table; one input unless `several`.

    A table is anything with columns by name: a pandas or polars frame, an xarray data set, a dict of arrays; or python-control's
    ``TimeResponseData``. The sample time comes from `dt`, from the index of a pandas object or the coordinate of an xarray one
    where that is time, or from a column ``t``.
    """
    given = _given(input, several)
    if y is None:
        parts, y, told, inputs, output = _columns(u, given, output)
    else:
        parts, inputs = _parts(u, given, several)
        told = _time(u)
        told = _time(y) if told is None else told
        output = output or _name(y) or "y"
        if inputs == [output]:
            inputs, output = ["u"], "y"
    step = None if told is None or len(told) < 2 else sample_time(np.ascontiguousarray(told, dtype=np.float64))
    if dt is not None and step is not None and abs(step - dt) > _SAME * step:
        raise DataError(f"the record's sample time is {step:g} s, but dt is {dt:g} s; leave dt out, or correct the times")
    columns = [samples(part, name) for part, name in zip(parts, inputs, strict=True)]
    signal = Signals(columns, samples(y, output), inputs, output, dt if dt is not None else step)
    for name, column in zip([*inputs[1:], output], [*columns[1:], signal.y], strict=True):
        if len(column) != len(columns[0]):
            raise DataError(
                f"'{name}' has {len(column)} samples where {len(columns[0])} were expected; inputs and output must have the same length"
            )
    return signal


def input_signals(u: Any, names: Sequence[str], several: bool) -> list[Array]:
    """The inputs out of arrays or series, or the columns of these names out of a table."""
    parts = [_take(u, name) for name in names] if _is_table(u) else _parts(u, None, several)[0]
    if len(parts) != len(names):
        raise DataError(f"the model has the {len(names)} inputs {', '.join(names)}, but {len(parts)} were given")
    return [samples(part, name) for part, name in zip(parts, names, strict=True)]


def _given(input: str | Sequence[str] | None, several: bool) -> list[str] | None:
    """The names of the inputs, if they were given."""
    if input is None:
        return None
    names: Any = input if several else [input]
    if not isinstance(names, list | tuple) or not names or not all(isinstance(name, str) and name for name in names):
        needs = "several inputs: input=['...', '...']" if several else "one input: input='...'"
        raise ParameterError(f"the model has {needs}, not {input!r}")
    for name in names:
        if several and ("," in name or name != name.strip()):
            raise ParameterError(f"the input's name {name!r} must have no comma, and no spaces at its ends")
    return list(names)


def _parts(u: Any, given: list[str] | None, several: bool) -> tuple[list[Any], list[str]]:
    """The inputs one by one, out of the columns of a table or of an array of shape (n, m), and their names."""
    if not several:
        return [u], given or [_name(u) or "u"]
    if _is_table(u):
        names = given or [name for name in _names(u) if name != "t"]
        return [_take(u, name) for name in names], names
    array = np.asarray(u)
    if array.ndim == 1:
        array = array[:, np.newaxis]
    if array.ndim != 2 or not 0 < array.shape[1] <= array.shape[0]:
        raise DataError(f"the inputs have the shape {array.shape}, but m inputs of n samples have the shape (n, m)")
    names = given or [f"u{i + 1}" for i in range(array.shape[1])]
    if len(names) != array.shape[1]:
        raise ParameterError(f"there are {array.shape[1]} inputs, but {len(names)} names")
    return list(array.T), names


def is_several(u: Any) -> bool:
    """Whether `u` is a list of experiments rather than one."""
    return isinstance(u, list | tuple) and len(u) > 0 and all(np.ndim(part) > 0 or _is_table(part) for part in u)


def _is_table(data: Any) -> bool:
    if isinstance(data, dict):
        return True
    return hasattr(data, "columns") or hasattr(data, "data_vars") or _is_response(data)


def _is_response(data: Any) -> bool:
    return all(hasattr(data, name) for name in ("time", "outputs", "inputs", "output_labels"))


def _columns(data: Any, given: list[str] | None, output: str | None) -> tuple[list[Any], Any, Any, list[str], str]:
    """Inputs and output of a table, its instants, and the names of both."""
    if not _is_table(data):
        raise DataError("there is no output: give u and y, or a table with the names of its columns as input and output")
    if _is_response(data):
        wanted: list[str | None] = [*given] if given else [None]
        found = [_labelled(data, "input", name) for name in wanted]
        output, y = _labelled(data, "output", output)
        return [u for _, u in found], y, np.asarray(data.time), [name for name, _ in found], output
    if given is None or output is None:
        raise ParameterError("name the table's columns: fit(table, input='...', output='...')")
    parts, y = [_take(data, name) for name in given], _take(data, output)
    told = _time(parts[0])
    if told is None and "t" in _names(data) and "t" not in (*given, output):
        told = samples(_take(data, "t"), "t")
    return parts, y, told, given, output


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
