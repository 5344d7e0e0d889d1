"""The preparation of a measured record before an identification: the steps of ``flexure prepare`` on frames.

A frame is a pandas or polars frame, or a dict of arrays. Every function returns a new one of the same kind. The instants are those of a pandas
index of time, or of a column called ``t`` or ``time``; else give the sample time as `dt`. A missing sample is NaN.

What a step did is logged at level INFO by the logger ``flexure.prepare``, in the sentences of the command line:

>>> import logging, sys
>>> logging.basicConfig(stream=sys.stdout, format="%(message)s", level=logging.INFO, force=True)
>>> import numpy as np
>>> from flexure import prepare
>>> t = np.arange(200) / 100
>>> y = np.sin(5 * t)
>>> y[70] = 40.0
>>> clean = prepare.outliers({"t": t, "y": y})
1 of 200 samples of 'y' is an outlier (more than 5 robust deviations from 14 neighbours), at 0.7 s; it is missing now
>>> slow = prepare.resample(clean, 0.02, longest_gap=1)
200 samples, about 0.01 s apart, are now 100 every 0.02 s; what is faster than 20 Hz is taken out first; 1 sample missing of 'y' is interpolated
>>> bool(abs(slow["y"][35] - np.sin(3.5)) < 1e-3)
True
"""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from flexure import _core
from flexure._arrays import finite_number, whole
from flexure._core import DataError, ParameterError
from flexure._frames import Frame

__all__ = ["convert", "cut", "detrend", "fill", "low_pass", "merge", "outliers", "remove_mean", "resample"]

_log = logging.getLogger(__name__)

# Options that do nothing. Each function sets its own ones.
_NOTHING: dict[str, Any] = {
    "cut": None,
    "convert": [],
    "outliers": None,
    "threshold": 5.0,
    "neighbours": 7,
    "resample": None,
    "hold": [],
    "longest_gap": 3,
    "fill": None,
    "low_pass": None,
    "order": 4,
    "remove_mean": None,
    "detrend": None,
}


def cut(frame: Any, start: float | None = None, stop: float | None = None) -> Any:
    """The samples from `start` to `stop`, both included.

    Parameters
    ----------
    frame
        A frame with instants.
    start, stop
        Instants in s; of time stamps, seconds from the first one. None leaves an end open.

    Examples
    --------
    >>> from flexure import prepare
    >>> prepare.cut({"t": [0.0, 0.1, 0.2, 0.3], "y": [1.0, 2.0, 3.0, 4.0]}, 0.1, 0.2)["y"]
    array([2., 3.])
    """
    ends = [None if end is None else finite_number(end, name) for end, name in ((start, "start"), (stop, "stop"))]
    given = Frame(frame)
    instants, _ = _run([given], cut=ends)
    if instants is None or given.seconds is None:
        raise DataError("a cut by time needs a time column; without one, slice the frame")
    first = int(np.searchsorted(given.seconds, instants[0]))
    return given.rows(first, first + len(instants))


def convert(frame: Any, units: Mapping[str, tuple[str, str]]) -> Any:
    """Columns in other units.

    Parameters
    ----------
    frame
        A frame.
    units
        By column, the unit it has and the one it is to have. A unit may be divided by a number: ``("rev/4096", "rad")`` for an
        encoder that counts 4096 in a revolution.

    Examples
    --------
    >>> from flexure import prepare
    >>> prepare.convert({"q": [0.0, 500.0]}, {"q": ("mm", "m")})["q"]
    array([0. , 0.5])
    """
    given = Frame(frame)
    pairs = [(given.name(column), *map(str, pair)) for column, pair in units.items()]
    return given.replaced(_run([given.only([column for column, *_ in pairs])], convert=pairs)[1])


def outliers(frame: Any, columns: str | Sequence[str] | None = None, *, threshold: float = 5.0, neighbours: int = 7) -> Any:
    """The frame with NaN in place of outliers: samples far away from the median of their neighbours (Hampel's rule).

    The distance must exceed `threshold` robust standard deviations of the neighbours, and of the changes from sample to sample: signals
    that are quantised or stand still lose nothing. A short and strong event, such as an impact, is an outlier by this rule: check
    the samples that are found.

    Parameters
    ----------
    frame
        A frame.
    columns
        One column or several; None for all.
    threshold
        In robust standard deviations.
    neighbours
        So many samples on either side.

    Examples
    --------
    >>> import numpy as np
    >>> from flexure import prepare
    >>> y = np.sin(0.1 * np.arange(100))
    >>> y[50] = 9.0
    >>> np.flatnonzero(np.isnan(prepare.outliers({"y": y})["y"]))
    array([50])
    """
    given = Frame(frame)
    chosen = given.chosen(columns)
    settings = {"outliers": chosen, "threshold": finite_number(threshold, "threshold"), "neighbours": whole(neighbours, "neighbours", 1)}
    return given.replaced(_run([given.only(chosen)], **settings)[1])


def fill(frame: Any, columns: str | Sequence[str] | None = None, *, longest_gap: int = 3) -> Any:
    """The frame with short gaps interpolated by cubic splines; the samples must be evenly spaced.

    Parameters
    ----------
    frame
        A frame.
    columns
        One column or several; None for all.
    longest_gap
        Most samples in a row that may be missing. Longer gaps, and missing samples at the ends, stay NaN.

    Examples
    --------
    >>> import numpy as np
    >>> from flexure import prepare
    >>> y = np.arange(8.0) ** 2
    >>> y[4] = np.nan
    >>> prepare.fill({"y": y})["y"][4].round(9)
    np.float64(16.0)
    """
    given = Frame(frame)
    return given.replaced(_run([given.only(given.chosen(columns))], fill=whole(longest_gap, "longest_gap"))[1])


