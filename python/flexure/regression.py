"""Static nonlinearities, m(x) = E(Y | X = x), as scikit-learn estimators.

=====================  ==========================================================  ==================  =================
estimator              what                                                        parameter           columns
=====================  ==========================================================  ==================  =================
`KernelRegressor`      kernel regression, local constant or local linear           ``bandwidth``       1 to 6, additive
`KNNRegressor`         mean over the k nearest neighbours                          ``n_neighbors``     1 to 6, additive
`SeriesRegressor`      orthogonal series, polynomials                              ``terms``           1, additive
`SplineRegressor`      penalised cubic spline                                      ``penalty``         1, additive
=====================  ==========================================================  ==================  =================

A parameter that is None is chosen from the data; the scores of all values that were tried are then ``scores_``. With more
columns than a method takes, the model is additive: y = c + m_1(x_1) + m_2(x_2) + ..., by backfitting.
"""

from __future__ import annotations

from contextlib import suppress
from typing import Any, NamedTuple, Self, overload

import numpy as np
import numpy.typing as npt
from sklearn.base import BaseEstimator, RegressorMixin
from sklearn.utils.validation import _check_sample_weight, check_is_fitted, validate_data

from flexure._additive import Additive, Array, Term, columns_of
from flexure._arrays import plain
from flexure._core import FlexureError, ParameterError

__all__ = ["Band", "KNNRegressor", "KernelRegressor", "Scores", "SeriesRegressor", "SplineRegressor"]


class Scores(NamedTuple):
    """The scores of all values of a parameter that were tried."""

    criterion: str
    """The name of the score, for example "leave-one-out error"."""
    parameter: Array
    """The values, increasing."""
    score: Array
    """Their scores, in the squared unit of y; smaller is better."""
    at_edge: bool
    """Whether the best is the first or the last one where more could have been tried."""


class Band(NamedTuple):
    """A confidence band; NaN where there is none."""

    lower: Array
    """The lower limit, in the unit of y."""
    upper: Array
    """The upper limit, in the unit of y."""
    centre: Array
    """Its middle: the estimate corrected for its bias."""
    standard_error: Array
    """The standard error of the middle."""
    level: float
    """The nominal coverage."""
    method: str
    """How it was made, as a sentence."""


# The most points that whole-number weights stand for.
_MOST_REPEATED = 1_000_000


def _repetitions(weights: Array) -> bool:
    """Whether weights are numbers of repetitions, and not too many."""
    whole = np.all((weights >= 0) & (weights == np.floor(weights)))
    return bool(whole and 0 < np.sum(weights) <= _MOST_REPEATED)


