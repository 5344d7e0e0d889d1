"""The compiled part of Flexure: conversions around the Rust library."""

from collections.abc import Sequence
from os import PathLike
from typing import Any, final

import numpy as np
import numpy.typing as npt

type _Array = npt.NDArray[np.float64]

__all__ = [
    "Arm",
    "DataError",
    "FileError",
    "FlexureError",
    "Identification",
    "Joint",
    "Model",
    "ParameterError",
    "Regression",
    "SimulationError",
    "Structure",
    "TooShortError",
    "__version__",
    "identify_joint",
    "sample_time",
    "structures",
]

__version__: str

class FlexureError(ValueError): ...
class DataError(FlexureError): ...
class TooShortError(DataError): ...
class ParameterError(FlexureError): ...
class FileError(FlexureError): ...
class SimulationError(FlexureError): ...

def sample_time(times: _Array) -> float: ...
def identify_joint(
    torque: Sequence[_Array],
    link: Sequence[_Array],
    motor: Sequence[_Array],
    velocity: _Array | None,
    sample_time: float,
    *,
    motor_inertia: float | None = None,
    gravity: bool = False,
    spring: bool = False,
    prismatic: bool = False,
    level: float = 0.95,
) -> Joint: ...
@final
class Joint:
    def json(self) -> str: ...
    def page(self) -> str: ...
    def arm_file(self, joint: int = 0, template: str | None = None) -> str: ...

@final
class Regression:
    @staticmethod
    def fit(
        name: str,
        x: Sequence[_Array],
        y: _Array,
        weights: _Array | None = None,
        *,
        parameter: Sequence[float] | None = None,
        chosen: bool = False,
        repeated: bool = False,
        rule: str = "loo",
        kernel: str = "epanechnikov",
        outside: str = "nan",
        seed: int = 1,
    ) -> Regression: ...
    def predict(self, x: Sequence[_Array]) -> _Array: ...
    def band(
        self,
        x: Sequence[_Array],
        *,
        level: float = 0.95,
        simultaneous: bool = False,
        method: str = "auto",
        block: int | None = None,
    ) -> dict[str, Any] | None: ...
    def warnings(self) -> list[str]: ...
    @property
    def parameter(self) -> list[float]: ...
    @property
    def left_out(self) -> float | None: ...
    @property
    def scores(self) -> dict[str, Any] | None: ...

@final
class Structure:
    @property
    def name(self) -> str: ...
    @property
    def description(self) -> str: ...
    @property
    def several_inputs(self) -> bool: ...

def structures() -> list[Structure]: ...
@final
class Identification:
    def __new__(
        cls,
        inputs: Sequence[tuple[str, _Array]],
        output: tuple[str, _Array],
        sample_time: float | None,
        options: dict[str, Any],
        experiments: Sequence[int] | None = None,
    ) -> Identification: ...
    def json(self) -> str: ...
    def summary(self) -> str: ...
    def model(self) -> Model: ...
    def predicted(self) -> _Array: ...
    def page(self, command: str | None = None) -> str: ...

@final
class Model:
    @staticmethod
    def from_json(text: str) -> Model: ...
    @staticmethod
    def read(path: str | PathLike[str]) -> Model: ...
    def json(self) -> str: ...
    def write(self, path: str | PathLike[str]) -> None: ...
    @property
    def inputs(self) -> list[str]: ...
    def simulate(self, inputs: Sequence[_Array]) -> _Array: ...
    def predict(self, inputs: Sequence[_Array], output: _Array, horizon: int | None = None) -> _Array: ...
    def validate(self, inputs: Sequence[_Array], output: _Array, skip: int | None = None) -> str: ...

@final
class Arm:
    @staticmethod
    def presets() -> list[str]: ...
    @staticmethod
    def preset(name: str) -> Arm: ...
    @staticmethod
    def from_text(text: str, name: str = "the arm", folder: str = "") -> Arm: ...
    @staticmethod
    def read(path: str | PathLike[str]) -> Arm: ...
    @property
    def text(self) -> str: ...
    @property
    def name(self) -> str: ...
    @property
    def folder(self) -> str: ...
    @property
    def sample_time(self) -> float: ...
    @property
    def duration(self) -> float: ...
    def simulate(self, drive: tuple[_Array, _Array] | None = None, kind: str = "torque") -> dict[str, _Array]: ...
    def simulate_batch(
        self, drives: Sequence[tuple[_Array, _Array]], kind: str = "torque"
    ) -> list[dict[str, _Array]]: ...
