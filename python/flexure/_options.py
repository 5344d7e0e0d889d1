"""The options of identified systems: their defaults, their types, and two known points."""

from __future__ import annotations

from numbers import Real
from typing import Any

import numpy as np

from flexure._core import ParameterError

# The default options of the library's methods.
OPTIONS: dict[str, Any] = {
    "method": "refined",
    "order": None,
    "delay": None,
    "unit": "static-gain",
    "known": None,
    "fresh": 0.25,
    "form": None,
    "missing": False,
    "noise_model": True,
    "nonlinearity": "kernel",
    "kernel": "epanechnikov",
    "parameter": None,
    "lag": None,
    "ignore_colour": False,
    "branches": None,
    "robust": False,
}


# The parameters' types; None is one where it is the default.
_NAME, _NUMBER, _FLAG = (str, "a name"), (Real, "a number"), (bool | np.bool_, "True or False")
_COUNT: tuple[Any, str] = (int, "")
KINDS: list[tuple[str, Any, str]] = [
    *((name, *_NAME) for name in ("method", "unit", "form", "nonlinearity", "kernel")),
    *((name, *_NUMBER) for name in ("fresh", "parameter")),
    *((name, *_FLAG) for name in ("missing", "noise_model", "ignore_colour", "robust")),
    *((name, *_COUNT) for name in ("order", "delay", "lag", "branches")),
]


def points(known: Any) -> list[list[float]]:
    """Two points as two pairs of numbers."""
    try:
        pair = np.asarray(known, dtype=np.float64)
    except (TypeError, ValueError):
        pair = np.empty(0)
    if pair.shape != (2, 2):
        raise ParameterError(f"known is {known!r}, but must be two points, ((x, phi), (x, phi))")
    pairs: list[list[float]] = pair.tolist()
    return pairs
