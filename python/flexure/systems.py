"""Block-oriented systems: identified, simulated, predicted, judged.

=========================  ==============================================  =============================================
estimator                  blocks, in the signal's order                   results
=========================  ==============================================  =============================================
`Hammerstein`              static, linear                                  ``nonlinearity_``, ``linear_``
`Wiener`                   linear, static                                  ``linear_``, ``nonlinearity_``
`WienerHammerstein`        linear, static, linear                          ``front_``, ``nonlinearity_``, ``back_``
`HammersteinWiener`        static, linear, static                          ``nonlinearity_``, ``linear_``, ``output_nonlinearity_``
`Feedback`                 linear, with a static in a feedback loop        ``nonlinearity_``
`Auto`                     those of the structure that the data support    ``structure_``, ``comparison_`` and its blocks
`Parallel`                 a sum of cascades from one input                ``branches_``
`MultipleInputs`           a sum of Hammerstein systems, one an input      ``branches_``
`JointInputs`              one static of all inputs, linear                ``nonlinearity_`` (a `Surface`), ``linear_``
`Linear`                   linear                                          ``linear_``
`NARX`, `Volterra`         none: what blocks should come near to           ``terms_``; ``first_``, ``second_``
=========================  ==============================================  =============================================

Nothing has to be given but the record: orders, delay, noise model and the nonlinearity's shape come from the data.
"""

from __future__ import annotations

import json
from inspect import signature
from os import PathLike
from typing import Any

from flexure._core import Model, ParameterError, Structure, structures
from flexure._references import NARX, Volterra
from flexure._scikit_checks import EXPECTED_FAILED_CHECKS
from flexure._system import System

__all__ = [
    "EXPECTED_FAILED_CHECKS",
    "NARX",
    "Auto",
    "Feedback",
    "Hammerstein",
    "HammersteinWiener",
    "JointInputs",
    "Linear",
    "MultipleInputs",
    "Parallel",
    "System",
    "Volterra",
    "Wiener",
    "WienerHammerstein",
    "estimator",
    "load",
]

# The parameters of a Hammerstein system that one method alone has.
_OWN = {"plain": ("kernel", "parameter", "lag", "ignore_colour"), "refined": ("form", "noise_model")}


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
        The share of the record, at its end, that is not fitted; 0.05 to 0.9.
    robust : bool
        Whether outliers of the output are left out of the fit and of the verdict; else they are only named.
    missing : bool
        Whether outputs that are NaN are missing samples, which count neither in the fit nor in the verdict; else they are refused.
    form : str, optional
        A physical form to fit to the nonlinearity and to test: "dead-zone", "saturation", "limited-dead-zone", "quantizer", "polynomial:N",
        "friction" or "stiffness"; the result is ``result_["form"]``. For the refined method.
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

    Examples
    --------
    >>> import numpy as np
    >>> from flexure import Hammerstein
    >>> rng = np.random.default_rng(1)
    >>> u = rng.uniform(-2, 2, 1500)
    >>> y = np.convolve(np.clip(u, -1, 1), [0.0, 0.5, 0.25])[:1500] + 0.01 * rng.normal(size=u.size)
    >>> model = Hammerstein().fit(u, y, dt=0.01)
    >>> model.verdict_.holds, model.delay_
    (True, 1)
    >>> kinks = [at for at, kind in model.nonlinearity_.breakpoints]
    >>> np.allclose(kinks, [-1, 1], atol=0.02)
    True
    >>> predicted = model.simulate(u)
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
        robust: bool = False,
    ) -> None:
        super().__init__(fresh=fresh, robust=robust, missing=missing)
        self.method = method
        self.order = order
        self.delay = delay
        self.unit = unit
        self.known = known
        self.form = form
        self.noise_model = noise_model
        self.nonlinearity = nonlinearity
        self.kernel = kernel
        self.parameter = parameter
        self.lag = lag
        self.ignore_colour = ignore_colour

    def _options(self) -> dict[str, Any]:
        """The options for the library. An option that the method does not have must not be set."""
        options = super()._options()
        for method, names in _OWN.items():
            for name in names if options["method"] in _OWN.keys() - {method} else ():
                if getattr(self, name) != signature(type(self)).parameters[name].default:
                    raise ParameterError(f"{name} is for method='{method}', but the method is '{options['method']}'")
        return options


