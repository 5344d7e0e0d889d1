"""What all functions of `flexure.dask` have in common: a cluster whose workers are alike, and sums that are merged."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from importlib import import_module
from typing import Any

import flexure
from flexure._core import DataError, FlexureError

# How often a task that reads is computed again when it raises. Workers that die have a limit of their own: `allowed-failures` of `distributed`.
RETRIES = 10
# Sums that one task merges.
MERGED = 8
# The share of the memory of a worker's thread that a task's data may take: the library holds a second copy.
MOST_OF_MEMORY = 0.5


def installed(module: str) -> Any:
    try:
        return import_module(module)
    except ImportError as error:
        raise FlexureError(f"{module} is not installed: pip install flexure[dask]") from error


@contextmanager
def on_cluster(client: Any) -> Iterator[Any]:
    """The client, or one of a cluster of its own; the workers have this version of Flexure."""
    if client is not None:
        yield from _checked(client)
        return
    distributed = installed("distributed")
    with distributed.LocalCluster(threads_per_worker=1, dashboard_address=":0") as cluster, distributed.Client(cluster, direct_to_workers=True) as own:
        yield from _checked(own)


def _checked(client: Any) -> Iterator[Any]:
    same_version(client)
    try:
        yield client
    except (FlexureError, installed("distributed").CancelledError):
        raise
    except Exception:
        # A worker that has joined without Flexure, or with one that lacks these tasks, cannot say so itself.
        same_version(client)
        raise


def version() -> str:
    return flexure.__version__


def same_version(client: Any) -> None:
    """Refuses workers that would compute something else."""
    try:
        versions = client.run(version)
    except Exception as error:
        raise FlexureError(f"the workers cannot import Flexure ({error}); install flexure {flexure.__version__} on them") from error
    others = sorted({other for other in versions.values() if other != flexure.__version__})
    if others:
        raise _of_other_versions(f"workers have Flexure {', '.join(others)}", flexure.__version__)


def _of_other_versions(found: str, wanted: str) -> FlexureError:
    return FlexureError(f"{found}, but this is {wanted}; install one version everywhere")


def on_worker(function: Callable[..., Any]) -> partial[Any]:
    """A task that checks the version of Flexure first: workers may join at any time."""
    return partial(_run, flexure.__version__, function)


def _run(wanted: str, function: Callable[..., Any], *arguments: Any) -> Any:
    if version() != wanted:
        raise _of_other_versions(f"worker {installed('distributed').get_worker().address} has Flexure {version()}", wanted)
    return function(*arguments)


def task(function: Callable[..., Any]) -> Callable[..., Any]:
    """A task of a graph. It reads nothing, so what it raises, it would raise again: it is not computed again."""
    dask = installed("dask")
    own = dask.delayed(on_worker(function), pure=True)

    def call(*arguments: Any) -> Any:
        with dask.annotate(retries=0):
            return own(*arguments)

    return call


def merged(merge: Callable[[list[Any]], Any], parts: list[Any]) -> Any:
    """All parts merged by a tree, in their order."""
    while len(parts) > 1:
        parts = [merge(parts[k : k + MERGED]) for k in range(0, len(parts), MERGED)]
    return parts[0]


def fits(what: str, needed: int, limit: int, remedy: str) -> None:
    """Refuses what would take too much of a worker's memory, before it is loaded; a limit of 0 is none."""
    if limit and needed > MOST_OF_MEMORY * limit:
        raise DataError(f"{what} takes {needed / 1e6:.0f} MB, more than half of the {limit / 1e6:.0f} MB of a worker's thread; {remedy}")


def least_memory(client: Any) -> int:
    """The memory of a worker's thread where it is least, in bytes; 0 where none has a limit."""
    workers = client.scheduler_info(n_workers=-1)["workers"].values()
    limits: list[int] = [worker["memory_limit"] // worker["nthreads"] for worker in workers if worker["memory_limit"]]
    return min(limits, default=0)


def own_memory() -> int:
    """The memory of a thread of the worker that runs this task, in bytes; 0 without a limit."""
    worker = installed("distributed").get_worker()
    limit: int = worker.memory_manager.memory_limit or 0
    return limit // int(worker.state.nthreads)
