from . import arms, axes, chains, comparing, control, flexible_arms, joints, plots, prepare, records, regression, results, streams, systems
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
from .chains import Chain
from .comparing import ModelComparison, compare
from .axes import identify_axes
from .flexible_arms import FlexibleArm
from .joints import identify_joint
from .records import read
from .regression import KernelRegressor, KNNRegressor, SeriesRegressor, SplineRegressor
from .results import Branch, Comparison, Estimate, FormTest, LinearPart, Nonlinearity, ResidualTest, Surface, Verdict
from .streams import StreamedKernelRegressor
from .systems import (
    NARX,
    Auto,
    Feedback,
    Hammerstein,
    HammersteinWiener,
    JointInputs,
    Linear,
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
    "Chain",
    "Comparison",
    "DataError",
    "Estimate",
    "Feedback",
    "FileError",
    "FlexibleArm",
    "FlexureError",
    "FormTest",
    "Hammerstein",
    "HammersteinWiener",
    "JointInputs",
    "KNNRegressor",
    "KernelRegressor",
    "Linear",
    "LinearPart",
    "ModelComparison",
    "MultipleInputs",
    "Nonlinearity",
    "Parallel",
    "ParameterError",
    "ResidualTest",
    "SeriesRegressor",
    "SimulationError",
    "SplineRegressor",
    "StreamedKernelRegressor",
    "Surface",
    "TooShortError",
    "Verdict",
    "Volterra",
    "Wiener",
    "WienerHammerstein",
    "__version__",
    "compare",
    "estimator",
    "identify_axes",
    "identify_joint",
    "load",
    "read",
]