class Linear(System):
    """Linear dynamics alone, of one input or several: what every nonlinear model should be better than.

    Poles, delays and numerators are those of the smallest order that predicts held-back data as well as the best order.

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
    >>> from flexure import Linear
    >>> rng = np.random.default_rng(1)
    >>> u = rng.uniform(-2, 2, 1500)
    >>> y = np.convolve(u, [0.0, 0.5, 0.25])[:1500] + 0.01 * rng.normal(size=u.size)
    >>> model = Linear().fit(u, y)
    >>> model.verdict_.holds, round(model.linear_.static_gain, 2)
    (True, 0.75)
    """

    _structure = "linear"


class Wiener(System):
    """Linear dynamics, then a static nonlinearity, which may be even or not invertible.

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
    >>> from flexure import Wiener
    >>> rng = np.random.default_rng(1)
    >>> u = rng.uniform(-2, 2, 1500)
    >>> y = np.tanh(np.convolve(u, [0.6, 0.4])[:1500]) + 0.01 * rng.normal(size=u.size)
    >>> model = Wiener().fit(u, y)
    >>> bool(abs(model.nonlinearity_(0.3) - np.tanh(0.3)) < 0.02)
    True
    """

    _structure = "wiener"


class WienerHammerstein(System):
    """Linear dynamics, a static nonlinearity, linear dynamics.

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
    >>> from flexure import WienerHammerstein
    >>> rng = np.random.default_rng(1)
    >>> u = rng.uniform(-2, 2, 1500)
    >>> x = np.tanh(np.convolve(u, [0.7, 0.3])[:1500])
    >>> y = np.convolve(x, [0.8, 0.2])[:1500] + 0.01 * rng.normal(size=u.size)
    >>> model = WienerHammerstein().fit(u, y)
    >>> model.score(u, y) > 0.99
    True
    """

    _structure = "wiener-hammerstein"


class HammersteinWiener(System):
    """A static nonlinearity, linear dynamics, a static nonlinearity.

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
    >>> from flexure import HammersteinWiener
    >>> rng = np.random.default_rng(1)
    >>> u = rng.uniform(-2, 2, 1500)
    >>> y = np.tanh(np.convolve(np.clip(u, -1, 1), [0.7, 0.3])[:1500]) + 0.01 * rng.normal(size=u.size)
    >>> model = HammersteinWiener().fit(u, y)
    >>> model.score(u, y) > 0.99
    True
    """

    _structure = "hammerstein-wiener"


class Feedback(System):
    """Linear dynamics with a static nonlinearity in a feedback loop: friction on a velocity, a spring on an angle.

    ``nonlinearity_`` gives, at z, the constant input that holds the entering signal at the value z, if a constant passes around the loop
    (``result_["convention"]`` is then "holding-input"). ``result_["entering"]`` says what enters it: "output", "difference" (of the
    output, from sample to sample) or "hidden". ``result_["state_space"]`` is the linear part; ``result_`` has its transfer functions too:
    "input_to_output", "nonlinearity_to_output", "input_to_nonlinearity" and, from the nonlinearity back to itself, "around".

    Parameters
    ----------
    fresh : float
        The share of the record, at its end, that is not fitted; 0.05 to 0.9.
    robust : bool
        Whether outliers of the output are left out of the fit and of the verdict; else they are only named.
    missing : bool
        Whether outputs that are NaN are missing samples, which count neither in the fit nor in the verdict; else they are refused.
    """

    _structure = "feedback"


class Auto(System):
    """The structure that the data support, linear to parallel branches and loops; or none of them. Takes one input or several.

    ``comparison_`` says what refutes the others.

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
    >>> from flexure import Auto
    >>> rng = np.random.default_rng(1)
    >>> u = rng.uniform(-2, 2, 1500)
    >>> y = np.convolve(np.clip(u, -1, 1), [0.0, 0.5, 0.25])[:1500] + 0.01 * rng.normal(size=u.size)
    >>> model = Auto().fit(u, y)
    >>> model.comparison_.supported, model.comparison_.best
    (True, 'hammerstein')
    """

    _structure = "auto"


