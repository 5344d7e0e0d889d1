"""Flexure on a cluster, by dask and distributed as they are: a fleet of machines, records of any length, many simulations.

``pip install flexure[dask]``. Without a client, the functions start a cluster on all cores of this machine and close it again. Results
are those of one machine, whatever the workers, and a worker that dies loses nothing: the cluster gives its tasks to another one.

=================  ===================================================================  ====================================
function           what                                                                 a task is
=================  ===================================================================  ====================================
`identify_fleet`   one model a machine, a table with a row a machine                    a machine
`identify`         a Hammerstein system from a record of any length, from merged sums   a chunk of the record, in every step
`regress`          kernel regression of a data frame or of arrays, from merged sums     a partition
`simulate_batch`   an arm under many torques                                            some torques
=================  ===================================================================  ====================================
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import flexure
from flexure._arrays import samples
from flexure._cluster import RETRIES, installed, merged, on_cluster, same_version
from flexure._core import DataError, ParameterError, Sharded, merged_sums
from flexure._shards import Shards

if TYPE_CHECKING:
    import numpy.typing as npt

    from flexure import Arm, Hammerstein, StreamedKernelRegressor

__all__ = ["identify", "identify_fleet", "regress", "simulate_batch"]

# What is in a folder of results beside the table, as `flexure fleet` has it.
BEGUN, ROWS, MODELS, TABLE = "fleet.json", "rows", "models", "table.parquet"
# Machines that wait on the cluster at most: a fleet's tasks need not all be known to the scheduler at once.
WAITING = 2000


def identify_fleet(
    dataset: str | os.PathLike[str] | Mapping[str, Any],
    *,
    by: str,
    model: Any,
    output: str | os.PathLike[str],
    client: Any = None,
    name: str = "",
) -> Path:
    """Identifies one model a machine, and writes a table with a row a machine and the models.

    Every machine is one task. A machine whose record cannot be used gets a row with its error, and the others go on. Results are kept as they come:
    a run that was stopped goes on where it was when it is called again with the same `by` and `name`; machines without a model are tried
    again. A worker that dies loses nothing: the cluster gives its task to another one. The numbers are those of one machine, whatever the workers.

    Parameters
    ----------
    dataset : path, or mapping of keys to records
        A folder with folders ``by=KEY`` of Parquet files, which the workers read; or records by key, each a table, or anything else that
        `model` takes.
    by : str
        What tells machines apart: the name in folders ``by=KEY``, and of the table's first column.
    model : estimator, or callable
        An estimator, such as ``flexure.Hammerstein()``, which takes the record's two signals as input and output; or a function of the
        record that returns a fitted estimator or a joint: ``lambda r: flexure.identify_joint(r["tau"], position=r["q"], dt=0.002)``.
    output : path
        The folder of the results: ``table.parquet`` and ``models/KEY.json``. Only this process writes to it.
    client : distributed.Client, optional
        The cluster. Its workers must have this version of Flexure.
    name : str
        Says what `model` is, so that results of another one are not taken up.

    Returns
    -------
    Path
        The table's.

    Raises
    ------
    ParameterError
        `dataset` has no machine, or `output` has results that were begun with another `by` or `name`, or by another version.
    FlexureError
        The workers have another version of Flexure, or none.

    Examples
    --------
    >>> import flexure, flexure.dask
    >>> def of_plant(record):
    ...     return flexure.Hammerstein().fit(record, input="u", output="y")
    >>> table = flexure.dask.identify_fleet("plants/", by="plant", model=of_plant, output="results")  # doctest: +SKIP
    """
    jobs = _machines(dataset, by)
    if not jobs:
        raise ParameterError(f"dataset has no machine: no folder is called {by}=KEY" if not isinstance(dataset, Mapping) else "dataset is empty")
    folder = Path(output)
    _open(folder, {"by": by, "name": name, "version": flexure.__version__})
    missing = {key: job for key, job in jobs.items() if (_row(folder, key) or {"status": "failed"})["status"] == "failed"}
    if missing:
        with on_cluster(client) as cluster:
            same_version(cluster)
            for key, row, text in _done(cluster, missing, model, by):
                _keep(folder, key, row, text)
    return _write_table(folder, [found for key in jobs if (found := _row(folder, key))])


def _machines(dataset: Any, by: str) -> dict[str, Any]:
    """The records by key, in the order of the keys."""
    if isinstance(dataset, Mapping):
        return {str(key): dataset[key] for key in dataset}
    root = Path(dataset)
    if not root.is_dir():
        raise ParameterError(f"dataset {root} is no folder; give one with folders {by}=KEY, or a mapping of keys to records")
    found: dict[str, list[str]] = {}
    for path in sorted(root.rglob("*.parquet")):
        keys = [part.partition("=")[2] for part in path.relative_to(root).parts if part.startswith(f"{by}=")]
        if keys:
            found.setdefault(keys[-1], []).append(str(path.resolve()))
    return dict(sorted(found.items()))


def _open(folder: Path, asked: dict[str, str]) -> None:
    begun = folder / BEGUN
    if begun.exists():
        if json.loads(begun.read_text()) != asked:
            raise ParameterError(f"output {folder} has results that were begun with other choices, or by another version; write to another folder")
        return
    if folder.exists() and any(folder.iterdir()):
        raise ParameterError(f"output {folder} has other files; write to a folder that is new or empty")
    for part in (ROWS, MODELS):
        (folder / part).mkdir(parents=True, exist_ok=True)
    begun.write_text(json.dumps(asked))


def _done(client: Any, jobs: dict[str, Any], model: Any, by: str) -> Iterator[tuple[str, dict[str, Any], str | None]]:
    """The machines' rows and models as they come, so many on the cluster at a time."""
    shared = client.scatter(model, broadcast=True) if not callable(model) else model
    waiting = iter(jobs.items())

    def submit(key: str, job: Any) -> Any:
        return client.submit(_one, key, job, shared, by, key=f"flexure-{by}-{key}-{os.urandom(4).hex()}", retries=RETRIES, pure=False)

    first = [submit(key, job) for _, (key, job) in zip(range(WAITING), waiting, strict=False)]
    running = installed("distributed").as_completed(first)
    for future in running:
        yield future.result()
        future.release()
        for key, job in waiting:
            running.add(submit(key, job))
            break