class _Regressor(RegressorMixin, BaseEstimator):  # type: ignore[misc]
    """What the four have in common: the names of a method and of its parameter come from the class."""

    _most_columns = 1
    _parameter = ""
    # Whether the parameter may be one a column, and the names that it may be.
    _each = False
    _named_choices: tuple[str, ...] = ()

    def _method(self) -> tuple[str, dict[str, Any]]:
        """The estimator's name in the library, and its settings."""
        raise NotImplementedError

    def fit(self, X: npt.ArrayLike, y: npt.ArrayLike, sample_weight: npt.ArrayLike | None = None) -> Self:
        """Fits the regression.

        Parameters
        ----------
        X : array of shape (n, d)
            The points, in any unit; finite.
        y : array of shape (n,)
            The ordinates; finite.
        sample_weight : array of shape (n,), optional
            A point of weight 2 counts as two, one of weight 0 is not there. Whole numbers are repetitions also where the
            parameter is chosen (up to a million points in all); with other weights, and in ``flexure regress``, leave-one-out
            leaves a point out with all its weight.

        Raises
        ------
        ParameterError
            For a parameter outside its range, or one that asks for more than the data can tell.
        TooShortError
            For fewer points than the method needs.
        DataError
            For values so large or so small that their squares overflow or vanish.
        """
        points: Array
        points, y = validate_data(self, X, y, dtype=np.float64, order="F", y_numeric=True, ensure_min_samples=2)
        weights = None
        if sample_weight is not None:
            weights = _check_sample_weight(sample_weight, points, dtype=np.float64)
        if np.asarray(X).dtype.kind in "mM":
            raise TypeError("X holds instants or durations, but real numbers are needed")
        name, settings = self._method()
        for setting, value in settings.items():
            if not isinstance(value, str):
                raise ParameterError(f"{setting} is {value!r}, but must be a name")
        given = self._given(points.shape[1])
        repeated = weights is not None and given is None and _repetitions(weights)
        if weights is not None and repeated:
            repeats = weights.astype(np.intp)
            points, y, weights = points.repeat(repeats, axis=0), np.repeat(y, repeats), None
        x, y = columns_of(points), plain(y)
        if len(x) > self._most_columns:
            self._additive: Additive | None = Additive.fit(name, settings, x, y, weights, given, repeated)
            self._term: Term | None = None
            found = [t.core.parameter[0] for t in self._additive.terms.values()]
            self.scores_, self.left_out_error_ = None, None
        else:
            self._term = Term(name, settings, x, y, weights, given, repeated=repeated)
            self._additive = None
            core = self._term.core
            found = core.parameter
            self.scores_ = None if core.scores is None else Scores(**core.scores)
            self.left_out_error_ = core.left_out
        setattr(self, f"{self._parameter}_", self._shown(found))
        self._warnings: list[str] | None = None
        return self

    @property
    def warnings_(self) -> list[str]:
        """What to know before trusting the fit, a sentence each, as ``flexure regress`` says it; found when it is first asked for."""
        check_is_fitted(self)
        if self._warnings is None:
            if self._term is not None:
                self._warnings = self._term.core.warnings()
            else:
                assert self._additive is not None
                terms = self._additive.terms.items()
                self._warnings = [f"column {j}: {text}" for j, term in terms for text in term.core.warnings()]
        return self._warnings

    def __getstate__(self) -> dict[str, Any]:
        state = dict(super().__getstate__())
        if "_warnings" in state:
            # A refitted model has no scores, which some of the warnings need. Pickling also works if the data allow no diagnosis.
            with suppress(FlexureError):
                state["_warnings"] = self.warnings_
        return state

    def _given(self, columns: int) -> list[float] | None:
        """The parameter: a number, or one a column where the method takes that; None to choose it from the data."""
        given = getattr(self, self._parameter)
        if given is None or (isinstance(given, str) and given in self._named_choices):
            return None
        try:
            values = np.asarray(given)
            fits = values.dtype.kind in "iuf" and values.size and values.ndim <= (1 if self._each else 0)
        except ValueError:  # of lists of different lengths
            fits = False
        if not fits:
            raise ParameterError(f"{self._parameter} is {given!r}, but must be a number{' or one a column' * self._each}, or None")
        if values.ndim and values.size not in (1, columns):
            raise ParameterError(f"there are {values.size} values of {self._parameter} for {columns} column{'s' * (columns > 1)}")
        found: list[float] = np.atleast_1d(values.astype(np.float64)).tolist()
        return found

    def _shown(self, found: list[float]) -> Any:
        """A parameter as its attribute: one value, or an array of one a column."""
        return found[0] if len(found) == 1 else np.array(found)

    @overload
    def predict(self, X: npt.ArrayLike, *, return_band: None = None) -> Array: ...
    @overload
    def predict(
        self, X: npt.ArrayLike, *, return_band: float, simultaneous: bool = False, band_method: str = "auto"
    ) -> tuple[Array, Band]: ...
    def predict(
        self,
        X: npt.ArrayLike,
        *,
        return_band: float | None = None,
        simultaneous: bool = False,
        band_method: str = "auto",
    ) -> Array | tuple[Array, Band]:
        """The estimates at points, and a confidence band around m.

        Parameters
        ----------
        X : array of shape (n, d)
            The points.
        return_band : float, optional
            The band's level, 0.5 to 0.999, for example 0.95; the result is then a pair.
        simultaneous : bool
            A band that holds at all these points at once.
        band_method : {"auto", "robust", "bootstrap", "block", "none"}
            As in ``flexure regress --band-method``: robust bias correction for kernels in one column, else the wild
            bootstrap (up to 20,000 points unless it is named), "block" for rows in order of time.

        Returns
        -------
        array of shape (n,), or (array, Band)
            In the unit of y.
        """
        check_is_fitted(self)
        points: Array = validate_data(self, X, dtype=np.float64, order="F", reset=False)
        x = columns_of(points)
        if self._additive is not None:
            if return_band is not None:
                raise ParameterError("an additive model has no band; fit fewer columns, or take predict without return_band")
            return self._additive.predict(x)
        assert self._term is not None
        values = self._term.core.predict(x)
        if return_band is None:
            return values
        band = self._term.core.band(x, level=return_band, simultaneous=simultaneous, method=band_method)
        if band is None:
            nothing = np.full_like(values, np.nan)
            return values, Band(nothing, nothing, nothing, nothing, return_band, "none")
        return values, Band(**band)


