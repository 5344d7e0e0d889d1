"""What all functions of `flexure.dask` have in common: a cluster whose workers are alike, and sums that are merged."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib import import_module
from typing import Any

import flexure
from flexure._core import FlexureError

# How often a task that raises is computed again. Workers that die have a limit of their own: `allowed-failures` of `distributed`.
RETRIES = 10
# Sums that one task merges.
MERGED = 8


def installed(module: str) -> Any:
    try:
        return import_module(module)
    except ImportError as error:
        raise FlexureError(f"{module} is not installed: pip install flexure[dask]") from error


@contextmanager
def on_cluster(client: Any) -> Iterator[Any]:
    if client is not None:
        yield client
        return
    distributed = installed("distributed")
    with distributed.LocalCluster(threads_per_worker=1, dashboard_address=":0") as cluster, distributed.Client(cluster, direct_to_workers=True) as own:
        yield own


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
        raise FlexureError(f"workers have Flexure {', '.join(others)}, but this is {flexure.__version__}; install one version everywhere")


def merged(merge: Callable[[list[Any]], Any], parts: list[Any]) -> Any:
    """All parts merged by a tree, in their order."""
    while len(parts) > 1:
        parts = [merge(parts[k : k + MERGED]) for k in range(0, len(parts), MERGED)]
    return parts[0]
