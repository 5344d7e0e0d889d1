"""Control of the two-link arm with flexible joints, and models that learn sample by sample.

`Scenario` compares controllers in one loop, as ``flexure control`` does. A linear system of python-control or SciPy, or any object that has
``A, B, C, D`` and ``dt``, takes part as a controller.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from os import PathLike
from pathlib import Path
from typing import Any, Protocol, Self

import numpy as np
import numpy.typing as npt

from flexure import _core
from flexure._arrays import plain, samples

__all__ = ["Cusum", "Result", "Results", "RecursiveFriction", "RecursiveHammerstein", "RecursiveLinear", "Scenario"]

Array = npt.NDArray[np.float64]


class StateSpace(Protocol):
    """A linear system: python-control's ``StateSpace``, SciPy's in that form."""

    A: Any
    B: Any
    C: Any
    D: Any
    dt: Any


class Result(dict[str, Any]):
    """The figures of a controller, as in the command's JSON, with `record`: the columns of its first run, or None."""

    record: dict[str, Array] | None


class Results:
    """What came out of a scenario: a `Result` for every controller, by its name or in order."""

    def __init__(self, core: _core.Controlled) -> None:
        self._core = core
        self._rows: list[Result] = []
        for i, figures in enumerate(json.loads(core.json())["results"]):
            row = Result(figures)
            row.record = core.record(i)
            self._rows.append(row)

    def __iter__(self) -> Iterator[Result]:
        return iter(self._rows)

    def __len__(self) -> int:
        return len(self._rows)

    def __getitem__(self, name: str | int) -> Result:
        if isinstance(name, int):
            return self._rows[name]
        for row in self._rows:
            if row["controller"] == name:
                return row
        raise KeyError(f"no controller '{name}'; there are: {', '.join(row['controller'] for row in self._rows)}")

    def summary(self) -> str:
        """The table, as the command prints it."""
        return self._core.summary()

    def __repr__(self) -> str:
        return self.summary()

    def save_page(self, path: str | PathLike[str]) -> None:
        """Writes the page with paths, errors, torques and the moving arm."""
        Path(path).write_text(self._core.page(), encoding="utf-8")


class Scenario:
    """An arm, what its controllers know, a motion, a loop and controllers, as in a scenario file.

    >>> from flexure.control import Scenario
    >>> results = Scenario.preset("rest-to-rest").compare()
    >>> results["pd two-hump-ei"]["residual_of_unshaped_percent"] < 5
    True
    """

    def __init__(self, core: _core.Scenario) -> None:
        if not isinstance(core, _core.Scenario):
            raise TypeError("a scenario is made by Scenario.preset(name), Scenario.from_toml(path) or Scenario.from_text(text)")
        self._core = core

    @classmethod
    def from_toml(cls, path: str | PathLike[str]) -> Self:
        """Reads a scenario file; errors say the line."""
        return cls(_core.Scenario.read(path))

    @classmethod
    def from_text(cls, text: str, folder: str | PathLike[str] = "") -> Self:
        """The text of a scenario file; arm files that it names are in `folder`."""
        return cls(_core.Scenario.from_text(text, folder))

    @classmethod
    def preset(cls, name: str) -> Self:
        """One of `Scenario.presets`, for example "square"."""
        return cls(_core.Scenario.preset(name))

    @staticmethod
    def presets() -> list[str]:
        """The names of the scenarios that come with Flexure."""
        return _core.Scenario.presets()

    @property
    def toml(self) -> str:
        """The text of the file, with its comments."""
        return self._core.text

    def compare(
        self,
        systems: Mapping[str, StateSpace] | None = None,
        *,
        seeds: int | None = None,
        feedforward: bool = True,
    ) -> Results:
        """Runs every controller of the scenario, and also linear systems.

        A system's inputs are the errors of both motors' angles in rad, with four inputs those of their velocities in rad/s behind
        them; its outputs are both torques in N m. One in continuous time is sampled at the loop's sample time, its inputs held. With
        `feedforward` the torque of the model's motion is added, and the errors are against that motion. Systems are given the true state.
        """
        brought = [_matrices(name, system, self._core.sample_time) for name, system in (systems or {}).items()]
        return Results(self._core.compare([(*matrices, feedforward) for matrices in brought], seeds))


