"""Two-link arms with flexible joints: from an arm file or a preset to records."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from os import PathLike
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from flexure import _core
from flexure._arrays import samples
from flexure._core import DataError, TooShortError

__all__ = ["Arm"]

Array = npt.NDArray[np.float64]


class Arm:
    """A two-link arm with its initial state, its run and its excitation.

    Take it from an arm file or a preset: `Arm.from_toml`, `Arm.preset`. The records that it simulates are dicts of columns,
    in s, N m, rad and rad/s, one value an instant: ``t, tau1, tau2, q1, q2, qm1, qm2, dq1, dq2, dqm1, dqm2`` (a rigid arm's
    have no ``qm``, ``dqm``); the torque of an instant is held until the next. ``pandas.DataFrame(record)`` and
    ``polars.DataFrame(record)`` make frames of them.
    """

    def __init__(self, core: _core.Arm) -> None:
        if not isinstance(core, _core.Arm):
            raise TypeError("an arm is made by Arm.preset(name), Arm.from_toml(path) or Arm.from_text(text)")
        self._core = core

    @classmethod
    def from_toml(cls, path: str | PathLike[str], *, allow_paths: bool = False) -> Self:
        """Reads an arm file; errors say the line.

        Parameters
        ----------
        path : path
            The file.
        allow_paths : bool
            Whether its excitation may name a record anywhere, not only in the file's own folder and below: for a file that you trust.
            An error about such a record quotes none of its content.

        Raises
        ------
        FileError
            The file cannot be read.
        FlexureError
            A key or a value in it is wrong.
        """
        return cls(_core.Arm.read(path, allow_paths))

    @classmethod
    def from_text(cls, text: str) -> Self:
        """The text of an arm file."""
        return cls(_core.Arm.from_text(text))

    @classmethod
    def preset(cls, name: str) -> Self:
        """One of `Arm.presets`, for example "space-arm"."""
        return cls(_core.Arm.preset(name))

    @staticmethod
    def presets() -> list[str]:
        """The names of the arms that come with Flexure."""
        return _core.Arm.presets()

    @property
    def toml(self) -> str:
        """The text of the arm file, with its comments, to be edited."""
        return self._core.text

    def to_toml(self, path: str | PathLike[str]) -> None:
        """Writes the arm file, for `from_toml` and ``flexure simulate``."""
        with open(path, "w", encoding="utf-8") as file:
            file.write(self.toml)

    @property
    def dt(self) -> float:
        """The run's sample time, s."""
        return self._core.sample_time

    @property
    def duration(self) -> float:
        """The run's duration, s."""
        return self._core.duration

    def with_(
        self,
        *,
        duration: float | None = None,
        dt: float | None = None,
        model: str | None = None,
        joints: Sequence[Mapping[str, Any]] | None = None,
        links: Sequence[Mapping[str, Any]] | None = None,
        initial: Mapping[str, Any] | None = None,
        excitation: Mapping[str, Any] | None = None,
        noise: Mapping[str, Any] | bool | None = None,
    ) -> Self:
        """The arm with other values; the arm itself stays as it is, and so do the comments of its file.

        Parameters
        ----------
        duration, dt : float, optional
            Of the run, s.
        model : {"rigid", "linear", "nonlinear"}, optional
            Of the joints.
        joints, links : two dicts, optional
            The keys to change in the joints and links of the arm file; a key whose value is None is taken out.
        initial : dict, optional
            The keys to change in the state at the start.
        excitation : dict, optional
            The new excitation, as a whole.
        noise : dict or False, optional
            The new noise, as a whole; False for none.

        Raises
        ------
        FlexureError
            A key or a value that an arm file cannot have.

        Examples
        --------
        >>> from flexure import Arm
        >>> arm = Arm.preset("space-arm").with_(
        ...     duration=20.0,
        ...     dt=0.002,
        ...     joints=[{"locked": True}, {}],
        ...     excitation={"kind": "multisine", "amplitude": [40.0, 20.0], "f_min": 0.05, "f_max": 3.0},
        ...     noise={"std": {"q2": 1e-5, "qm2": 1e-5}},
        ... )
        >>> arm
        <Arm, 20 s in steps of 0.002 s>
        """
        run = {"duration": duration, "sample_time": dt}
        parts = {"model": model, "joint": joints, "link": links}
        tables = {
            "run": {key: value for key, value in run.items() if value is not None},
            "arm": {key: value for key, value in parts.items() if value is not None},
            "initial": initial,
            "excitation": excitation,
            "noise": noise,
        }
        changes = {name: table for name, table in tables.items() if table}
        if noise is False:
            changes["noise"] = None
        try:
            text = json.dumps(changes, default=_plain, allow_nan=False)
        except (TypeError, ValueError) as error:
            raise _core.ParameterError(f"an arm file cannot have these values: {error}") from None
        return type(self)(self._core.changed(text))

    def simulate(self, torque: Any = None, *, deflection: Any = None) -> dict[str, Array]:
        """Simulates the run of the arm file, or one under other inputs in place of its excitation.

        Parameters
        ----------
        torque : array of shape (n, 2), optional
            Motor torques, N m, one row an instant, held until the next.
        deflection : array of shape (n, 2), optional
            Commanded deflections of the joints, rad, in place of torques.

        Returns
        -------
        dict of arrays of shape (n,)
            The record. Without inputs n is duration / dt + 1.

        Raises
        ------
        SimulationError
            The motion grows without bound, or needs too many steps.
        """
        given = {"torque": torque, "deflection": deflection}
        drives = {kind: value for kind, value in given.items() if value is not None}
        if len(drives) > 1:
            raise _core.ParameterError("give torque or deflection, not both")
        for kind, value in drives.items():
            return self._core.simulate(_pair(value, kind), kind)
        return self._core.simulate()

    def simulate_batch(self, torques: Iterable[Any], *, kind: str = "torque", first: int = 0) -> list[dict[str, Array]]:
        """Simulates under many inputs, over all cores; the records are in the order of the inputs.

        Parameters
        ----------
        torques : sequence of arrays of shape (n, 2), or one array of shape (m, n, 2)
            The inputs, as in `simulate`.
        kind : {"torque", "deflection"}
            What they are.
        first : int
            The place of the first input among all, where these are a part of them.

        Returns
        -------
        list of dicts
            The records, which do not depend on the number of cores. Measurement noise, if any, differs with the input's place.
        """
        return self._core.simulate_batch([_pair(torque, kind) for torque in torques], kind, first)

    def __getstate__(self) -> tuple[str, str, str, bool]:
        return self._core.text, self._core.name, self._core.folder, self._core.allow_paths

    def __setstate__(self, state: tuple[str, str, str, bool]) -> None:
        self._core = _core.Arm.from_text(*state)

    def __repr__(self) -> str:
        return f"<Arm, {self.duration:g} s in steps of {self.dt:g} s>"


def _plain(value: Any) -> Any:
    """Arrays and numbers of NumPy, and mappings, as JSON has them."""
    if isinstance(value, Mapping):
        return dict(value)
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} is no number, text, list or dict")


def _pair(values: Any, name: str) -> tuple[Array, Array]:
    """The two columns of an array of shape (n, 2)."""
    array = np.asarray(values)
    if array.ndim != 2 or array.shape[1] != 2:
        raise DataError(f"'{name}' has the shape {array.shape}, but both joints' inputs have the shape (n, 2)")
    if len(array) < 2:
        raise TooShortError(f"'{name}' has {len(array)} rows, but a simulation needs at least 2 instants")
    return samples(array[:, 0], f"{name} of joint 1"), samples(array[:, 1], f"{name} of joint 2")
