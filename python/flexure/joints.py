"""Friction, stiffness and inertia of a joint from its log, without differentiating noisy angles twice."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from flexure import _core
from flexure._arrays import finite_number
from flexure._core import DataError, FlexureError, ParameterError
from flexure._html import arm_html, joint_html
from flexure._joint_logs import JointLog
from flexure.arms import Arm
from flexure.results import Estimate, Nonlinearity

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["Estimate", "Form", "Joint", "Motion", "OtherLog", "Parameter", "TwoLinkArm", "identify_joint"]

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Parameter(Estimate):
    """A parameter of a physical form."""

    unit: str
    """Its unit."""
    identifiable: bool
    """Whether the data determine it."""
    range: tuple[float, float] | None = None
    """The values that the data support, if they do not determine one value."""
    remark: str | None = None
    """A further remark on it."""


@dataclass(frozen=True)
class Motion:
    """The measured motion simulated with what was identified."""

    drive: str
    """What drives it, for example "under the recorded torque"."""
    rms: float
    """The root mean square of measured minus simulated position, rad (m)."""
    fit_percent: float
    """``100 (1 - |q - qh| / |q - mean q|)``."""


@dataclass(frozen=True)
class OtherLog:
    """What a joint does on another log, which was not fitted, as ``flexure joint --validate`` says it."""

    holds: bool
    """Whether what was found holds there: the torque of a joint, the simulated motions of an arm."""
    torque_rms: float
    """The root mean square by which the torque that the motion needs is off, N m (N), up to `cut_off`; NaN for an arm."""
    torque_fit_percent: float
    """The fit of that torque; NaN for an arm."""
    own_torque_fit_percent: float
    """The same on the log that was fitted."""
    unseen: float
    """The share of the samples that move faster than any of the fitted log."""
    cut_off: float
    """Hz."""
    motions: tuple[Motion, ...]
    """The motion of the other log simulated."""


@dataclass(frozen=True)
class Form:
    """A physical form of a curve, fitted to the equations of motion, with its test against the free curve."""

    name: str
    """For example "lugre_static"."""
    parameters: dict[str, Parameter]
    """The parameters by their symbols."""
    result: dict[str, Any] = field(repr=False)
    """Its part of the output of ``flexure joint --json``."""


class _Logged:
    """What can be made of a joint or an arm together with its log."""

    _found: _core.Joint | None

    def _own(self, what: str) -> _core.Joint:
        if self._found is None:
            raise FlexureError(f"{what} needs the log; which a joint of an arm or one out of a pickle does not have")
        return self._found

    def summary(self) -> str:
        """The text that ``flexure joint`` prints."""
        return self._own("summary").summary()

    @property
    def motions(self) -> tuple[Motion, ...]:
        """The measured motion simulated with what was identified: under the recorded torque, of every joint; of a rigid axis also in the position
        loop, where that is known. Empty where the simulation fails."""
        found = json.loads(self._own("motions").motions())
        recorded = "under the recorded torque"
        if isinstance(found, list) or found is None:
            return _motions(found or [])
        # An arm has a list of each, an entry a joint.
        pairs = zip(np.atleast_1d(found["rms"]).tolist(), np.atleast_1d(found["fit_percent"]).tolist(), strict=True)
        return tuple(Motion(recorded, rms, fit) for rms, fit in pairs)

    def validate(
        self,
        torque: Any,
        *,
        dt: float | None = None,
        position: Any = None,
        motor: Any = None,
        link: Any = None,
        velocity: Any = None,
        reference: Any = None,
        data: Any = None,
    ) -> OtherLog:
        """Judges the joint on another of its logs, which was not fitted: the torque that the motion there needs, and its simulated motion.

        Arrays and names are those of :func:`identify_joint`; `torque` is in the unit that it had there.

        Raises
        ------
        DataError
            Samples that are not finite or do not vary, fewer than 200 of them, wrapped angles.
        ParameterError
            Columns of another kind of joint.
        """
        log = JointLog.of(torque, position, motor, link, velocity, reference, data, dt)
        text = self._own("validate").validate(log.torque, log.position, log.motor, log.velocity, log.dt, log.reference)
        return _other_log(json.loads(text))

    def report(self, path: str | PathLike[str]) -> None:
        """Writes the page that ``flexure joint --report`` writes: one HTML file that needs no network."""
        page = self._own("report").page()
        with open(path, "w", encoding="utf-8") as file:
            file.write(page)

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_found": None}


@dataclass(frozen=True, repr=False)
class Joint(_Logged):
    """A rigid axis, or a flexible joint with its link."""

    kind: str
    """"rigid" or "flexible"."""
    inertia: Estimate
    """The inertia of a rigid axis, or of the link of a flexible joint, kg m² (kg for a prismatic axis)."""
    motor_inertia: Estimate | None
    """The inertia of a flexible joint's motor, kg m²."""
    friction: Nonlinearity
    """Friction torque over velocity, N m over rad/s, with its band."""
    stiffness: Nonlinearity | None
    """A flexible joint's torque over its deflection, N m over rad, with its band."""
    friction_forms: tuple[Form, ...]
    """The forms that were fitted to the friction."""
    stiffness_forms: tuple[Form, ...]
    """The forms that were fitted to the stiffness."""
    findings: tuple[str, ...]
    """What to know before trusting it."""
    result: dict[str, Any] = field(repr=False)
    """Its part of the output of ``flexure joint --json``."""
    _found: _core.Joint | None = field(default=None, repr=False, compare=False)

    def arm(self, joint: int = 1, *, template: Arm | None = None) -> Arm:
        """The joint in an arm whose other joint is locked, in the run of its log, as ``flexure joint --arm`` writes it.

        `joint` says which it is, 1 (the shoulder) or 2; `template` is the arm whose links it moves, without which masses and
        lengths are placeholders.
        """
        if joint not in (1, 2):
            raise ParameterError(f"joint is {joint}, but must be 1, the shoulder, or 2, the elbow")
        return Arm.from_text(self._own("arm").arm_file(joint - 1, None if template is None else template.toml))

    @property
    def units(self) -> tuple[str, str]:
        """The units of positions and torques: rad and N m, or m and N for a prismatic axis."""
        return ("m", "N") if self.result.get("inertia_unit") == "kg" else ("rad", "N m")

    def __repr__(self) -> str:
        unit = "kg" if self.units[0] == "m" else "kg m²"
        motor = "" if self.motor_inertia is None else f", motor {self.motor_inertia} {unit}"
        what = "Rigid axis" if self.kind == "rigid" else "Flexible joint"
        return f"<{what}, inertia {self.inertia} {unit}{motor}, friction {self.best_friction.name}>"

    def _repr_html_(self) -> str:
        """Inertias, curves and findings, for notebooks."""
        return joint_html(self)

    @property
    def motor_friction(self) -> Nonlinearity | None:
        """Friction torque at a flexible joint's motor over its velocity, N m over rad/s, if the log shows it apart from the link's."""
        found = self.result.get("motor_friction")
        return None if found is None else Nonlinearity.of(found)

    @property
    def best_friction(self) -> Form:
        """The form of the friction that the data support best."""
        return _best(self.friction_forms, self.result.get("best_friction_form", self.result.get("best_form")))

    @property
    def best_stiffness(self) -> Form:
        """The form of the stiffness that the data support best."""
        return _best(self.stiffness_forms, self.result.get("best_stiffness_form"))

    def plot(self, *, friction: Any = None, stiffness: Any = None) -> Figure:
        """The curves with their bands in a matplotlib figure; dashed, the true ones where they are known."""
        import matplotlib.pyplot as plt

        across = 1 if self.stiffness is None else 2
        figure, axes = plt.subplots(1, across, squeeze=False, layout="constrained", figsize=(4.2 * across, 3.2))
        self.draw(axes[0], friction=friction, stiffness=stiffness)
        return figure

    def draw(self, axes: Sequence[Axes], *, friction: Any = None, stiffness: Any = None) -> None:
        """Draws friction and, of a flexible joint, stiffness into matplotlib axes; dashed, the true curves where they are known."""
        from flexure.plots import nonlinearity

        position, torque = self.units
        what = "force" if torque == "N" else "torque"
        curves = [(self.friction, f"velocity / ({position}/s)", f"friction {what} / {_within_brackets(torque)}", friction)]
        if self.stiffness is not None:
            curves.append((self.stiffness, f"deflection / {position}", f"{what} / {_within_brackets(torque)}", stiffness))
        for (curve, x, y, truth), ax in zip(curves, axes, strict=True):
            nonlinearity(curve, input=x, output=y, truth=truth, axes=ax)