class KernelRegressor(_Regressor):
    """Kernel regression, local linear (Fan 1993) or local constant (Nadaraya 1964, Watson 1964).

    Parameters
    ----------
    degree : {1, 0}
        The polynomial that is fitted around every point: 1 a line (a plane), 0 a constant.
    bandwidth : float, sequence of one a column, or "local", optional
        Half the width of the window in the unit of X (the Gaussian's standard deviation); positive. None: from the data.
        "local": of its own at every point of one column, following kinks and jumps (Lepski's rule, or ``rule="plugin"``), where
        that predicts clearly better than one bandwidth; a line is fitted.
    kernel : {"epanechnikov", "uniform", "triangular", "biweight", "triweight", "gaussian"}
        The weight function.
    rule : {"loo", "gcv", "block", "plugin", "bootstrap", "block-bootstrap"}
        How the bandwidth is chosen: leave-one-out, generalised cross-validation; "block" and "block-bootstrap" are for rows
        in order of time with dependent errors; "plugin" (local line) and the bootstraps are for one column.
    outside : {"nearest", "linear", "nan"}
        The estimate beyond the data's range.

    Attributes
    ----------
    bandwidth_ : float or array of shape (d,)
        Given or chosen.
    scores_ : Scores or None
        The scores of all bandwidths that were tried.
    left_out_error_ : float or None
        The mean squared leave-one-out error, in the squared unit of y.
    warnings_ : list of str
        What to know before trusting the fit, for example that the rows depend on their neighbours.

    Examples
    --------
    >>> import numpy as np
    >>> from flexure import KernelRegressor
    >>> rng = np.random.default_rng(1)
    >>> x = rng.uniform(-2, 2, 1000)
    >>> y = np.sin(x) + 0.1 * rng.normal(size=x.size)
    >>> estimate, band = KernelRegressor().fit(x[:, None], y).predict([[0.5]], return_band=0.95)
    >>> bool(band.lower[0] < np.sin(0.5) < band.upper[0])
    True
    """

    _most_columns = 6
    _parameter = "bandwidth"
    _each = True
    _named_choices = ("local",)

    def __init__(
        self,
        degree: int = 1,
        *,
        bandwidth: float | str | npt.ArrayLike | None = None,
        kernel: str = "epanechnikov",
        rule: str = "loo",
        outside: str = "nearest",
    ) -> None:
        self.degree = degree
        self.bandwidth = bandwidth
        self.kernel = kernel
        self.rule = rule
        self.outside = outside

    def _method(self) -> tuple[str, dict[str, Any]]:
        if self.degree not in (0, 1):
            raise ParameterError(f"the degree is {self.degree}, but must be 0 or 1")
        name = "local-linear" if self.degree == 1 else "kernel"
        if isinstance(self.bandwidth, str):
            if self.bandwidth != "local" or self.degree != 1:
                raise ParameterError("the bandwidth must be numbers, None, or with degree 1 'local'")
            name = "local-bandwidth"
        return name, {"kernel": self.kernel, "rule": self.rule, "outside": self.outside}