def _one(key: str, job: Any, model: Any, by: str) -> tuple[str, dict[str, Any], str | None]:
    """A machine's row, and its model's text."""
    row: dict[str, Any] = {by: key, "status": "done", "error": None}
    try:
        record = _read(job) if isinstance(job, list) else job
        found = model(record) if callable(model) else _clone(model).fit(record)
        if hasattr(found, "to_json"):
            text = found.to_json()
            row |= _of_system(found)
        else:
            text = json.dumps(found.result)
            row |= _single_values(found.result)
        return key, row, text
    except Exception as error:
        # Whatever is wrong with one record is no reason to lose the others.
        return key, {by: key, "status": "failed", "error": f"{type(error).__name__}: {error}"}, None


def _clone(estimator: Any) -> Any:
    from sklearn.base import clone

    return clone(estimator)


def _read(paths: list[str]) -> dict[str, Any]:
    """The columns of Parquet files one after the other."""
    from pyarrow import parquet

    tables = [parquet.ParquetFile(path).read() for path in paths]
    names = tables[0].column_names
    if any(table.column_names != names for table in tables):
        raise DataError(f"the files {', '.join(paths)} have different columns")

    return {name: np.concatenate([table[name].to_numpy() for table in tables]) for name in names}


def _of_system(model: Any) -> dict[str, Any]:
    verdict = model.verdict_
    values = {"structure": model.structure_, "order": getattr(model, "order_", None), "delay": getattr(model, "delay_", None)}
    for name in ("fit_percent", "rms", "r_squared", "misfit", "holds", "text"):
        values["verdict" if name == "text" else name] = getattr(verdict, name)
    return values | {"warnings": "; ".join(model.warnings_)}


def _single_values(found: dict[str, Any], prefix: str = "") -> dict[str, Any]:
    """Numbers, text and truth values, those of dicts inside with their names behind a dot."""
    row: dict[str, Any] = {}
    for name, value in found.items():
        if isinstance(value, dict):
            row |= _single_values(value, f"{prefix}{name}.")
        elif isinstance(value, (bool, int, float, str)):
            row[prefix + name] = value
    return row


def _file_name(key: str) -> str:
    """A key as a file's name, as `flexure fleet` has it."""
    plain = (c if c.isascii() and (c.isalnum() or c in "_-" or (c == "." and i)) else "".join(f"%{b:02X}" for b in c.encode()) for i, c in enumerate(key))
    return "".join(plain) + ".json"


def _keep(folder: Path, key: str, row: dict[str, Any], text: str | None) -> None:
    if text is not None:
        row["model"] = f"{MODELS}/{_file_name(key)}"
        _replace(folder / row["model"], text)
    _replace(folder / ROWS / _file_name(key), json.dumps(row))


def _replace(path: Path, text: str) -> None:
    """Writes a file whole or not at all."""
    begun = path.with_name(f".{path.name}.tmp")
    begun.write_text(text)
    begun.replace(path)


def _row(folder: Path, key: str) -> dict[str, Any] | None:
    path = folder / ROWS / _file_name(key)
    return dict(json.loads(path.read_text())) if path.exists() else None