class Parallel(System):
    """A sum of branches from one input: each a static nonlinearity and linear dynamics, with linear dynamics before it if needed.

    The record determines the branches' sum; parts of it can be moved from one branch to another.

    Parameters
    ----------
    branches : int, optional
        Their number, 1 to 5; None: up to 3, from the data.
    fresh : float
        The share of the record, at its end, that is not fitted; 0.05 to 0.9.
    robust : bool
        Whether outliers of the output are left out of the fit and of the verdict; else they are only named.
    missing : bool
        Whether outputs that are NaN are missing samples, which count neither in the fit nor in the verdict; else they are refused.
    """

    _structure = "parallel"

    def __init__(self, *, branches: int | None = None, fresh: float = 0.25, robust: bool = False, missing: bool = False) -> None:
        super().__init__(fresh=fresh, robust=robust, missing=missing)
        self.branches = branches


class MultipleInputs(System):
    """Several inputs, each through a static nonlinearity and linear dynamics of its own; the branches add up.

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
    >>> from flexure import MultipleInputs
    >>> rng = np.random.default_rng(1)
    >>> u = rng.uniform(-2, 2, 1500)
    >>> v = rng.uniform(-2, 2, 1500)
    >>> y = np.clip(u, -1, 1) + np.convolve(np.abs(v), [0.0, 0.5])[:1500] + 0.01 * rng.normal(size=u.size)
    >>> model = MultipleInputs().fit(np.column_stack([u, v]), y)
    >>> model.score(np.column_stack([u, v]), y) > 0.99
    True
    """

    _structure = "multiple-inputs"


class JointInputs(System):
    """Two to four inputs into one static nonlinearity of all of them, then linear dynamics.

    Parameters
    ----------
    fresh : float
        The share of the record, at its end, that is not fitted; 0.05 to 0.9.
    robust : bool
        Whether outliers of the output are left out of the fit and of the verdict; else they are only named.
    missing : bool
        Whether outputs that are NaN are missing samples, which count neither in the fit nor in the verdict; else they are refused.
    """

    _structure = "joint-inputs"


def _generated(structure: Structure) -> type[System]:
    """A class of a structure that has only its blocks."""
    name = "".join(word.capitalize() for word in structure.name.split("-"))
    text = f"""{structure.description[:1].upper()}{structure.description[1:]}.

    Parameters
    ----------
    fresh : float
        The share of the record, at its end, that is not fitted; 0.05 to 0.9.
    robust : bool
        Whether outliers of the output are left out of the fit and of the verdict; else they are only named.
    missing : bool
        Whether outputs that are NaN are missing samples, which count neither in the fit nor in the verdict; else they are refused.
    """
    own = {"__doc__": text, "__module__": __name__, "_structure": structure.name}
    return type(name, (System,), own)


_CLASSES: dict[str, type[System]] = {
    c._structure: c
    for c in (
        Auto,
        Linear,
        Hammerstein,
        Wiener,
        WienerHammerstein,
        HammersteinWiener,
        Feedback,
        Parallel,
        MultipleInputs,
        JointInputs,
        NARX,
        Volterra,
    )
}
for _structure in structures():
    if _structure.name not in _CLASSES:
        _class = _CLASSES[_structure.name] = _generated(_structure)
        globals()[_class.__name__] = _class


def estimator(structure: str) -> type[System]:
    """The class that identifies systems of this structure, by the name that ``flexure identify --structure`` takes."""
    if structure not in _CLASSES:
        raise ParameterError(f"there is no structure '{structure}'; the structures are {', '.join(_CLASSES)}")
    return _CLASSES[structure]


def load(path: str | PathLike[str]) -> System:
    """The model out of a model file, as an estimator of its structure."""
    model = Model.read(path)
    return estimator(json.loads(model.json())["structure"])._of(model)