def resample(frame: Any, dt: float, *, hold: str | Sequence[str] = (), longest_gap: int = 3) -> Any:
    """The frame at even instants, `dt` s apart from the first on.

    The instants may jitter and have gaps. Between them signals are cubic splines. Where `dt` is longer than the old step, a low-pass of zero phase at
    0.8 of half the new sampling rate first takes out what would show as aliases. Columns of text are left out.

    Parameters
    ----------
    frame
        A frame with instants.
    dt
        The new sample time in s.
    hold
        Columns that hold their value between samples, as commands do. Their new samples are means over the new step.
    longest_gap
        Most samples in a row that may be missing and are interpolated; longer gaps become NaN.

    Examples
    --------
    >>> import numpy as np
    >>> from flexure import prepare
    >>> t = np.array([0.0, 0.09, 0.21, 0.3, 0.41, 0.5])
    >>> even = prepare.resample({"t": t, "y": t**2}, 0.1)
    >>> even["t"]
    array([0. , 0.1, 0.2, 0.3, 0.4, 0.5])
    >>> np.allclose(even["y"], even["t"] ** 2)
    True
    """
    given = Frame(frame)
    settings = {"resample": finite_number(dt, "dt"), "hold": given.chosen(hold), "longest_gap": whole(longest_gap, "longest_gap")}
    return given.at(*_run([given], **settings))


def low_pass(frame: Any, cutoff: float, *, columns: str | Sequence[str] | None = None, order: int = 4, dt: float | None = None) -> Any:
    """The frame without its parts faster than `cutoff` Hz, and without a delay.

    A Butterworth filter runs forward and backward, as SciPy's ``sosfiltfilt``: at `cutoff` the gain is one half. Use the same filter for
    inputs and outputs. NaN stay NaN.

    Parameters
    ----------
    frame
        A frame with even instants, or without instants.
    cutoff
        In Hz, below half the sampling rate.
    columns
        One column or several; None for all.
    order
        Of the filter that runs forward and backward; even.
    dt
        The sample time in s, where the frame has no instants.

    Examples
    --------
    >>> import numpy as np
    >>> from flexure import prepare
    >>> t = np.arange(1000) / 100
    >>> y = prepare.low_pass({"t": t, "y": np.sin(t) + np.sin(250 * t)}, 5)["y"]
    >>> bool(np.max(np.abs(y - np.sin(t))[50:-50]) < 1e-3)
    True
    """
    given = Frame(frame, dt)
    settings = {"low_pass": finite_number(cutoff, "cutoff"), "order": whole(order, "order", 1)}
    return given.replaced(_run([given.only(given.chosen(columns))], **settings)[1])


def remove_mean(frame: Any, columns: str | Sequence[str] | None = None) -> Any:
    """The frame without the means of these columns; None for all.

    Examples
    --------
    >>> from flexure import prepare
    >>> prepare.remove_mean({"y": [1.0, 2.0, 6.0]})["y"]
    array([-2., -1.,  3.])
    """
    given = Frame(frame)
    chosen = given.chosen(columns)
    return given.replaced(_run([given.only(chosen)], remove_mean=chosen)[1])


def detrend(frame: Any, columns: str | Sequence[str] | None = None) -> Any:
    """The frame without the straight lines through these columns, by least squares; None for all.

    Examples
    --------
    >>> import numpy as np
    >>> from flexure import prepare
    >>> np.abs(prepare.detrend({"y": 3.0 + 0.5 * np.arange(10)})["y"]).max() < 1e-12
    np.True_
    """
    given = Frame(frame)
    chosen = given.chosen(columns)
    return given.replaced(_run([given.only(chosen)], detrend=chosen)[1])


def merge(*frames: Any, dt: float | None = None, hold: str | Sequence[str] = (), longest_gap: int = 3) -> Any:
    """Several frames as one, at common instants; of the kind of the first.

    Frames of the same instants are put side by side. Else all are resampled: at the instants of the first one's clock that all of them cover, or
    every `dt` s. A column that an earlier frame has too gets the frame's number in front: ``table2.y``.

    Parameters
    ----------
    *frames
        Frames, all with instants or all without.
    dt, hold, longest_gap
        As of :func:`resample`.

    Examples
    --------
    >>> import numpy as np
    >>> from flexure import prepare
    >>> motor = {"t": np.arange(5) / 10, "u": np.arange(5.0)}
    >>> link = {"t": np.arange(9) / 20, "q": np.arange(9.0)}
    >>> merged = prepare.merge(motor, link)
    >>> list(merged), len(merged["t"])
    (['t', 'u', 'q'], 5)
    """
    if not frames:
        raise ParameterError("merge needs at least one frame")
    given = Frame.of_all(frames)
    names = [hold] if isinstance(hold, str) else list(hold)
    step = None if dt is None else finite_number(dt, "dt")
    return given[0].at(*_run(given, resample=step, hold=names, longest_gap=whole(longest_gap, "longest_gap")))


def _run(frames: Sequence[Frame], **settings: Any) -> tuple[Any, dict[str, Any]]:
    """The instants and the columns that the library makes; says what was done."""
    tables = [(frame.seconds, frame.columns) for frame in frames]
    (instants, columns), done = _core.prepare(tables, {**_NOTHING, **settings})
    for text in done:
        _log.info(text)
    return instants, dict(columns)
