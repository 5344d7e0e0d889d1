"""Frames of any kind as named columns at instants, and back as frames of that kind."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from flexure import _records as records
from flexure import _times as times
from flexure._arrays import Array, samples
from flexure._core import DataError


class Frame:
    """A pandas or polars frame or a dict of arrays: its numbers, its instants, and how to make another like it."""

    def __init__(self, frame: Any, dt: float | None = None) -> None:
        self._frame = records.plain(frame)
        self._kind = type(self._frame).__module__.partition(".")[0]
        if not isinstance(self._frame, dict) and self._kind not in ("pandas", "polars"):
            raise DataError(f"a {type(frame).__name__} is no frame; give a pandas or polars frame, or a dict of arrays")
        self._keys = {str(key): key for key in (self._frame if isinstance(self._frame, dict) else self._frame.columns)}
        # Where the instants are: in the index, or in the column of this key; as they are, not yet in seconds.
        self._instants = times.instants_of(self._frame) if self._kind == "pandas" else None
        self._time = None
        if self._instants is None:
            self._time = next((name for name in self._keys if times.is_time(name)), None)
            if self._time is not None:
                self._instants = times.column_of_time(self._frame[self._keys[self._time]], self._time)
        self.seconds = self._in_seconds(dt)
        self.columns = [(name, column) for name in self._keys if name != self._time and (column := self._numbers(name)) is not None]
        if not self.columns:
            raise DataError("the frame has no column of numbers but the time")
        lengths = {len(column) for _, column in self.columns} | ({len(self.seconds)} if self.seconds is not None else set())
        if len(lengths) > 1:
            raise DataError(f"the columns have {', '.join(map(str, sorted(lengths)))} samples; all must have the same length")

    @staticmethod
    def of_all(frames: Sequence[Any]) -> list[Frame]:
        """Frames of one clock: time stamps count from the first one's."""
        given = [Frame(frame) for frame in frames]
        origins = [frame._origin() for frame in given]
        for frame, origin in zip(given[1:], origins[1:], strict=True):
            if frame.seconds is None or (origin is None and origins[0] is None):
                continue
            if origin is None or origins[0] is None:
                raise DataError("the frames have no common clock: the time of one is a time stamp, that of the other a number")
            frame.seconds = frame.seconds + (origin - origins[0]) / np.timedelta64(1, "s")
        return given

    def name(self, column: Any) -> str:
        """The name of a column of numbers."""
        names = [name for name, _ in self.columns]
        if str(column) not in names:
            raise DataError(f"no column '{column}' of numbers; the columns are: {', '.join(names)}")
        return str(column)

    def chosen(self, columns: Any) -> list[str]:
        """The names of some columns of numbers; of all for None."""
        if columns is None:
            return [name for name, _ in self.columns]
        several = isinstance(columns, Sequence) and not isinstance(columns, str)
        return [self.name(column) for column in (columns if several else [columns])]

    def only(self, names: Sequence[str]) -> Frame:
        """With some of its columns, for work on these alone."""
        part = object.__new__(Frame)
        part.__dict__ = {**self.__dict__, "columns": [column for column in self.columns if column[0] in names]}
        return part

    def replaced(self, columns: Mapping[str, Array]) -> Any:
        """A frame like it, with other samples in some columns."""
        new = {self._keys[name]: column for name, column in columns.items()}
        if isinstance(self._frame, dict):
            return {**self._frame, **new}
        if self._kind == "pandas":
            frame = self._frame.copy()
            for key, column in new.items():
                frame[key] = column
            return frame
        import polars

        return self._frame.with_columns([polars.Series(name, column) for name, column in new.items()])

    def rows(self, start: int, stop: int) -> Any:
        """A frame like it, of some of its rows."""
        if isinstance(self._frame, dict):
            return {key: np.asarray(column)[start:stop] for key, column in self._frame.items()}
        return self._frame.iloc[start:stop] if self._kind == "pandas" else self._frame[start:stop]

    def at(self, seconds: Array | None, columns: Mapping[str, Array]) -> Any:
        """A frame of the same kind, of other columns at other instants."""
        new: dict[Any, Any] = {self._keys.get(name, name): column for name, column in columns.items()}
        instants = None if seconds is None else self._from_seconds(seconds)
        if instants is not None and (self._time is not None or self._kind != "pandas"):
            new = {self._keys.get(self._time or "t", "t"): instants, **new}
        if isinstance(self._frame, dict):
            return new
        if self._kind == "polars":
            return type(self._frame)(new)
        index = None if instants is None or self._time is not None else type(self._frame.index)(instants)
        if index is not None:
            index.name = self._frame.index.name
        return type(self._frame)(new, index=index)

    def _numbers(self, name: str) -> Array | None:
        """A column's samples; None for one of texts or instants."""
        try:
            return samples(self._frame[self._keys[name]], name)
        except TypeError:
            return None

    def _origin(self) -> np.datetime64 | None:
        """What the instants count from, if they are time stamps."""
        if self._instants is None or self._instants.dtype.kind != "M":
            return None
        return np.datetime64(self._instants[0])

    def _in_seconds(self, dt: float | None) -> Array | None:
        dt = times.given_step(dt)
        if dt is not None and self._instants is None:
            first = next(iter(self._keys.values()), None)
            return np.arange(len(self._frame[first]) if first is not None else 0, dtype=np.float64) * np.float64(dt)
        if self._instants is None or len(self._instants) == 0:
            return None
        seconds = times.seconds(self._instants, self._instants[0])
        if dt is not None:
            times.check_same_step(times.step_of(self._instants), dt, "the frame's sample time is {:g} s, but dt is {:g} s; leave dt out")
        return seconds

    def _from_seconds(self, seconds: Array) -> Any:
        """Instants as the frame has them: time stamps, with their zone, durations or numbers."""
        if self._instants is None or self._instants.dtype.kind not in "mM":
            return seconds
        lasting = np.round(seconds * 1e9).astype("timedelta64[ns]")
        instants = lasting + self._instants[0].astype(f"{self._instants.dtype.kind}8[ns]")
        given = self._frame.index if self._time is None else self._frame[self._keys[self._time]]
        zone = getattr(getattr(given, "dt", given), "tz", None) if self._kind == "pandas" else getattr(getattr(given, "dtype", None), "time_zone", None)
        if zone is None:
            return instants
        if self._kind == "pandas":
            import pandas

            return pandas.DatetimeIndex(instants, tz="UTC").tz_convert(zone)
        import polars

        return polars.Series(instants).dt.replace_time_zone("UTC").dt.convert_time_zone(zone)
