"""Fits to one or several columns: as they are, or one column at a time in an additive model."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from flexure._arrays import plain
from flexure._core import Regression

Array = npt.NDArray[np.float64]

# Sweeps of backfitting, and the change of the fitted values, relative to the size of y, at which it ends.
_SWEEPS = 50
_TOLERANCE = 1e-10


def columns_of(x: Array) -> list[Array]:
    """The columns of a 2-D array, each contiguous; copies only where they are not."""
    return [plain(x[:, j]) for j in range(x.shape[1])]


@dataclass
class Term:
    """A regression on some columns, which can be pickled: it is fitted again, with the parameter it has."""

    name: str
    settings: dict[str, Any]
    x: list[Array]
    y: Array
    weights: Array | None
    parameter: list[float] | None = None
    # Whether the parameter was chosen from data, and whether rows are repeated in place of weights.
    chosen: bool = False
    repeated: bool = False
    core: Regression = field(init=False, repr=False)

    def __post_init__(self) -> None:
        self.core = Regression.fit(
            self.name,
            self.x,
            self.y,
            self.weights,
            parameter=self.parameter,
            chosen=self.chosen,
            repeated=self.repeated,
            **self.settings,
        )

    def __getstate__(self) -> dict[str, Any]:
        # Local bandwidths are no parameter that could be given: they are found again.
        parameter = None if self.name == "local-bandwidth" else self.core.parameter
        chosen = parameter is not None and (self.chosen or self.parameter is None)
        state = {**self.__dict__, "parameter": parameter, "chosen": chosen}
        del state["core"]
        return state

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self.__post_init__()


@dataclass
class Additive:
    """An intercept and a term a column: y = c + m_1(x_1) + m_2(x_2) + ..., by backfitting.

    Buja, Hastie and Tibshirani (1989). Every term's parameter is chosen in the first sweep and kept in the others; the
    terms have mean zero over the points that were fitted. Columns that do not vary have no term.
    """

    intercept: float
    terms: dict[int, Term]
    means: dict[int, float]

    @classmethod
    def fit(
        cls,
        name: str,
        settings: dict[str, Any],
        x: list[Array],
        y: Array,
        weights: Array | None,
        given: list[float] | None,
        repeated: bool = False,
    ) -> Additive:
        """Fits each term in turn to the rest that the others leave, until the terms no longer change."""
        intercept = float(np.average(y, weights=weights))
        counted = slice(None) if weights is None else weights > 0
        varying = [j for j in range(len(x)) if np.ptp(x[j][counted]) > 0]
        fitted = {j: np.zeros_like(y) for j in varying}
        terms: dict[int, Term] = {}
        means: dict[int, float] = {}
        scale = float(np.max(np.abs(y - intercept))) if len(y) else 0.0
        for sweep in range(_SWEEPS if len(varying) > 1 else 1):
            change = 0.0
            for j in varying:
                left = y - intercept - sum(fitted[k] for k in varying if k != j)
                own = given if given is None or len(given) == 1 else [given[j]]
                parameter = own if sweep == 0 else terms[j].core.parameter
                chosen = sweep > 0 and given is None
                terms[j] = Term(name, settings, [x[j]], left, weights, parameter, chosen, repeated)
                values = terms[j].core.predict([x[j]])
                means[j] = float(np.average(values, weights=weights))
                change = max(change, float(np.max(np.abs(values - means[j] - fitted[j]))))
                fitted[j] = values - means[j]
            if change <= _TOLERANCE * scale:
                break
        return cls(intercept, terms, means)

    def predict(self, x: list[Array]) -> Array:
        """The sum of the terms."""
        values = np.full(len(x[0]), self.intercept)
        for j, term in self.terms.items():
            values += term.core.predict([x[j]]) - self.means[j]
        return values