@dataclass(frozen=True, repr=False)
class TwoLinkArm(_Logged):
    """A two-link arm with flexible joints and the coupling of its links."""

    shoulder: Estimate
    """The link's inertia about the shoulder with the elbow straight, as ``flexure joint`` gives it, kg m²."""
    elbow: Estimate
    """The inertia of the second link about the elbow, kg m²."""
    coupling: Estimate
    """The coupling m2 l1 c2, kg m²."""
    joints: tuple[Joint, Joint]
    """Shoulder and elbow."""
    result: dict[str, Any] = field(repr=False)
    """Its part of the output of ``flexure joint --json``."""
    _found: _core.Joint | None = field(default=None, repr=False, compare=False)

    def __repr__(self) -> str:
        return f"<Two-link arm, shoulder {self.shoulder}, elbow {self.elbow}, coupling {self.coupling} kg m²>"

    def _repr_html_(self) -> str:
        """Inertias, curves and findings of both joints, for notebooks."""
        return arm_html(self)

    def plot(self) -> Figure:
        """The curves of both joints with their bands in a matplotlib figure, the shoulder's above the elbow's."""
        import matplotlib.pyplot as plt

        figure = plt.figure(layout="constrained", figsize=(8.4, 6.4))
        places = np.atleast_1d(np.asarray(figure.subfigures(2, 1)))
        for joint, name, place in zip(self.joints, ("Shoulder", "Elbow"), places, strict=True):
            joint.draw(place.subplots(1, 2))
            place.suptitle(name, fontsize="medium", x=0.02, ha="left")
        return figure

    def arm(self, *, template: Arm | None = None) -> Arm:
        """The arm in the run of its log, as ``flexure joint --arm`` writes it.

        A log tells no masses, lengths and centres of mass, only constants: `template` is the arm whose lengths and centres of mass
        it has, without which they are one choice with the same motion.
        """
        return Arm.from_text(self._own("arm").arm_file(0, None if template is None else template.toml))


