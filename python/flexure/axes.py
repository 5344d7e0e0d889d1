"""Several axes of one log: each identified alone, or as the joints of a chain."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass, field
from os import PathLike
from typing import Any, cast

from flexure import _core
from flexure import _records as records
from flexure import _times as times
from flexure._arrays import Array, finite_number, samples
from flexure._core import DataError, FlexureError, ParameterError
from flexure.chains import Chain
from flexure.joints import Joint, _joint

__all__ = ["Axes", "identify_axes"]


@dataclass(frozen=True, repr=False)
class Axes:
    """Several axes of a log, by their names."""

    joints: dict[str, Joint]
    """The axes that were identified. Their summaries, pages and arms are those of `identify_joint`."""
    errors: dict[str, str]
    """Why the others could not be."""
    rows: dict[str, dict[str, Any]]
    """The table that ``flexure joint --axis`` prints: the quantities of every identified axis with their errors, and its verdict. None stands for
    what an axis does not have, and a value of None for what the data do not tell."""
    result: dict[str, Any] = field(repr=False)
    """Their part of the output of ``flexure joint --axis ... --json``."""
    _found: _core.Axes | None = field(default=None, repr=False, compare=False)

    def __repr__(self) -> str:
        return f"<{len(self.joints)} of {len(self.joints) + len(self.errors)} axes identified: {', '.join(self.joints)}>"

    def __getitem__(self, axis: Any) -> Joint:
        return self.joints[str(axis)]

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_found": None}

    def summary(self) -> str:
        """The text that ``flexure joint --axis`` prints."""
        return self._own("summary").summary()

    def report(self, path: str | PathLike[str]) -> None:
        """Writes the page that ``flexure joint --axis ... --report`` writes: one HTML file that needs no network."""
        page = self._own("report").page()
        with open(path, "w", encoding="utf-8") as file:
            file.write(page)

    def _own(self, what: str) -> _core.Axes:
        if self._found is None:
            raise FlexureError(f"{what} needs the log, which axes out of a pickle do not have")
        return self._found


def identify_axes(
    data: Any,
    axes: Iterable[Any] | None = None,
    *,
    torque: str = "tau{}",
    position: str | None = None,
    motor: str | None = None,
    link: str | None = None,
    velocity: str | None = None,
    dt: float | None = None,
    gravity: bool = False,
    spring: bool = False,
    prismatic: bool = False,
    level: float = 0.95,
    torque_constant: float = 1.0,
    chain: Chain | None = None,
) -> Axes:
    """Identifies several axes of one log; one that cannot be identified does not keep the others from it.

    Each axis is taken alone, or as a joint of a `chain`: gravity and the other joints then act on it as the chain's inertias and the positions
    of all joints say.

    Parameters
    ----------
    data : table
        A table (pandas, polars, xarray, a dict) with the columns of all axes.
    axes : numbers or names, optional
        The axes, for example ``range(1, 7)``. None: all joints of `chain`, by their numbers from 1 on or by their names, as the columns have
        them.
    torque, position, motor, link, velocity : str
        The names of the columns, in which ``{}`` stands for the axis: ``position`` of rigid axes, or ``motor`` and ``link`` of
        flexible joints. An axis without a column of its link is a rigid one at its motor.
    dt : float, optional
        The sample time, s; None: from the times in `data`.
    gravity, spring, prismatic, level, torque_constant
        As for `identify_joint`, for all axes.
    chain : Chain, optional
        The chain on a fixed base whose joints the axes are: `data` has the positions of all its joints. The chain has gravity and says which
        joints slide, so `gravity` and `prismatic` are left out.

    Raises
    ------
    DataError
        Where no axis can be identified.
    ParameterError
        A parameter outside its range, or names that do not belong together.

    Examples
    --------
    Two axes; one has no torque:

    >>> import numpy as np
    >>> from flexure import identify_axes
    >>> t, w = 0.005 * np.arange(4000), 2 * np.pi * np.array([0.3, 1.1, 2.3])
    >>> torque = np.sin(np.outer(t, w)).sum(axis=1)
    >>> position = np.imag(np.exp(1j * np.outer(t, w)) / (1j * w * (2j * w + 0.5))).sum(axis=1)
    >>> position += 1e-5 * np.random.default_rng(1).normal(size=t.size)
    >>> log = {"t": t, "q1": position, "tau1": torque, "q2": position, "tau2": 0 * t}
    >>> axes = identify_axes(log, [1, 2], position="q{}")
    >>> axes
    <1 of 2 axes identified: 1>
    >>> round(axes[1].inertia.value, 2)
    2.0
    """
    if chain is not None and not isinstance(chain, Chain):
        raise ParameterError("chain is a flexure.Chain, such as flexure.Chain.from_urdf(path)")
    if chain is not None and (gravity or prismatic):
        raise ParameterError("leave gravity and prismatic out: the chain says them")
    if (position is None) == (motor is None or link is None):
        raise ParameterError("give the position of rigid axes, or motor and link of flexible joints")
    patterns = {"torque": torque, "position": position, "motor": motor, "link": link, "velocity": velocity}
    for what, pattern in patterns.items():
        if pattern is not None and "{}" not in pattern:
            raise ParameterError(f"{what} is {pattern!r}; write {{}} where the name of the column has the axis")
    given_axes = None if axes is None else [str(axis) for axis in axes]
    joints = None if chain is None else _joints(data, chain, given_axes, patterns)
    names = joints if given_axes is None else given_axes
    if names is None:
        raise ParameterError("give the axes, or the chain whose joints they are")
    if not names or len(set(names)) < len(names):
        raise ParameterError("give at least one axis, and none of them twice")
    constant = finite_number(torque_constant, "torque_constant")
    given, steps = [], set()
    for name in names:
        own = {what: None if pattern is None else pattern.replace("{}", name) for what, pattern in patterns.items()}
        remark, error, columns = None, None, None
        try:
            own, remark = _at_motor(data, own)
            found, instants = records.named_columns(data, own)
            steps.add(times.step_of(instants))
            column = {what: None if values is None else samples(values, str(own[what])) for what, values in found.items()}
            of_link = column["link"] if column["position"] is None else column["position"]
            # Both are named, so they were found.
            torques, angles = cast("Array", column["torque"]), cast("Array", of_link)
            columns = (torques * constant, angles, column["motor"], column["velocity"])
        except DataError as problem:
            error = str(problem)
        given.append((name, remark, error, columns))
    step = next(iter(steps), None)
    times.check_same_step(step, times.given_step(dt), "the log's sample time is {:g} s, but dt is {:g} s; leave dt out, or correct the times")
    step = step if dt is None else dt
    if step is None:
        raise ParameterError("the sample time is not known; give dt, in s")
    of_chain = None if chain is None or joints is None else _of_chain(data, chain, joints, names, patterns)
    core = _core.identify_axes(given, step, gravity=gravity, spring=spring, prismatic=prismatic, level=level, chain=of_chain)
    result = json.loads(core.json())
    identified = {each["axis"]: each for each in result["axes"] if "error" not in each}
    return Axes(
        {name: _joint(each, None) for name, each in identified.items()},
        {each["axis"]: each["error"] for each in result["axes"] if "error" in each},
        {name: each["row"] for name, each in identified.items()},
        result,
        core,
    )


def _joints(data: Any, chain: Chain, axes: list[str] | None, patterns: dict[str, str | None]) -> list[str]:
    """How axes and columns name the joints of a chain: by their numbers, or by their names."""
    numbers = [str(number) for number in range(1, len(chain.joints) + 1)]
    if axes is None:
        first = str(patterns["position"] or patterns["link"]).replace("{}", numbers[0])
        try:
            records.named_columns(data, {"position": first})
        except DataError:
            return list(chain.joints)
        return numbers
    for names in (numbers, list(chain.joints)):
        if set(axes) <= set(names):
            return names
    raise ParameterError(f"the axes are {', '.join(axes)}; give numbers from 1 to {len(numbers)}, or the names {', '.join(chain.joints)}")


def _of_chain(
    data: Any, chain: Chain, joints: list[str], names: list[str], patterns: dict[str, str | None]
) -> tuple[_core.Chain, list[Array], list[int]]:
    """The chain, the positions of all its joints, and the numbers of those that the axes of these names are."""
    positions = []
    for joint in joints:
        own, _ = _at_motor(data, {what: None if pattern is None else pattern.replace("{}", joint) for what, pattern in patterns.items()})
        column = str(own["position"] or own["link"])
        found, _ = records.named_columns(data, {"position": column})
        positions.append(samples(found["position"], column))
    return chain._core, positions, [joints.index(name) for name in names]


def _at_motor(data: Any, own: dict[str, str | None]) -> tuple[dict[str, str | None], str | None]:
    """The names of an axis's columns: a rigid one at its motor where the table has no column of its link."""
    link, motor = own["link"], own["motor"]
    if link is None:
        return own, None
    try:
        records.named_columns(data, {"link": link})
    except DataError:
        records.named_columns(data, {"motor": motor})
        remark = f"the log has no angle of its link: it is taken as a rigid axis at its motor, column '{motor}'"
        return {**own, "position": motor, "motor": None, "link": None}, remark
    return own, None