def _matrices(name: str, system: StateSpace, step: float) -> tuple[str, Array, Array, Array, Array, bool]:
    """The matrices row by row, and whether they are in continuous time."""
    if not all(hasattr(system, matrix) for matrix in "ABCD"):
        raise _core.ParameterError(f"the system '{name}' has no A, B, C and D; make it a state space, as control.ss(system) does")
    dt: Any = getattr(system, "dt", None)
    continuous = dt is None or dt == 0
    # True is python-control's discrete time without a sample time.
    if not continuous and dt is not True and not np.isclose(dt, step, rtol=1e-9, atol=0):
        raise _core.ParameterError(f"the system '{name}' has a sample time of {dt} s, but the loop one of {step} s; sample it anew")
    outputs, inputs = np.atleast_2d(np.asarray(system.D)).shape
    if outputs != 2 or inputs not in (2, 4):
        raise _core.ParameterError(
            f"the system '{name}' has {outputs} outputs and {inputs} inputs; it must have 2 outputs, the torques of both motors, "
            "and 2 inputs, the errors of their angles, or 4 with those of their velocities"
        )
    a, b, c, d = (plain(np.atleast_2d(np.asarray(m))).ravel() for m in (system.A, system.B, system.C, system.D))
    return name, a, b, c, d, continuous


class RecursiveHammerstein:
    """A Hammerstein system that learns: a polynomial of the input, then a linear system.

    `forgetting` is how much a sample counts of the one after it, `drift` the variance of random steps of the parameters; without
    either, all samples count equally.
    """

    def __init__(
        self, order: int, degree: int = 3, *, delay: int = 0, forgetting: float | None = None, drift: float | None = None
    ) -> None:
        self._core = _core.RecursiveHammerstein(order, delay, degree, forgetting, drift)

    def push(self, u: npt.ArrayLike, y: npt.ArrayLike) -> None:
        """Takes a sample, or many in order."""
        self._core.push(samples(np.atleast_1d(u), "u"), samples(np.atleast_1d(y), "y"))

    @property
    def estimate(self) -> dict[str, Any] | None:
        """``a``, ``b``, ``powers`` and ``offset``; None as long as the samples do not determine them."""
        found = self._core.estimate()
        if found is None:
            return None
        a, b, powers, offset = found
        return {"a": np.array(a), "b": np.array(b), "powers": np.array(powers), "offset": offset}

    def to_bytes(self) -> bytes:
        """A checkpoint, from which `from_bytes` goes on."""
        return self._core.to_bytes()

    @classmethod
    def from_bytes(cls, data: bytes) -> Self:
        """The state of a checkpoint."""
        model = cls.__new__(cls)
        model._core = _core.RecursiveHammerstein.from_bytes(data)
        return model


class RecursiveLinear(RecursiveHammerstein):
    """A linear system that learns; ``b`` times ``powers`` is its numerator."""

    def __init__(
        self, order: int, *, delay: int = 0, forgetting: float | None = None, drift: float | None = None
    ) -> None:
        super().__init__(order, 1, delay=delay, forgetting=forgetting, drift=drift)


class RecursiveFriction:
    """Inertia, Coulomb and viscous friction of a joint that learn from torque and velocity."""

    def __init__(
        self,
        sample_time: float,
        *,
        reversal: float = 0.01,
        forgetting: float | None = None,
        drift: float | None = None,
    ) -> None:
        self._core = _core.RecursiveFriction(sample_time, reversal, forgetting, drift)

    def push(self, torque: npt.ArrayLike, velocity: npt.ArrayLike) -> Array:
        """Takes samples and returns the unpredicted part of each torque, for a `Cusum`. NaN where there was no prediction."""
        return np.array(self._core.push(samples(np.atleast_1d(torque), "torque"), samples(np.atleast_1d(velocity), "velocity")))

    @property
    def estimate(self) -> dict[str, float] | None:
        """``inertia``, ``coulomb``, ``viscous`` and ``offset``; None as long as the samples do not determine them."""
        found = self._core.estimate()
        return None if found is None else dict(zip(("inertia", "coulomb", "viscous", "offset"), found, strict=True))

    def to_bytes(self) -> bytes:
        """A checkpoint, from which `from_bytes` goes on."""
        return self._core.to_bytes()

    @classmethod
    def from_bytes(cls, data: bytes) -> Self:
        """The state of a checkpoint."""
        model = cls.__new__(cls)
        model._core = _core.RecursiveFriction.from_bytes(data)
        return model


class Cusum:
    """Finds a change of the mean of white noise by `change` standard deviations, with one false alarm in `quiet` samples on average."""

    def __init__(self, deviation: float, change: float = 1.0, *, quiet: float = 1e6) -> None:
        self._core = _core.Cusum(deviation, change, quiet)

    def push(self, x: npt.ArrayLike) -> list[tuple[int, bool]]:
        """Takes values; returns the places of alarms among them, and whether each is upwards."""
        return self._core.push(samples(np.atleast_1d(x), "x"))

    def to_bytes(self) -> bytes:
        """A checkpoint, from which `from_bytes` goes on."""
        return self._core.to_bytes()

    @classmethod
    def from_bytes(cls, data: bytes) -> Self:
        """The state of a checkpoint."""
        detector = cls.__new__(cls)
        detector._core = _core.Cusum.from_bytes(data)
        return detector

    @property
    def mean_delay(self) -> float:
        """The samples from a change to its alarm, on average."""
        return self._core.mean_delay