def identify_joint(
    torque: Any,
    *,
    dt: float | None = None,
    position: Any = None,
    motor: Any = None,
    link: Any = None,
    velocity: Any = None,
    motor_inertia: float | None = None,
    gravity: bool = False,
    spring: bool = False,
    prismatic: bool = False,
    level: float = 0.95,
    torque_constant: float = 1.0,
    gear_ratio: float = 1.0,
    reference: Any = None,
    kp: float | None = None,
    kv: float | None = None,
    data: Any = None,
) -> Joint | TwoLinkArm:
    """Identifies a joint: a rigid axis from `position` or `motor`, a flexible joint from `motor` and `link`, a two-link arm from two each.

    Parameters
    ----------
    torque : array of shape (n,), or (n, 2) for an arm
        N m on the link's side of the gear (N for a prismatic axis); or as it is logged, see `torque_constant` and `gear_ratio`.
    dt : float, optional
        The sample time, s; None: from a time index of `torque`, or from the times in `data`.
    position : array of shape (n,)
        Of a rigid axis, rad (m), behind its gear.
    motor, link : arrays of shape (n,), or (n, 2)
        The angles of a flexible joint, rad; the motor's on the link's side, or see `gear_ratio`. A motor alone is that of a rigid axis.
    velocity : array of shape (n,), optional
        Of a rigid axis, where it is logged; on the side of its position or motor.
    motor_inertia : float, optional
        Of a flexible joint, where it is known, kg m².
    gravity, spring : bool
        Terms cos q and sin q, or q, that act on a rigid axis.
    prismatic : bool
        Whether the rigid axis moves along a line.
    level : float
        Of the confidence bands.
    torque_constant : float
        Torque for each unit of `torque`.
    gear_ratio : float
        Angles of `motor` are divided by it, torques multiplied, so that all is seen from the link.
    reference : array of shape (n,), optional
        What a position controller of a rigid axis followed: ``motions`` then has the motion in its loop too, with ``torque = kv
        (kp (reference - position) - velocity)``, in the unit of `torque`.
    kp, kv : float, optional
        The controller's gains.
    data : table, optional
        A table (pandas, polars, xarray, a dict) whose columns the signals then name: ``identify_joint("tau", motor="qm",
        link="q", data=log)``; lists of two names for an arm.

    Raises
    ------
    DataError
        Samples that are not finite or do not vary, wrapped angles, a motion that shows nothing.
    ParameterError
        A parameter outside its range, or columns that do not belong together.

    Examples
    --------
    An axis of 2 kg m² with viscous friction of 0.5 N m s/rad:

    >>> import numpy as np
    >>> from flexure import identify_joint
    >>> t, w = 0.005 * np.arange(4000), 2 * np.pi * np.array([0.3, 1.1, 2.3])
    >>> torque = np.sin(np.outer(t, w)).sum(axis=1)
    >>> position = np.imag(np.exp(1j * np.outer(t, w)) / (1j * w * (2j * w + 0.5))).sum(axis=1)
    >>> position += 1e-5 * np.random.default_rng(1).normal(size=t.size)
    >>> joint = identify_joint(torque, position=position, dt=0.005)
    >>> round(joint.inertia.value, 2)
    2.0

    Another log of the axis says whether that holds there:

    >>> later = joint.validate(torque[::-1], position=position[::-1], dt=0.005)
    >>> later.holds
    False
    """
    log = JointLog.of(torque, position, motor, link, velocity, reference, data, dt)
    if {reference is None, kp is None, kv is None} == {True, False}:
        raise ParameterError("a position loop has a reference, kp and kv; give all three, or none")
    for name, value in {"velocity": velocity is not None, "gravity": gravity, "spring": spring, "prismatic": prismatic}.items():
        if value and link is not None:
            raise ParameterError(f"{name} is for a rigid axis, with a position or a motor alone; a flexible joint has motor and link")
    if reference is not None and position is None:
        raise ParameterError("reference is for a rigid axis with a position")
    if motor_inertia is not None and link is None:
        raise ParameterError("motor_inertia is for a flexible joint; a rigid axis has one inertia")
    position_loop = None
    if log.reference is not None:
        position_loop = log.reference, finite_number(kp, "kp"), finite_number(kv, "kv")
    core = _core.identify_joint(
        log.torque,
        log.position,
        log.motor,
        log.velocity,
        log.dt,
        motor_inertia=motor_inertia,
        gravity=gravity,
        spring=spring,
        prismatic=prismatic,
        level=level,
        torque_constant=finite_number(torque_constant, "torque_constant"),
        gear_ratio=finite_number(gear_ratio, "gear_ratio"),
        position_loop=position_loop,
    )
    result = json.loads(core.json())
    if result["joint"] != "two_link_arm":
        return _joint(result, core)
    first, second = (_joint({"joint": "flexible", **joint}, None) for joint in result["joints"])
    shoulder, elbow, coupling = (_estimate(result[name]) for name in ("shoulder", "elbow", "coupling"))
    return TwoLinkArm(shoulder, elbow, coupling, (first, second), result, core)


