"""Flexure: the nonlinear blocks inside systems, from input-output records.

See https://docs.rs/flexure for the methods; `flexure.regression` for static nonlinearities.
"""

from flexure._core import (
    DataError,
    FileError,
    FlexureError,
    ParameterError,
    SimulationError,
    TooShortError,
    __version__,
)
from flexure.arms import Arm
from flexure.joints import identify_joint
from flexure.regression import KernelRegressor, KNNRegressor, SeriesRegressor, SplineRegressor
from flexure.results import Branch, LinearPart, Nonlinearity, ResidualTest, Surface, Verdict
from flexure.systems import (
    NARX,
    Auto,
    Hammerstein,
    HammersteinWiener,
    JointInputs,
    MultipleInputs,
    Parallel,
    Volterra,
    Wiener,
    WienerHammerstein,
    estimator,
    load,
)

__all__ = [
    "NARX",
    "Arm",
    "Auto",
    "Branch",
    "DataError",
    "FileError",
    "FlexureError",
    "Hammerstein",
    "HammersteinWiener",
    "JointInputs",
    "KNNRegressor",
    "KernelRegressor",
    "LinearPart",
    "MultipleInputs",
    "Nonlinearity",
    "Parallel",
    "ParameterError",
    "ResidualTest",
    "SeriesRegressor",
    "SimulationError",
    "SplineRegressor",
    "Surface",
    "TooShortError",
    "Verdict",
    "Volterra",
    "Wiener",
    "WienerHammerstein",
    "__version__",
    "estimator",
    "identify_joint",
    "load",
]
