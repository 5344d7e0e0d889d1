"""Arms of flexible links in a plane, from TOML: beams of finite elements or modes, their vibrations and their motion."""

from __future__ import annotations

from os import PathLike, fspath
from typing import Any, Literal, Self

import numpy as np
import numpy.typing as npt

from flexure import _core
from flexure._arrays import finite_number, samples
from flexure._core import DataError, ParameterError
from flexure._states import vector
from flexure.chains import Mode, _modes

__all__ = ["FlexibleArm"]

Array = npt.NDArray[np.float64]

# The most places of an outline.
MOST_PLACES = 10_000


class FlexibleArm:
    """An arm of rigid links and beams that turn and bend in the plane of x and y, on a fixed or a free-floating base.

    It is made from a chain file whose beams have ``model = "elements"`` or ``"modes"``. Coordinates `q` are, of a free base, its place and
    angle, then the joints' angles, then the beams' elastic coordinates, m: of every element the deflection of its end and the slope there
    times the beam's length, or of every mode its deflection at the tip; before them the two of the stretch, where there is an axial
    stiffness.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import mkdtemp
    >>> from flexure import FlexibleArm
    >>> path = Path(mkdtemp()) / "arm.toml"
    >>> _ = path.write_text('''
    ... [chain]
    ... [[chain.link]]
    ... name = "arm"
    ... joint = "shoulder"
    ... [chain.link.beam]
    ... length = 2.0
    ... stiffness = 300.0
    ... density = 0.7
    ... model = "modes"
    ... ''')
    >>> arm = FlexibleArm.from_toml(path)
    >>> [round(mode.frequency, 3) for mode in arm.modes(motors="held")[:2]]  # of a clamped beam
    [2.896, 18.15]
    """

    def __init__(self, core: _core.FlexibleArm) -> None:
        if not isinstance(core, _core.FlexibleArm):
            raise TypeError("a flexible arm is made by FlexibleArm.from_toml(path)")
        self._core = core

    @classmethod
    def from_toml(cls, path: str | PathLike[str]) -> Self:
        """Reads a chain file with beams of finite elements or modes; errors say the line and the key.

        Raises
        ------
        FileError
            The file cannot be read, or describes no arm.
        ParameterError
            The file has no such beam.
        """
        return cls(_core.FlexibleArm.read_toml(fspath(path)))

    def __repr__(self) -> str:
        joints = self.joints
        return f"<FlexibleArm of {len(joints)} joint{'s' if len(joints) != 1 else ''} and {self.nq} coordinates: {', '.join(joints)}>"

    @property
    def joints(self) -> list[str]:
        """The names of the joints that move."""
        return [name for name, _ in self._core.joints]

    @property
    def driven(self) -> list[str]:
        """The names of the joints on which torques act: all but the passive ones."""
        return self._core.driven

    @property
    def nq(self) -> int:
        """The number of coordinates."""
        return self._core.coordinates

    def modes(self, q: Any = None, *, motors: Literal["free", "held"] = "free") -> list[Mode]:
        """The small vibrations about rest, the lowest first, with the beams' and the springs' damping.

        Parameters
        ----------
        q : array of shape (nq,), optional
            The position of rest; straight, with all joints at zero, without it.
        motors : {"free", "held"}
            Whether motors turn freely or brakes hold them, and rigid joints too.

        Raises
        ------
        ParameterError
            A free base under gravity, which is never at rest.
        """
        return _modes(self._core, np.zeros(self.nq) if q is None else vector(q, "q", self.nq), motors)

    def outline(self, q: Any, link: int, count: int = 50) -> Array:
        """Places along the axis of a bent link from its root to its tip, m in the world, shape (count, 2); of a rigid link its origin alone.

        Parameters
        ----------
        q : array of shape (nq,)
            The position.
        link : int
            The number of the link in the file, from 0.
        count : int
            How many places, 2 to 10,000.

        Raises
        ------
        DataError
            A link that does not exist.
        """
        if not 2 <= count <= MOST_PLACES:
            raise ParameterError(f"count is {count}, but must be 2 to {MOST_PLACES}")
        if link < 0:
            raise ParameterError(f"link is {link}, but must not be negative")
        return np.array(self._core.outline(vector(q, "q", self.nq).tolist(), link, count))

    def simulate(
        self,
        duration: float,
        dt: float,
        torque: Any = None,
        *,
        q: Any = None,
        v: Any = None,
        rtol: float = 1e-9,
        atol: float = 1e-12,
        integrator: Literal["auto", "dop853", "radau"] = "auto",
    ) -> dict[str, Array]:
        """The motion over `duration` s, at instants `dt` s apart.

        Nothing acts on a free base. Motors begin with their links, so that no spring is bent.

        Parameters
        ----------
        duration, dt : float
            In s; the motion has ``duration / dt + 1`` instants.
        torque : array of shape (driven,) or (instants, driven), optional
            The torques of the joints that are `driven`, each held until the next instant; without it none act.
        q, v : array of shape (nq,), optional
            The state at the start; straight and at rest without them.
        rtol, atol : float
            The error of a step, relative to a component of the state (1e-14 to 0.1), and the one that is always allowed.
        integrator : {"auto", "dop853", "radau"}
            The method: explicit of order 8 (Dormand and Prince), implicit of order 13 (Radau IIA), or by default the explicit one until the motion is
            stiff, and then the one that gets further for its work.

        Returns
        -------
        dict of arrays of shape (instants,)
            ``t``, and for a joint "a" ``tau_a``, ``q_a``, ``dq_a``, of a flexible one ``qm_a`` and ``dqm_a``; for a beam "b" its elastic coordinates
            ``e1_b`` and so on with their rates ``de1_b``, and what its tip deflects, ``tip_b``, m; of a free base ``base_x``, ``base_y``,
            ``base_angle``, ``base_vx``, ``base_vy`` and ``base_w``.
        """
        own = [np.zeros(self.nq) if given is None else vector(given, name, self.nq) for name, given in (("q", q), ("v", v))]
        flexible = np.array([flexible for _, flexible in self._core.joints], bool)
        first = self._core.first
        initial = np.concatenate([part for of in own for part in (of, of[first : first + len(flexible)][flexible])])
        duration, dt = finite_number(duration, "duration"), finite_number(dt, "dt")
        torques = [] if torque is None else self._torques(np.asarray(torque), self._core.instants(duration, dt))
        tolerances = (finite_number(rtol, "rtol"), finite_number(atol, "atol"))
        return self._core.simulate(torques, initial.tolist(), (duration, dt), tolerances, integrator)

    def _torques(self, torque: Any, instants: int) -> list[Array]:
        """A column a driven joint."""
        driven = self.driven
        if torque.ndim == 1 and torque.shape == (len(driven),):
            torque = np.broadcast_to(torque, (instants, len(driven)))
        if torque.ndim != 2 or torque.shape[1] != len(driven):
            raise DataError(f"'torque' has the shape {torque.shape}, but this arm needs ({len(driven)},) or (instants, {len(driven)})")
        return [samples(torque[:, i], f"tau_{name}") for i, name in enumerate(driven)]
