"""Structures without blocks: what the blocks of others should come near to."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from flexure._system import System

Array = npt.NDArray[np.float64]


class NARX(System):
    """A polynomial of past outputs and inputs: a reference without blocks, to see what a model with blocks should come near to.

    ``terms_`` has the coefficients by their monomials, in inputs u and outputs y of mean 0 and variance 1; the one of ``""`` is the
    constant.

    Parameters
    ----------
    fresh : float
        The share of the record, at its end, that is not fitted; 0.05 to 0.9.
    robust : bool
        Whether outliers of the output are left out of the fit and of the verdict; else they are only named.
    missing : bool
        Whether outputs that are NaN are missing samples, which count neither in the fit nor in the verdict; else they are refused.

    Examples
    --------
    >>> import numpy as np
    >>> from flexure import NARX
    >>> rng = np.random.default_rng(1)
    >>> u = rng.uniform(-2, 2, 1500)
    >>> y = np.convolve(u, [0.0, 0.5, 0.25])[:1500] + 0.01 * rng.normal(size=u.size)
    >>> model = NARX().fit(u, y)
    >>> model.score(u, y) > 0.99
    True
    """

    _structure = "narx"

    @property
    def terms_(self) -> dict[str, float]:
        """The coefficients by monomial."""
        self._fitted()
        found = self.result_
        past = [f"y[n-{i + 1}]" for i in range(found["past_outputs"])]
        past += [f"u[n-{i}]" if i else "u[n]" for i in range(self.delay_, self.delay_ + found["past_inputs"])]
        terms = {" ".join(past[i] for i in term["factors"]): term["coefficient"] for term in found["terms"]}
        return {"": found["constant"], **terms}


class Volterra(System):
    """A Volterra series of second order with a prior of decay and smoothness: a reference without blocks.

    The output is ``constant_`` plus the sums of ``first_[i]`` u[n-d-i] and of ``second_[i, j]`` u[n-d-i] u[n-d-j], u being the input
    less ``input_level_`` and d ``delay_``.

    Parameters
    ----------
    fresh : float
        The share of the record, at its end, that is not fitted; 0.05 to 0.9.
    robust : bool
        Whether outliers of the output are left out of the fit and of the verdict; else they are only named.
    missing : bool
        Whether outputs that are NaN are missing samples, which count neither in the fit nor in the verdict; else they are refused.
    """

    _structure = "volterra"

    @property
    def constant_(self) -> float:
        """The kernel of order zero, in the unit of the output."""
        self._fitted()
        return float(self.result_["constant"])

    @property
    def input_level_(self) -> float:
        """The value that is subtracted from the input, in its unit."""
        self._fitted()
        return float(self.result_["input_level"])

    @property
    def first_(self) -> Array:
        """The kernel of first order, of shape (lags,)."""
        self._fitted()
        return np.array(self.result_["first"], dtype=np.float64)

    @property
    def second_(self) -> Array:
        """The kernel of second order, symmetric, of shape (lags, lags)."""
        self._fitted()
        found = np.array(self.result_["second"], dtype=np.float64)
        return found.reshape(len(found), len(found))
