"""A long record as dask arrays, cut into shards that are each given the samples just before them."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator
from itertools import accumulate
from typing import Any

import numpy as np

from flexure._arrays import Array, samples, whole
from flexure._cluster import fits, task
from flexure._core import DataError, ParameterError, shard_sums

# Excerpts of a long record at least.
EXCERPTS = 10
# Samples that one task works on at most: chunks that are longer are cut.
MOST_SAMPLES = 1 << 20


class Shards:
    """Records of one system: the end of the last one is held back for a verdict."""

    def __init__(self, u: Any, y: Any, excerpt: int, fresh: float) -> None:
        several = isinstance(u, list | tuple)
        pairs = list(zip(u, y, strict=True)) if several else [(u, y)]
        records = [_checked(a, b) for a, b in pairs]
        if not records:
            raise ParameterError("there is no record")
        self.whole = records
        last_u, last_y = records[-1]
        held = min(whole(excerpt, "excerpt", 1000), len(last_u))
        self.end, self.end_at = (last_u[-held:], last_y[-held:]), len(last_u) - held
        fitted = len(last_u) - int(fresh * held) - 1
        self.records = [*records[:-1], (last_u[:fitted], last_y[:fitted])]
        self.excerpt = excerpt

    def excerpts(self) -> list[tuple[Any, Any]]:
        """Parts that are spread evenly over the records, all records if they are short; then the end with what is held back."""
        finite = task(_finite)
        parts = [finite(u[first : first + size], y[first : first + size], first) for u, y, first, size in self._parts()]
        return [*parts, finite(*self.end, self.end_at)]

    def fit(self, memory: int) -> None:
        """Refuses chunks that take too much of this memory."""
        for u, _ in self.whole:
            largest_fits(u, memory)

    def _parts(self) -> Iterator[tuple[Any, Any, int, int]]:
        """Record, first sample and size of every excerpt."""
        lengths = [len(u) for u, _ in self.records]
        ends = list(accumulate(lengths))
        if ends[-1] <= self.excerpt:
            yield from ((u, y, 0, len(u)) for u, y in self.records)
            return
        size = min(self.excerpt // EXCERPTS, max(lengths))
        for at in np.linspace(0, ends[-1] - size, self.excerpt // size).astype(int).tolist():
            record = bisect_right(ends, at)
            yield *self.records[record], at - ends[record] + lengths[record], size

    def sums(self, point: str, reach: int) -> list[Any]:
        """The sums over every shard at a point, still to be computed; the samples before a shard that it is given are `reach`."""
        last, sums = task(_last), task(_sums)
        found = []
        for u, y in self.records:
            first, before = 0, None
            for size, of_u, of_y in _pieces(u, y):
                found.append(sums(point, before, of_u, of_y, first, len(u)))
                if size < reach and first and first + size < len(u):
                    raise ParameterError(f"a chunk has {size} samples, but the system remembers {reach}; rechunk to more")
                before = last(of_u, of_y, reach)
                first += size
        return found


def largest_fits(u: Any, memory: int) -> None:
    """Refuses a pair of arrays whose chunks are these if one takes too much of this memory."""
    if not np.isnan(u.chunks[0]).any():
        fits(f"a chunk of {max(u.chunks[0])} samples of two arrays", 16 * max(u.chunks[0]), memory, "rechunk to less")


def _pieces(u: Any, y: Any) -> Iterator[tuple[int, Any, Any]]:
    """The sizes and samples of all chunks, long ones cut."""
    for size, of_u, of_y in zip(u.chunks[0], u.to_delayed(), y.to_delayed(), strict=True):
        count = -(-size // MOST_SAMPLES)
        ends = [size * k // count for k in range(count + 1)]
        for a, b in zip(ends, ends[1:], strict=False):
            yield b - a, *((of_u, of_y) if count == 1 else (of_u[a:b], of_y[a:b]))


def _checked(u: Any, y: Any) -> tuple[Any, Any]:
    """Two dask arrays in chunks of the same known lengths."""
    if not (hasattr(u, "chunks") and hasattr(y, "chunks")):
        raise ParameterError("u and y must be dask arrays, or lists of them")
    if u.ndim != 1 or u.chunks != y.chunks or np.isnan(u.chunks[0]).any():
        raise ParameterError(f"u has shape {u.shape} in chunks {u.chunks} and y has {y.shape} in {y.chunks}, but must be alike and of known length")
    return u, y


def _finite(u: Any, y: Any, first: int) -> tuple[Array, Array]:
    """The samples of an excerpt, which begins at sample `first` of its record."""
    for name, values in (("u", u), ("y", y)):
        if len(wrong := np.flatnonzero(~np.isfinite(samples(values, name)))):
            raise DataError(f"column '{name}' is not finite at sample {first + wrong[0]}; remove or repair that sample")
    return samples(u, "u"), samples(y, "y")


def _last(u: Any, y: Any, count: int) -> tuple[Array, Array]:
    return samples(u[-count:], "u"), samples(y[-count:], "y")


def _sums(point: str, before: tuple[Array, Array] | None, u: Any, y: Any, first: int, length: int) -> bytes:
    """The sums over a shard, which begins at sample `first` of a record of `length` ones."""
    u, y = samples(u, "u"), samples(y, "y")
    if before is None:
        return shard_sums(point, u, y, first, 0, length)
    known = len(before[0])
    return shard_sums(point, np.concatenate([before[0], u]), np.concatenate([before[1], y]), first - known, known, length)