def _within_brackets(unit: str) -> str:
    """A unit behind a solidus."""
    return f"({unit})" if " " in unit else unit


def _joint(result: dict[str, Any], core: _core.Joint | None) -> Joint:
    flexible = result["joint"] == "flexible"
    return Joint(
        result["joint"],
        _estimate(result["link_inertia" if flexible else "inertia"]),
        _estimate(result["motor_inertia"]) if flexible else None,
        Nonlinearity.of(result["friction"]),
        Nonlinearity.of(result["stiffness"]) if flexible else None,
        tuple(map(_form, result["friction_forms" if flexible else "forms"])),
        tuple(map(_form, result.get("stiffness_forms", ()))),
        tuple(result["findings"]),
        result,
        core,
    )


def _other_log(found: dict[str, Any]) -> OtherLog:
    names = ("rms", "fit_percent", "own_fit_percent", "unseen", "cut_off")
    rms, fit, own_fit, unseen, cut_off = ((found["torque"] or {}).get(name, np.nan) for name in names)
    return OtherLog(found["holds"], rms, fit, own_fit, unseen, cut_off, _motions(found["motions"]))


def _motions(found: list[dict[str, Any]]) -> tuple[Motion, ...]:
    return tuple(Motion(motion["drive"], motion["rms"], motion["fit_percent"]) for motion in found)


def _estimate(found: dict[str, Any]) -> Estimate:
    return Estimate(found["value"], found["standard_error"])


def _form(found: dict[str, Any]) -> Form:
    return Form(found["form"], {symbol: _parameter(p) for symbol, p in found["parameters"].items()}, found)


def _parameter(found: dict[str, Any]) -> Parameter:
    error, interval = found["standard_error"], found["range"]
    error = np.nan if error is None else error
    interval = None if interval is None else (interval[0], interval[1])
    return Parameter(found["value"], error, found["unit"], found["identifiable"], interval, found["remark"])


def _best(forms: tuple[Form, ...], name: str | None) -> Form:
    for form in forms:
        if form.name == name:
            return form
    raise DataError("there is no such form")
