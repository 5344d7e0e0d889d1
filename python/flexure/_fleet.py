"""A fleet of machines on a cluster: one task a machine, and a folder with what is done."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from sklearn.base import clone

import flexure
from flexure._cluster import fits, installed, on_cluster, on_worker, own_memory
from flexure._core import DataError, ParameterError

# What is in a folder of results beside the table, as `flexure fleet` has it.
BEGUN, ROWS, MODELS, TABLE = "fleet.json", "rows", "models", "table.parquet"
# Machines that wait on the cluster at most: a fleet's tasks need not all be known to the scheduler at once.
WAITING = 2000
# Of those whose records this process sends, so many a thread of a worker: the scheduler holds them.
RECORDS_WAITING = 4
DEATHS = "most likely it needs more memory than a worker has, or crashes: see the worker's log"


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
    again. A worker that dies loses nothing: the cluster gives its task to another one. A machine on which workers die again and again runs
    once more, alone, at the end; if they still die, its row says so. The numbers are those of one machine, whatever the workers.

    A worker holds one record at a time, which may take half of its memory: longer ones are refused before they are read.

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
        A worker has another version of Flexure, or none; so does one that joins later. What is done is kept.

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
    found: dict[str, Files] = {}
    for path in sorted(root.rglob("*.parquet")):
        keys = [part.partition("=")[2] for part in path.relative_to(root).parts if part.startswith(f"{by}=")]
        if keys:
            found.setdefault(keys[-1], Files([])).paths.append(str(path.resolve()))
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
    killed = installed("distributed").KilledWorker

    def submit(key: str) -> Any:
        return client.submit(on_worker(_one), key, jobs[key], model, by, key=f"flexure-{by}-{key}-{os.urandom(4).hex()}", pure=False)

    from_files = all(isinstance(job, Files) for job in jobs.values())
    most = WAITING if from_files else RECORDS_WAITING * max(1, sum(client.nthreads().values()))
    waiting = iter(jobs)
    keys = {submit(key): key for _, key in zip(range(most), waiting, strict=False)}
    running, blamed = installed("distributed").as_completed(list(keys)), []
    try:
        for future in running:
            key = keys.pop(future)
            try:
                yield future.result()
            except killed:
                blamed.append(key)
            for another in waiting:
                running.add(begun := submit(another))
                keys[begun] = another
                break
    finally:
        client.cancel(list(keys))
    # Workers died while these were on them, whichever of these was at fault: it shows when they run alone.
    for key in blamed:
        try:
            yield submit(key).result()
        except killed as error:
            yield _failed(by, key, f"every worker that had this record alone has died ({error.allowed_failures + 1} tried); {DEATHS}")


def _failed(by: str, key: str, error: str) -> tuple[str, dict[str, Any], None]:
    return key, {by: key, "status": "failed", "error": error}, None


def _one(key: str, job: Any, model: Any, by: str) -> tuple[str, dict[str, Any], str | None]:
    """A machine's row, and its model's text."""
    row: dict[str, Any] = {by: key, "status": "done", "error": None}
    try:
        record = job.read() if isinstance(job, Files) else job
        found = model(record) if callable(model) else clone(model).fit(record)
        if hasattr(found, "to_json"):
            text = found.to_json()
            row |= _of_system(found)
        else:
            text = json.dumps(found.result)
            row |= _single_values(found.result)
        return key, row, text
    except Exception as error:
        # Whatever is wrong with one record is no reason to lose the others.
        return _failed(by, key, f"{type(error).__name__}: {error}")


class Files(NamedTuple):
    """A machine's record: Parquet files one after the other."""

    paths: list[str]

    def read(self) -> dict[str, Any]:
        """The columns, read one at a time."""
        from pyarrow import parquet

        names = parquet.read_schema(self.paths[0]).names
        if any(parquet.read_schema(path).names != names for path in self.paths):
            raise DataError(f"the files {', '.join(self.paths)} have different columns")
        rows = sum(parquet.read_metadata(path).num_rows for path in self.paths)
        fits(f"the record of {rows} rows and {len(names)} columns", 8 * rows * len(names), own_memory(), "give the workers more, or cut the record")

        def column(name: str) -> Any:
            return np.concatenate([parquet.ParquetFile(path).read(columns=[name])[name].to_numpy() for path in self.paths])

        return {name: column(name) for name in names}


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
