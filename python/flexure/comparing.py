"""Several models on one record, side by side."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from html import escape
from os import PathLike
from typing import Any

from flexure._arrays import whole
from flexure._core import Compared, ParameterError
from flexure._system import System
from flexure.results import frame

__all__ = ["ModelComparison", "compare"]


class ModelComparison:
    """Models on one record, the best fit first.

    Attributes
    ----------
    models : list of dict
        What ``flexure compare --json`` says of each model: "model" (its name), "structure", "order", "fit_percent", "rms", "holds" and more.
    """

    def __init__(self, compared: Compared) -> None:
        self._compared = compared
        self.models: list[dict[str, Any]] = json.loads(compared.json())["models"]

    def summary(self) -> str:
        """The text that ``flexure compare`` prints."""
        return self._compared.summary()

    def to_frame(self, library: str = "pandas") -> Any:
        """The models, one a row, as a frame of "pandas" or "polars"."""
        names = ["model", "structure", "order", "fit_percent", "rms", "holds"]
        return frame({name: [model[name] for model in self.models] for name in names}, library)

    def report(self, path: str | PathLike[str]) -> None:
        """Writes the page that ``flexure compare --report`` writes: one HTML file that needs no network."""
        with open(path, "w", encoding="utf-8") as file:
            file.write(self._compared.page())

    def __repr__(self) -> str:
        return self.summary()

    def _repr_html_(self) -> str:
        return f"<pre>{escape(self.summary())}</pre>"


def compare(models: Mapping[str, System] | Sequence[System], u: Any, y: Any = None, *, skip: int | None = None) -> ModelComparison:
    """Runs fitted models under the inputs of one record, and compares their outputs with the measured one.

    Parameters
    ----------
    models : dict of models by their names, or a sequence of models
        Systems of any structure, fitted or loaded.
    u, y
        The record, as for `fit`: arrays, or `u` alone as a table with the columns of all models.
    skip : int, optional
        The first samples, which do not count; by default as many as the slowest model takes to settle, at most a tenth.

    Examples
    --------
    >>> import numpy as np
    >>> import flexure
    >>> rng = np.random.default_rng(1)
    >>> u = rng.uniform(-2, 2, 2000)
    >>> y = np.convolve(np.clip(u, -1, 1), [0.0, 0.5, 0.25])[:2000] + 0.01 * rng.normal(size=u.size)
    >>> models = {"curve": flexure.Hammerstein().fit(u[:1500], y[:1500]), "line": flexure.Linear().fit(u[:1500], y[:1500])}
    >>> [model["model"] for model in flexure.compare(models, u[1500:], y[1500:]).models]
    ['curve', 'line']
    """
    named = dict(models) if isinstance(models, Mapping) else {f"{i + 1} {model.structure_}": model for i, model in enumerate(models)}
    if not named:
        raise ParameterError("there is no model to compare")
    columns: dict[str, Any] = {}
    entries = []
    for name, model in named.items():
        given = model._signals(u, y)
        inputs = list(model.inputs_)
        columns.update(zip([*inputs, model.output_], [*given.u, given.y], strict=True))
        entries.append((name, model._fitted(), inputs, model.output_))
    return ModelComparison(Compared(list(columns.items()), entries, None if skip is None else whole(skip, "skip")))
