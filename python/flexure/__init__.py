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
from flexure.results import LinearPart, Nonlinearity, ResidualTest, Verdict
from flexure.systems import Auto, Hammerstein, HammersteinWiener, Wiener, WienerHammerstein, load

__all__ = [
    "Arm",
    "Auto",
    "DataError",
    "FileError",
    "FlexureError",
    "Hammerstein",
    "HammersteinWiener",
    "KNNRegressor",
    "KernelRegressor",
    "LinearPart",
    "Nonlinearity",
    "ParameterError",
    "ResidualTest",
    "SeriesRegressor",
    "SimulationError",
    "SplineRegressor",
    "TooShortError",
    "Verdict",
    "Wiener",
    "WienerHammerstein",
    "__version__",
    "identify_joint",
    "load",
]
