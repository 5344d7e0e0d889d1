"""Block-oriented systems from one input to one output: identified, simulated, predicted, judged.

=========================  ==============================================  =============================================
estimator                  blocks, in the signal's order                   results
=========================  ==============================================  =============================================
`Hammerstein`              static, linear                                  ``nonlinearity_``, ``linear_``
`Wiener`                   linear, static                                  ``linear_``, ``nonlinearity_``
`WienerHammerstein`        linear, static, linear                          ``front_``, ``nonlinearity_``, ``back_``
`HammersteinWiener`        static, linear, static                          ``nonlinearity_``, ``linear_``, ``output_nonlinearity_``
`Auto`                     those of the structure that the data support    ``structure_``, ``comparison_`` and its blocks
=========================  ==============================================  =============================================

Nothing has to be given but the record: orders, delay, noise model and the nonlinearity's shape come from the data.
"""

from __future__ import annotations

import json
from os import PathLike

from flexure._core import Model
from flexure._system import System

__all__ = ["EXPECTED_FAILED_CHECKS", "Auto", "Hammerstein", "HammersteinWiener", "System", "Wiener", "WienerHammerstein", "load"]

_SHAPE = "the check's X has several columns and few rows in no order; a system has one input, sampled in time, at least 100 times"
_WORDS = "the error is said in terms of signals and samples, not of features"
_FAILING = {
    _SHAPE: (
        "check_array_api_input check_dict_unchanged check_dont_overwrite_parameters check_dtype_object check_estimator_sparse_tag "
        "check_estimators_dtypes check_estimators_fit_returns_self check_estimators_overwrite_params check_estimators_pickle "
        "check_f_contiguous_array_estimator check_fit2d_predict1d check_fit_check_is_fitted check_fit_idempotent "
        "check_fit_score_takes_y check_methods_sample_order_invariance check_methods_subset_invariance check_n_features_in "
        "check_n_features_in_after_fitting check_pipeline_consistency check_positive_only_tag_during_fit "
        "check_readonly_memmap_input"
    ),
    _WORDS: (
        "check_complex_data check_estimator_sparse_array check_estimator_sparse_matrix check_estimators_empty_data_messages "
        "check_estimators_nan_inf check_fit2d_1feature check_fit2d_1sample"
    ),
}
EXPECTED_FAILED_CHECKS = {check: reason for reason, checks in _FAILING.items() for check in checks.split()}
"""The checks of scikit-learn's ``check_estimator`` that a dynamic model cannot pass, with the reasons."""


class Hammerstein(System):
    """A static nonlinearity, then linear dynamics.

    Parameters
    ----------
    method : {"refined", "plain"}
        Prediction error over both blocks, with breakpoints, noise model and standard errors from the data; or the paper's
        kernel regression and correlation.
    order, delay : int, optional
        Of the linear part; None: from the data.
    unit : {"static-gain", "first-coefficient"}
        The convention for the scale between the blocks.
    known : ((x, phi), (x, phi)), optional
        Two points of the nonlinearity that are known; they fix scale and offset in place of `unit`.
    fresh : float
        The share of the record, at its end, kept from the fit; 0.05 to 0.9.
    form : str, optional
        A physical form to fit to the nonlinearity and to test: "dead-zone", "saturation", "quantizer", "polynomial:N",
        "friction" or "stiffness"; the result is ``result_["form"]``. For the refined method.
    missing : bool
        Whether outputs that are NaN are missing samples. For the refined method.
    noise_model : bool
        Whether the noise is whitened by an autoregression. For the refined method.
    nonlinearity : str
        The estimator of the nonlinearity (refined: where it starts): "kernel", "local-linear", "local-bandwidth", "knn",
        "fourier", "cosine", "legendre", "hermite", "haar", "polynomial", "spline", "network" or "recursive".
    kernel : str
        Its weight function, where it has one. For the plain method.
    parameter : float, optional
        Its parameter; None: from the data. For the plain method.
    lag : int, optional
        The lag of the regression of output on input; None: that of the strongest dependence. For the plain method.
    ignore_colour : bool
        Treat the input as white even where it is not. For the plain method.
    """

    _structure = "hammerstein"

    def __init__(
        self,
        *,
        method: str = "refined",
        order: int | None = None,
        delay: int | None = None,
        unit: str = "static-gain",
        known: tuple[tuple[float, float], tuple[float, float]] | None = None,
        fresh: float = 0.25,
        form: str | None = None,
        missing: bool = False,
        noise_model: bool = True,
        nonlinearity: str = "kernel",
        kernel: str = "epanechnikov",
        parameter: float | None = None,
        lag: int | None = None,
        ignore_colour: bool = False,
    ) -> None:
        super().__init__(fresh=fresh)
        self.method = method
        self.order = order
        self.delay = delay
        self.unit = unit
        self.known = known
        self.form = form
        self.missing = missing
        self.noise_model = noise_model
        self.nonlinearity = nonlinearity
        self.kernel = kernel
        self.parameter = parameter
        self.lag = lag
        self.ignore_colour = ignore_colour


class Wiener(System):
    """Linear dynamics, then a static nonlinearity, which may be even or not invertible.

    Parameters
    ----------
    fresh : float
        The share of the record, at its end, kept from the fit; 0.05 to 0.9.
    """

    _structure = "wiener"


class WienerHammerstein(System):
    """Linear dynamics, a static nonlinearity, linear dynamics.

    Parameters
    ----------
    fresh : float
        The share of the record, at its end, kept from the fit; 0.05 to 0.9.
    """

    _structure = "wiener-hammerstein"


class HammersteinWiener(System):
    """A static nonlinearity, linear dynamics, a static nonlinearity.

    Parameters
    ----------
    fresh : float
        The share of the record, at its end, kept from the fit; 0.05 to 0.9.
    """

    _structure = "hammerstein-wiener"


class Auto(System):
    """The structure that the data support: linear, Hammerstein, Wiener, Wiener-Hammerstein, or none of them.

    ``comparison_`` says what refutes the others.

    Parameters
    ----------
    fresh : float
        The share of the record, at its end, kept from the fit; 0.05 to 0.9.
    """

    _structure = "auto"


def load(path: str | PathLike[str]) -> System:
    """The model out of a model file, as an estimator of its structure (`Auto` for structures without one of their own)."""
    model = Model.read(path)
    structure = json.loads(model.json())["structure"]
    classes = {c._structure: c for c in (Hammerstein, Wiener, WienerHammerstein, HammersteinWiener)}
    return classes.get(structure, Auto)._of(model)
