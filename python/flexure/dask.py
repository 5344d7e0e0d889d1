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

from collections.abc import Iterable
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from sklearn.base import clone

import flexure
from flexure._arrays import samples
from flexure._cluster import RETRIES, least_memory, merged, on_cluster, on_worker, task
from flexure._core import ParameterError, Sharded, merged_sums
from flexure._fleet import identify_fleet
from flexure._shards import Shards, largest_fits

if TYPE_CHECKING:
    import numpy.typing as npt

    from flexure import Arm, Hammerstein, StreamedKernelRegressor

__all__ = ["identify", "identify_fleet", "regress", "simulate_batch"]

# Torques that one task of simulations takes at most; its records take some times as much.
TASK_BYTES = 1 << 23

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
    asked = flexure.Hammerstein() if model is None else clone(model)
    options = asked._options()
    for name in ("form", "missing", "robust"):
        if options[name]:
            raise ParameterError(f"{name} is {options[name]!r}, but a record in shards is identified without it")
    shards = Shards(u, y, excerpt, options["fresh"])
    with on_cluster(client) as cluster:
        shards.fit(least_memory(cluster))
        held = cluster.gather(cluster.compute(shards.excerpts(), retries=RETRIES))
        *excerpts, (end_u, end_y) = [(samples(of_u, "u"), samples(of_y, "y")) for of_u, of_y in held]
        found = Sharded(excerpts, options | {"fresh": 0.05})
        goes_on = True
        while goes_on:
            whole = merged(task(merged_sums), shards.sums(found.point(), found.reach))
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
    model = flexure.StreamedKernelRegressor(degree, bandwidth=bandwidth, kernel=kernel, block=block, most_bins=most_bins)
    parts = _partitions(data, x, y)
    with on_cluster(client) as cluster:
        if data is None:
            largest_fits(x, least_memory(cluster))
        lengths = cluster.gather(cluster.compute([task(len)(of_x) for of_x, _ in parts], retries=RETRIES))
        first_rows = [sum(lengths[:k]) for k in range(len(parts))]
        sums = [task(_sums)(model, first, of_x, of_y) for first, (of_x, of_y) in zip(first_rows, parts, strict=True)]
        whole: bytes = cluster.compute(merged(partial(task(_merged), model), sums), retries=RETRIES).result()
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
        # So many tasks a worker that the last ones end together, and none of too much memory.
        most = TASK_BYTES // max(1, np.asarray(torques[0]).nbytes)
        size = max(1, min(most, -(-len(torques) // (8 * max(1, len(cluster.nthreads()))))))
        starts = range(0, len(torques), size)
        futures = [cluster.submit(on_worker(_simulated), arm, torques[k : k + size], kind, k, pure=False) for k in starts]
        parts = cluster.gather(futures)
    return [dict(zip(names, record, strict=True)) for names, ends, table in parts for record in np.split(table, ends, axis=1)]


def _simulated(arm: Arm, torques: list[Any], kind: str, first: int) -> tuple[list[str], Any, npt.NDArray[np.float64]]:
    """The names of the columns, where records begin after the first, and all in one array, since messages of many arrays take long."""
    simulated = arm.simulate_batch(torques, kind=kind, first=first)
    records = [np.array(list(record.values())) for record in simulated]
    ends = np.cumsum([record.shape[1] for record in records])[:-1]
    return list(simulated[0]), ends, np.hstack(records)