def _write_table(folder: Path, rows: list[dict[str, Any]]) -> Path:
    import pyarrow
    from pyarrow import parquet

    names = list(dict.fromkeys(name for row in rows for name in row))

    def column(name: str) -> Any:
        values = [row.get(name) for row in rows]
        kinds = {bool if isinstance(v, bool) else float if isinstance(v, (int, float)) else str for v in values if v is not None}
        if len(kinds) > 1:
            return pyarrow.array([None if v is None else str(v) for v in values], pyarrow.string())
        kind = {bool: pyarrow.bool_(), float: pyarrow.float64(), str: pyarrow.string()}[kinds.pop() if kinds else str]
        return pyarrow.array(values, kind)

    path = folder / TABLE
    begun = path.with_name(f".{path.name}.tmp")
    parquet.write_table(pyarrow.table({name: column(name) for name in names}), begun)
    begun.replace(path)
    return path


def identify(
    u: Any, y: Any, *, model: Hammerstein | None = None, dt: float | None = None, excerpt: int = 100_000, client: Any = None
) -> Hammerstein:
    """Identifies a Hammerstein system from a record that is too long for one machine.

    The structure (order, delay, breakpoints, colour of the noise) comes from excerpts, `excerpt` samples together, which are spread evenly over the
    record. Then all coefficients and the places of kinks take steps on all samples: the equations of every step are sums over the chunks,
    each of which is given the samples just before it. The result does not depend on the chunks but for the last digits. The
    record is read once for every step, five times or so; ``u.persist()`` keeps it in the workers' memory.

    The verdict is made on the end of the record: the share `fresh` of its last `excerpt` samples, which are not fitted.
    What the excerpts do not show, no step adds: inputs beyond their range have the curve's end value.

    Parameters
    ----------
    u, y : dask.array.Array of shape (n,), or lists of such arrays
        Input and output, in chunks of the same lengths. Lists are several records of one system, each from a state of its own.
    model : Hammerstein, optional
        What to identify, by the refined method without `form`, `missing` and `robust`.
    dt : float, optional
        The sample time, s.
    excerpt : int
        Samples that this process holds.
    client : distributed.Client, optional
        The cluster. Its workers must have this version of Flexure.

    Returns
    -------
    Hammerstein
        Fitted, with standard errors from all samples; ``samples_`` is their number.

    Raises
    ------
    DataError
        For values that are not finite, with their place in the record, and records that show no such system.
    ParameterError
        For a parameter outside its range, arrays of different chunks, and chunks that are shorter than the system remembers.

    Examples
    --------
    >>> import dask.array, flexure.dask
    >>> u, y = dask.array.from_zarr("log.zarr/u"), dask.array.from_zarr("log.zarr/y")  # doctest: +SKIP
    >>> model = flexure.dask.identify(u, y, dt=0.001)  # doctest: +SKIP
    """
    delayed = installed("dask").delayed
    asked = flexure.Hammerstein() if model is None else _clone(model)
    options = asked._options()
    for name in ("form", "missing", "robust"):
        if options[name]:
            raise ParameterError(f"{name} is {options[name]!r}, but a record in shards is identified without it")
    shards = Shards(u, y, excerpt, options["fresh"])
    with on_cluster(client) as cluster:
        same_version(cluster)
        held = cluster.gather(cluster.compute(shards.excerpts(), retries=RETRIES))
        *excerpts, (end_u, end_y) = [(samples(of_u, "u"), samples(of_y, "y")) for of_u, of_y in held]
        found = Sharded(excerpts, options | {"fresh": 0.05})
        goes_on = True
        while goes_on:
            whole = merged(delayed(merged_sums), shards.sums(found.point(), found.reach))
            goes_on = found.advance(cluster.compute(whole, retries=RETRIES).result())
    asked._identified(found.identification(end_u, end_y, dt, options), [end_u], end_y)
    asked.samples_ = found.count
    return asked


