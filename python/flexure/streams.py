"""Kernel regression of records of any length: part after part, with bounded memory, on one machine or on many."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Self, overload

import numpy.typing as npt
from sklearn.base import BaseEstimator, RegressorMixin
from sklearn.utils.validation import check_is_fitted

from flexure._arrays import Array, samples
from flexure._core import ParameterError, Streamed, Sums
from flexure.regression import Band, Scores

__all__ = ["StreamedKernelRegressor"]


class StreamedKernelRegressor(RegressorMixin, BaseEstimator):  # type: ignore[misc]
    """Kernel regression of one column that takes a record in parts and keeps sums in bins, not the rows.

    Parts are taken in by `partial_fit`, on several machines too: `merge` brings the sums together, and the result is that of all rows,
    in any order in which they came (except for the last digits). The bandwidth is chosen, and the band made, from 20 folds of blocks of
    rows: rows may depend on their neighbours, as samples in time do.

    Parameters
    ----------
    degree : {1, 0}
        The polynomial that is fitted around every point: 1 a line, 0 a constant.
    bandwidth : float, optional
        Half the width of the window in the unit of X (the Gaussian's standard deviation); positive. None: from the data.
    kernel : {"epanechnikov", "uniform", "triangular", "biweight", "triweight", "gaussian"}
        The weight function.
    block : int
        Rows that stay together in a fold; much longer than the rows' dependence.
    most_bins : int
        Bins at most, 64 to 2^24; a bin takes 960 bytes.

    Attributes
    ----------
    bandwidth_ : float
        Given or chosen.
    scores_ : Scores or None
        The scores of all bandwidths that were tried.
    n_rows_ : int
        Rows that were taken in.
    bin_width_ : float
        The width of the bins, in the unit of X: structure that is narrower than some of them is not seen.

    Examples
    --------
    >>> import numpy as np
    >>> from flexure import StreamedKernelRegressor
    >>> rng = np.random.default_rng(1)
    >>> model = StreamedKernelRegressor()
    >>> for part in range(5):
    ...     x = rng.uniform(-2, 2, 10_000)
    ...     model = model.partial_fit(x, np.sin(x) + 0.1 * rng.normal(size=10_000))
    >>> bool(abs(model.predict([[1.0]])[0] - np.sin(1)) < 0.01)
    True
    """

    def __init__(
        self, degree: int = 1, *, bandwidth: float | None = None, kernel: str = "epanechnikov", block: int = 1000, most_bins: int = 1 << 15
    ) -> None:
        self.degree = degree
        self.bandwidth = bandwidth
        self.kernel = kernel
        self.block = block
        self.most_bins = most_bins

    def fit(self, X: npt.ArrayLike, y: npt.ArrayLike) -> Self:
        """Takes in these rows and no others."""
        self.__dict__.pop("_sums", None)
        return self.partial_fit(X, y)

    def partial_fit(self, X: npt.ArrayLike, y: npt.ArrayLike, *, first_row: int | None = None) -> Self:
        """Takes in further rows.

        Parameters
        ----------
        X : array of shape (n,) or (n, 1)
            The abscissas; finite.
        y : array of shape (n,)
            The ordinates; finite.
        first_row : int, optional
            The place of the first row in the whole record, counted from 0. None: behind those that were taken in.

        Raises
        ------
        DataError
            For values that are not finite, with their place; none of these rows was taken in then.
        ParameterError
            For a parameter outside its range.
        """
        sums: Sums = self.__dict__.get("_sums") or Sums.empty(self.most_bins, self.block)
        sums.push(sums.count if first_row is None else first_row, samples(X, "x"), samples(y, "y"))
        return self._with(sums)

    def merge(self, *others: StreamedKernelRegressor) -> Self:
        """Takes in what others have taken in.

        Raises
        ------
        DataError
            Where `block` or `most_bins` differ.
        """
        for other in others:
            check_is_fitted(other, "_sums")
        sums: Sums = self.__dict__.get("_sums") or Sums.empty(self.most_bins, self.block)
        sums.merge([other._sums for other in others])
        return self._with(sums)

    def to_bytes(self) -> bytes:
        """The sums as bytes, from which `from_bytes` makes the same sums on any machine."""
        check_is_fitted(self, "_sums")
        return self._sums.to_bytes()

    def from_bytes(self, parts: bytes | Sequence[bytes]) -> Self:
        """Takes in the sums of `to_bytes`, of one part or of several, in their order; what was taken in before is forgotten."""
        parts = [parts] if isinstance(parts, bytes) else list(parts)
        sums = Sums.empty(self.most_bins, self.block)
        for part in parts:
            sums.merge([Sums.from_bytes(part)])
        return self._with(sums)

    def _with(self, sums: Sums) -> Self:
        self.n_features_in_ = 1
        self._sums = sums
        self._fit: Streamed | None = None
        return self

    @property
    def _fitted(self) -> Streamed:
        """The regression, made when it is first asked for."""
        check_is_fitted(self, "_sums")
        if self._fit is None:
            if self.degree not in (0, 1):
                raise ParameterError(f"the degree is {self.degree}, but must be 0 or 1")
            self._fit = self._sums.fit(self.kernel, self.degree, self.bandwidth)
        return self._fit

    @property
    def bandwidth_(self) -> float:
        """The bandwidth, given or chosen, in the unit of X."""
        return self._fitted.bandwidth

    @property
    def scores_(self) -> Scores | None:
        """The scores of all bandwidths that were tried; None where it was given."""
        scores = self._fitted.scores
        return None if scores is None else Scores(**scores)

    @property
    def n_rows_(self) -> int:
        """Rows that were taken in."""
        check_is_fitted(self, "_sums")
        return self._sums.count

    @property
    def bin_width_(self) -> float:
        """The width of the bins, in the unit of X."""
        return self._fitted.bin_width

    @property
    def range_(self) -> tuple[float, float]:
        """The range of X, in which the estimate is known."""
        return self._fitted.range

    @overload
    def predict(self, X: npt.ArrayLike, *, return_band: None = None) -> Array: ...
    @overload
    def predict(self, X: npt.ArrayLike, *, return_band: float) -> tuple[Array, Band]: ...
    def predict(self, X: npt.ArrayLike, *, return_band: float | None = None) -> Array | tuple[Array, Band]:
        """The estimates at points, and a pointwise confidence band around m.

        Parameters
        ----------
        X : array of shape (n,) or (n, 1)
            The points; the estimate is NaN where no rows are in reach.
        return_band : float, optional
            The band's level, for example 0.95; the result is then a pair.

        Returns
        -------
        array of shape (n,), or (array, Band)
            In the unit of y.
        """
        check_is_fitted(self, "_sums")
        x = samples(X, "x")
        values = self._fitted.predict(x)
        return values if return_band is None else (values, Band(**self._fitted.band(x, return_band)))

    def __getstate__(self) -> dict[str, Any]:
        state = dict(super().__getstate__())
        if "_sums" in state:
            state |= {"_sums": self.to_bytes(), "_fit": None}
        return state

    def __setstate__(self, state: dict[str, Any]) -> None:
        super().__setstate__(state)
        if isinstance(self.__dict__.get("_sums"), bytes):
            self._sums = Sums.from_bytes(self.__dict__["_sums"])