class KNNRegressor(_Regressor):
    """The mean over the k nearest neighbours (Stone 1977), ties shared.

    Parameters
    ----------
    n_neighbors : int, optional
        k, from 1 to the total weight. None: from the data.
    rule : {"loo", "gcv", "block"}
        How k is chosen.
    outside : {"nearest", "linear", "nan"}
        The estimate beyond the data's range.

    Attributes
    ----------
    n_neighbors_ : int
        Given or chosen.
    scores_, left_out_error_, warnings_
        As in `KernelRegressor`.

    Examples
    --------
    >>> import numpy as np
    >>> from flexure import KNNRegressor
    >>> rng = np.random.default_rng(1)
    >>> x = rng.uniform(-2, 2, 1000)
    >>> y = np.sin(x) + 0.1 * rng.normal(size=x.size)
    >>> model = KNNRegressor().fit(x[:, None], y)
    >>> model.score(x[:, None], y) > 0.97
    True
    """

    _most_columns = 6
    _parameter = "n_neighbors"

    def __init__(self, n_neighbors: int | None = None, *, rule: str = "loo", outside: str = "nearest") -> None:
        self.n_neighbors = n_neighbors
        self.rule = rule
        self.outside = outside

    def _method(self) -> tuple[str, dict[str, Any]]:
        return "knn", {"rule": self.rule, "outside": self.outside}

    def _shown(self, found: list[float]) -> Any:
        return int(found[0]) if len(found) == 1 else np.array(found, dtype=int)


class SeriesRegressor(_Regressor):
    """Regression by a series, by least squares.

    Parameters
    ----------
    basis : {"legendre", "fourier", "cosine", "hermite", "haar", "polynomial"}
        The functions.
    terms : int, optional
        Their number (1 to 256); for "haar" the levels (0 to 20), for "polynomial" the degree (0 to 64). None: from the data.
    rule : {"loo", "gcv", "block"}
        How their number is chosen.
    outside : {"nearest", "linear", "nan"}
        The estimate beyond the data's range.

    Attributes
    ----------
    terms_ : int or array
        Given or chosen.
    scores_, left_out_error_, warnings_
        As in `KernelRegressor`.

    Examples
    --------
    >>> import numpy as np
    >>> from flexure import SeriesRegressor
    >>> rng = np.random.default_rng(1)
    >>> x = rng.uniform(-2, 2, 1000)
    >>> y = np.sin(x) + 0.1 * rng.normal(size=x.size)
    >>> model = SeriesRegressor().fit(x[:, None], y)
    >>> model.score(x[:, None], y) > 0.97
    True
    """

    _parameter = "terms"

    def __init__(
        self, basis: str = "legendre", *, terms: int | None = None, rule: str = "loo", outside: str = "nearest"
    ) -> None:
        self.basis = basis
        self.terms = terms
        self.rule = rule
        self.outside = outside

    def _method(self) -> tuple[str, dict[str, Any]]:
        bases = ("legendre", "fourier", "cosine", "hermite", "haar", "polynomial")
        if self.basis not in bases:
            raise ParameterError(f"the basis is {self.basis!r}, but must be one of {', '.join(bases)}")
        return self.basis, {"rule": self.rule, "outside": self.outside}

    def _shown(self, found: list[float]) -> Any:
        return int(found[0]) if len(found) == 1 else np.array(found, dtype=int)


class SplineRegressor(_Regressor):
    """The penalised cubic spline (O'Sullivan 1986).

    Parameters
    ----------
    penalty : float, optional
        Zero or positive. None: from the data.
    rule : {"loo", "gcv", "block"}
        How the penalty is chosen.
    outside : {"nearest", "linear", "nan"}
        The estimate beyond the data's range.

    Attributes
    ----------
    penalty_ : float or array
        Given or chosen.
    scores_, left_out_error_, warnings_
        As in `KernelRegressor`.

    Examples
    --------
    >>> import numpy as np
    >>> from flexure import SplineRegressor
    >>> rng = np.random.default_rng(1)
    >>> x = rng.uniform(-2, 2, 1000)
    >>> y = np.sin(x) + 0.1 * rng.normal(size=x.size)
    >>> model = SplineRegressor().fit(x[:, None], y)
    >>> model.score(x[:, None], y) > 0.97
    True
    """

    _parameter = "penalty"

    def __init__(self, penalty: float | None = None, *, rule: str = "loo", outside: str = "nearest") -> None:
        self.penalty = penalty
        self.rule = rule
        self.outside = outside

    def _method(self) -> tuple[str, dict[str, Any]]:
        return "spline", {"rule": self.rule, "outside": self.outside}
