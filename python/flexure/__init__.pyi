from . import arms, joints, plots, regression, results, systems
from ._core import (
    DataError,
    FileError,
    FlexureError,
    ParameterError,
    SimulationError,
    TooShortError,
    __version__,
)
from .arms import Arm
from .joints import identify_joint
from .regression import KernelRegressor, KNNRegressor, SeriesRegressor, SplineRegressor
from .results import Branch, LinearPart, Nonlinearity, ResidualTest, Surface, Verdict
from .systems import (
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