def regress(
    data: Any,
    *,
    x: Any,
    y: Any,
    degree: int = 1,
    bandwidth: float | None = None,
    kernel: str = "epanechnikov",
    block: int = 1000,
    most_bins: int = 1 << 15,
    client: Any = None,
) -> StreamedKernelRegressor:
    """Kernel regression of y on x over a collection of dask, which may be larger than memory.

    Every partition is reduced to sums in bins, which are merged in an order of their own; the result is, bit for bit, the same for any
    number of workers. The collection is read twice: for the lengths of its partitions, and for the sums. Rows are taken to stand in
    order of time, as `flexure.StreamedKernelRegressor` says, which also explains the other parameters.

    Parameters
    ----------
    data : dask.dataframe.DataFrame, or None
        With the columns `x` and `y`; None where these are arrays.
    x : str, or dask.array.Array of shape (n,) or (n, 1)
        The abscissas.
    y : str, or dask.array.Array of shape (n,)
        The ordinates, in chunks of the same lengths.
    client : distributed.Client, optional
        The cluster. Its workers must have this version of Flexure.

    Returns
    -------
    StreamedKernelRegressor
        Fitted: it predicts, has a band, and takes in further rows.

    Raises
    ------
    DataError
        For values that are not finite, with their row.
    ParameterError
        For a parameter outside its range, and arrays of different chunks.

    Examples
    --------
    >>> import dask.dataframe as dd, flexure.dask
    >>> frame = dd.read_parquet("log/*.parquet")  # doctest: +SKIP
    >>> model = flexure.dask.regress(frame, x="velocity", y="torque")  # doctest: +SKIP
    >>> torque, band = model.predict([[0.1]], return_band=0.95)  # doctest: +SKIP
    """
    delayed = installed("dask").delayed
    model = flexure.StreamedKernelRegressor(degree, bandwidth=bandwidth, kernel=kernel, block=block, most_bins=most_bins)
    parts = _partitions(data, x, y)
    with on_cluster(client) as cluster:
        same_version(cluster)
        lengths = cluster.gather(cluster.compute([delayed(len)(of_x) for of_x, _ in parts], retries=RETRIES))
        first_rows = [sum(lengths[:k]) for k in range(len(parts))]
        sums = [delayed(_sums)(model, first, of_x, of_y) for first, (of_x, of_y) in zip(first_rows, parts, strict=True)]
        whole: bytes = cluster.compute(merged(partial(delayed(_merged), model), sums), retries=RETRIES).result()
    return model.from_bytes(whole)


def _partitions(data: Any, x: Any, y: Any) -> list[tuple[Any, Any]]:
    """The abscissas and ordinates of every partition, still to be computed."""
    if data is not None:
        missing = [name for name in (x, y) if name not in data.columns]
        if missing:
            raise ParameterError(f"the frame has no column {missing[0]!r}; its columns are {', '.join(map(str, data.columns))}")
        return list(zip(data[x].to_delayed(), data[y].to_delayed(), strict=True))
    if not (hasattr(x, "chunks") and hasattr(y, "chunks")):
        raise ParameterError("x and y must be dask arrays, or names of columns of data")
    x = x[:, 0] if x.ndim == 2 and x.shape[1] == 1 else x
    if x.ndim != 1 or y.ndim != 1 or x.chunks != y.chunks:
        raise ParameterError(f"x has shape {x.shape} in chunks {x.chunks} and y has {y.shape} in {y.chunks}, but must be alike; rechunk one of them")
    return list(zip(x.to_delayed(), y.to_delayed(), strict=True))


def _sums(model: StreamedKernelRegressor, first_row: int, x: Any, y: Any) -> bytes:

    return model.partial_fit(np.asarray(x, dtype=float), np.asarray(y, dtype=float), first_row=first_row).to_bytes()


def _merged(model: StreamedKernelRegressor, parts: list[bytes]) -> bytes:
    return model.from_bytes(parts).to_bytes()


def simulate_batch(arm: Arm, torques: Iterable[Any], *, kind: str = "torque", client: Any = None) -> list[dict[str, npt.NDArray[np.float64]]]:
    """`Arm.simulate_batch` on a cluster: one record for every pair of torques, in their order, bit for bit as on one machine.

    Parameters
    ----------
    arm : Arm
        The arm.
    torques, kind
        As in `Arm.simulate_batch`.
    client : distributed.Client, optional
        The cluster. Its workers must have this version of Flexure.

    Returns
    -------
    list of dict
        The columns of a record, an array each.
    """
    torques = list(torques)
    if not torques:
        return []
    with on_cluster(client) as cluster:
        same_version(cluster)
        workers = max(1, len(cluster.scheduler_info()["workers"]))
        # So many tasks a worker that the last ones end together.
        size = max(1, -(-len(torques) // (8 * workers)))
        starts = range(0, len(torques), size)
        futures = [cluster.submit(_simulated, arm, torques[k : k + size], kind, k, retries=RETRIES, pure=False) for k in starts]
        parts = cluster.gather(futures)
    return [dict(zip(names, record, strict=True)) for names, ends, table in parts for record in np.split(table, ends, axis=1)]


def _simulated(arm: Arm, torques: list[Any], kind: str, first: int) -> tuple[list[str], Any, npt.NDArray[np.float64]]:
    """The names of the columns, where records begin after the first, and all in one array, since messages of many arrays take long."""
    simulated = arm.simulate_batch(torques, kind=kind, first=first)
    records = [np.array(list(record.values())) for record in simulated]
    ends = np.cumsum([record.shape[1] for record in records])[:-1]
    return list(simulated[0]), ends, np.hstack(records)
