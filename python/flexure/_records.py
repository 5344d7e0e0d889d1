"""Records of any kind as named signals of one sample time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from flexure import _times as times
from flexure._arrays import Array, samples
from flexure._core import DataError, ParameterError


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
    where that is time, or from a column of that name; inputs and output must be at the same instants.
    """
    given, dt, u, y = _given(input, several), times.given_step(dt), plain(u), plain(y)
    if y is None:
        parts, y, instants, inputs, output = _columns(u, given, output)
    else:
        parts, inputs = _parts(u, given, several)
        instants = times.instants_of(u)
        output = output or _name(y) or "y"
        if inputs == [output]:
            inputs, output = ["u"], "y"
    own = times.instants_of(y)
    step = times.step_of(own if instants is None else instants)
    times.check_same_instants(instants, own, output)
    times.check_same_step(step, dt, "the record's sample time is {:g} s, but dt is {:g} s; leave dt out, or correct the times")
    columns = [samples(part, name) for part, name in zip(parts, inputs, strict=True)]
    signal = Signals(columns, samples(y, output), inputs, output, dt if dt is not None else step)
    for name, column in zip([*inputs[1:], output], [*columns[1:], signal.y], strict=True):
        if len(column) != len(columns[0]):
            raise DataError(
                f"'{name}' has {len(column)} samples where {len(columns[0])} were expected; inputs and output must have the same length"
            )
    return signal


def input_signals(u: Any, names: Sequence[str], several: bool, dt: float | None = None) -> list[Array]:
    """The inputs out of arrays or series, or the columns of these names out of a table; sampled as the model is."""
    u = plain(u)
    parts = [_take(u, name) for name in names] if _is_table(u) else _parts(u, None, several)[0]
    instants = times.instants_of(u)
    if instants is None and _is_table(u) and not _is_response(u):
        instants = _instants_within(u, parts[0], names)
    if dt is not None and instants is not None:
        check_sampled_as(dt, times.step_of(instants))
    if len(parts) != len(names):
        raise DataError(f"the model has the {len(names)} inputs {', '.join(names)}, but {len(parts)} were given")
    return [samples(part, name) for part, name in zip(parts, names, strict=True)]


def named_columns(data: Any, names: dict[str, Any]) -> tuple[dict[str, Any], Any]:
    """The columns of a table by what they are, where each is one name, a list of names or None; and the table's instants."""
    data = plain(data)
    if not _is_table(data):
        raise DataError("data is no table with columns by name")
    found: dict[str, Any] = {}
    for what, name in names.items():
        if isinstance(name, list | tuple):
            found[what] = np.column_stack([samples(_take(data, str(each)), str(each)) for each in name])
        else:
            found[what] = None if name is None else _take(data, str(name))
    first = next(name for name in names.values() if name is not None)
    column = _take(data, str(first[0] if isinstance(first, list | tuple) else first))
    return found, _instants_within(data, column, [])


def check_sampled_as(model: float | None, record: float | None) -> None:
    """A record whose sample time is known must have the model's."""
    message = "the model's sample time is {:g} s, but the record's is {:g} s; resample the record, or identify a model at its sample time"
    times.check_same_step(model, record, message)


def check_same_times(u: Any, y: Any, output: str) -> None:
    """Series of input and output whose instants are known must have the same ones."""
    times.check_same_instants(times.instants_of(u), times.instants_of(y), output)


def plain(data: Any) -> Any:
    """Tables of other kinds as what the others are: lazy frames collected, arrays with named fields as dicts."""
    if hasattr(data, "collect_schema") and hasattr(data, "collect"):
        return data.collect()
    if isinstance(data, np.ndarray) and data.dtype.names:
        return {name: data[name] for name in data.dtype.names}
    return data


def _given(input: str | Sequence[str] | None, several: bool) -> list[str] | None:
    """The names of the inputs, if they were given."""
    if input is None:
        return None
    names: Any = [*input] if several and isinstance(input, list | tuple) else [input]
    # Whole numbers name the columns of a pandas frame without a header.
    names = [str(name) if isinstance(name, int | np.integer) and not isinstance(name, bool) else name for name in names]
    if not names or not all(isinstance(name, str) and name for name in names) or (several and isinstance(input, str)):
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
        names = given or [name for name in _names(u) if not times.is_time(name)]
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


def has_several_inputs(u: Any, input: str | Sequence[str] | None) -> bool:
    """Whether more than one input is given, by names or as columns of an array."""
    if isinstance(input, list | tuple):
        return len(input) > 1
    shape: tuple[int, ...] = () if _is_table(u) or is_several(u) else np.shape(u)
    return input is None and len(shape) == 2 and shape[1] > 1


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
    output = str(output)
    parts, y = [_take(data, name) for name in given], _take(data, output)
    return parts, y, _instants_within(data, parts[0], (*given, output)), given, output


def _instants_within(data: Any, column: Any, used: Sequence[str]) -> Any:
    """The instants of a table: those of a column's index, or the column that has the name of time."""
    instants = times.instants_of(column)
    for name in _names(data):
        if instants is None and times.is_time(name) and name not in used:
            instants = times.column_of_time(_take(data, name), name)
    return instants


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


def _keys(data: Any) -> list[Any]:
    if isinstance(data, dict):
        return list(data)
    return list(data.columns if hasattr(data, "columns") else data.data_vars)


def _names(data: Any) -> list[str]:
    return [str(key) for key in _keys(data)]


def _take(data: Any, name: str) -> Any:
    if _is_response(data):
        return _labelled(data, "input", name)[1]
    keys = _keys(data)
    found = [key for key in keys if str(key) == name]
    if len(found) != 1:
        what = "no column" if not found else f"{len(found)} columns are called"
        raise DataError(f"{what} '{name}'; the columns are: {', '.join(map(str, keys))}")
    return data[found[0]]


def _name(values: Any) -> str | None:
    name = getattr(values, "name", None)
    return name if isinstance(name, str) and name else None
