"""The log of a joint, from arrays or from the columns of a table."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from flexure import _records as records
from flexure import _times as times
from flexure._arrays import samples
from flexure._core import DataError, ParameterError

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class JointLog:
    """The signals of a joint, or of the two joints of an arm."""

    torque: list[Array]
    """One array a joint."""
    position: list[Array]
    """The position of a rigid axis, or the angles of links; none of a rigid axis whose only encoder is at its motor."""
    motor: list[Array]
    """The angles of the motors; none of a rigid axis."""
    velocity: Array | None
    """The velocity of a rigid axis, where it is logged."""
    reference: Array | None
    """What the position controller of a rigid axis followed."""
    dt: float
    """The sample time, s."""

    @classmethod
    def of(
        cls, torque: Any, position: Any, motor: Any, link: Any, velocity: Any, reference: Any, data: Any, dt: float | None
    ) -> JointLog:
        """From what a caller gave: arrays, or the names of columns of `data`."""
        if (position is None) == (motor is None) or (link is not None and motor is None):
            raise ParameterError("give the position of a rigid axis, its motor's angle, or motor and link of a flexible joint")
        signals = {"torque": torque, "position": position, "motor": motor, "link": link, "velocity": velocity, "reference": reference}
        signals, step = _named(signals, data, times.given_step(dt))
        kind = "link" if signals["position"] is None else "position"
        angles = [] if signals[kind] is None else _columns(signals[kind], kind)
        motors = [] if signals["motor"] is None else _columns(signals["motor"], "motor")
        return cls(
            _columns(signals["torque"], "torque"),
            angles,
            motors,
            None if signals["velocity"] is None else samples(signals["velocity"], "velocity"),
            _reference(signals["reference"], len((angles or motors)[0])),
            step,
        )


def _named(signals: dict[str, Any], data: Any, dt: float | None) -> tuple[dict[str, Any], float]:
    """The signals, out of the columns of a table where there is one, and their sample time."""
    instants = times.instants_of(signals["torque"])
    if data is not None:
        signals, instants = records.named_columns(data, signals)
    step = times.step_of(instants)
    times.check_same_step(step, dt, "the log's sample time is {:g} s, but dt is {:g} s; leave dt out, or correct the times")
    dt = step if dt is None else dt
    if dt is None:
        raise ParameterError("the sample time is not known; give dt, in s")
    return signals, dt


def _reference(values: Any, length: int) -> Array | None:
    """The reference of a position controller, if there is one."""
    if values is None:
        return None
    column = samples(values, "reference")
    if len(column) != length or not np.isfinite(column).all():
        raise DataError(f"'reference' must have {length} finite samples, as the position has")
    return column


def _columns(values: Any, name: str) -> list[Array]:
    if np.ndim(values) == 2 and np.shape(values)[1] == 2:
        values = np.asarray(values)
        return [samples(values[:, i], f"{name} {i + 1}") for i in (0, 1)]
    if np.ndim(values) > 1 and np.shape(values)[1:] != (1,):
        raise DataError(f"'{name}' has the shape {np.shape(values)}, but one signal has the shape (n,), an arm's (n, 2)")
    return [samples(values, name)]
