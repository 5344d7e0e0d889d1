"""Chains and trees of rigid links, from URDF or TOML: their dynamics and their motion on a base that is fixed, moved or free-floating."""

from __future__ import annotations

import math
from collections.abc import Sequence
from os import PathLike, fspath
from typing import Any, Literal, NamedTuple, Self

import numpy as np
import numpy.typing as npt

from flexure import _core
from flexure._arrays import finite_number, samples
from flexure._core import DataError, ParameterError
from flexure._states import gravity_vector, poses, starts, torques, vector, vectors

__all__ = ["AccelerationDerivatives", "Chain", "Energy", "Mode", "Momentum", "TorqueDerivatives"]

Array = npt.NDArray[np.float64]

# Of the ground, z upwards.
GRAVITY = (0.0, 0.0, -9.81)


class Energy(NamedTuple):
    """Energies of states, J, of the shape of the states."""

    kinetic: Array
    """Of the motion."""
    potential: Array
    """In the field of gravity, against the origin of the world; what a fixed base carries does not count."""


class TorqueDerivatives(NamedTuple):
    """How torques change, of shape (..., nv, nv): row i has the derivatives of torque i."""

    by_position: Array
    """With the position; along a motion of a free base in its own axes."""
    by_velocity: Array
    """With the velocity."""


class AccelerationDerivatives(NamedTuple):
    """How accelerations change, of shape (..., nv, nv): row i has the derivatives of acceleration i."""

    by_position: Array
    """With the position; along a motion of a free base in its own axes."""
    by_velocity: Array
    """With the velocity."""
    by_torque: Array
    """With the torques: the inverse of the inertia matrix."""


class Mode(NamedTuple):
    """A small vibration about rest."""

    frequency: float
    """Hz; zero for motion without a spring, NaN where rest is not stable."""
    damping: float
    """The share of critical damping by the dampers beside the springs."""
    shape: Array
    """Amplitudes of the nv velocities' directions, then of the motors of flexible joints; the largest is 1."""


class Momentum(NamedTuple):
    """Momenta about the centre of mass, in the axes of the world, of shape (..., 3)."""

    linear_momentum: Array
    """kg m/s."""
    angular_momentum: Array
    """kg m^2/s; conserved without gravity where the base is free."""
    com: Array
    """The centre of mass, m."""


class Chain:
    """A chain or tree of rigid links, with joints that turn, slide or are fixed.

    Take it from a URDF, `Chain.from_urdf`, from a chain file, `Chain.from_toml`, or ready to use, `Chain.preset`. All methods
    take one state or many, in the first axis, and return arrays of the same first axis; many states are computed on all cores.

    Positions `q` have the shape (..., nq), velocities `v`, accelerations and torques (..., nv), in rad or m, rad/s or m/s, N m or N.
    On a fixed base nq = nv is the number of moving joints. A free base comes before them: `q` begins with its position
    and its orientation in the world, ``[x, y, z, qx, qy, qz, qw]`` (the quaternion's length does not matter), `v` with its linear and angular
    velocity in the base's own axes, and torques with the force and the moment on it. These are Pinocchio's conventions, except that a
    continuous joint has one position, its angle.

    Examples
    --------
    >>> from flexure import Chain
    >>> rod = '''<robot name="pendulum"><link name="world"/><link name="rod"><inertial>
    ...   <origin xyz="0 0 -0.5"/><mass value="2"/><inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.001"/>
    ... </inertial></link><joint name="pivot" type="continuous"><parent link="world"/><child link="rod"/><axis xyz="0 1 0"/>
    ... </joint></robot>'''
    >>> chain = Chain.from_text(rod)
    >>> chain
    <Chain of 1 joint on a fixed base: pivot>
    >>> chain.mass_matrix([[0.0]]).tolist()  # 0.1 + 2 * 0.5**2
    [[[0.6]]]
    """

    def __init__(self, core: _core.Chain) -> None:
        if not isinstance(core, _core.Chain):
            raise TypeError("a chain is made by Chain.from_urdf(path) or Chain.from_text(text)")
        self._core = core

    @classmethod
    def from_urdf(
        cls,
        path: str | PathLike[str],
        *,
        base: Literal["fixed", "free"] = "fixed",
        gravity: Sequence[float] = GRAVITY,
    ) -> Self:
        """Reads a URDF file; errors say the line and the name.

        The joints come depth first, and those of one link in the order of their names. A joint without ``<limit>`` has no limits.

        Parameters
        ----------
        path : path
            The file. Shapes, materials, ``<dynamics>`` and limits of effort and velocity are skipped; a xacro file is refused.
        base : {"fixed", "free"}
            Whether the root link is fixed to the world or floats freely.
        gravity : three numbers
            The acceleration of gravity in the world, m/s^2; ``(0, 0, 0)`` in orbit.

        Raises
        ------
        FileError
            The file cannot be read, or describes no chain: loops, several roots, links that move without mass, joints of other types.
        """
        return cls(_core.Chain.read_urdf(fspath(path), base, gravity_vector(gravity)))

    @classmethod
    def from_text(
        cls, text: str, *, base: Literal["fixed", "free"] = "fixed", gravity: Sequence[float] = GRAVITY
    ) -> Self:
        """The text of a URDF, as `from_urdf`."""
        return cls(_core.Chain.parse_urdf(text, base, gravity_vector(gravity)))

    @classmethod
    def from_toml(cls, path: str | PathLike[str]) -> Self:
        """Reads a chain file: links, beams as rigid segments, flexible joints with motors and friction, a load at the tip; errors
        say the line and the key.

        `simulate` moves its flexible joints; all other methods are about its links, and take the torques that act on these.

        Raises
        ------
        FileError
            The file cannot be read.
        ArmError
            The file describes no chain.
        """
        return cls(_core.Chain.read_toml(fspath(path)))

    @classmethod
    def preset(cls, name: str) -> Self:
        """A chain that is ready to use, with rigid joints: "free-space-arm" and "space-manipulator" on a floating base in orbit,
        "six-joint-arm" and "seven-joint-arm" on the ground."""
        return cls(_core.Chain.preset(name))

    def __repr__(self) -> str:
        base = "free" if self.nq > self.nv else "fixed"
        count = len(self.joints)
        return f"<Chain of {count} joint{'s' if count > 1 else ''} on a {base} base: {', '.join(self.joints)}>"

    @property
    def joints(self) -> list[str]:
        """The names of the joints that move, in the order of `q`."""
        return self._core.joints

    @property
    def driven(self) -> list[str]:
        """The names of the joints on which torques act: all but the passive ones, at which the segments of beams bend."""
        return self._core.driven

    @property
    def limits(self) -> Array:
        """The least and the largest position of every joint, shape (joints, 2); infinite where there is none."""
        return np.array(self._core.limits)

    @property
    def neutral(self) -> Array:
        """The position in which every joint is at zero and a free base at the origin, shape (nq,)."""
        return np.array(self._core.neutral)

    @property
    def nq(self) -> int:
        """The number of values of a position."""
        return len(self._core.neutral)

    @property
    def nv(self) -> int:
        """The number of values of a velocity, an acceleration or a vector of torques."""
        return self._core.velocities

    def forward_dynamics(self, q: Any, v: Any, tau: Any) -> Array:
        """The accelerations, shape (..., nv), under the torques `tau` (Featherstone's articulated bodies).

        Raises
        ------
        DataError
            Shapes that do not fit the chain or each other.
        ParameterError
            A quaternion of length zero.
        """
        shape, (q, v, tau) = self._states(q=q, v=v, tau=tau)
        return self._core.forward_dynamics(q, v, tau).reshape(*shape, self.nv)

    def inverse_dynamics(self, q: Any, v: Any, a: Any) -> Array:
        """The torques, shape (..., nv), that cause the accelerations `a` (Newton and Euler's recursion).

        Raises
        ------
        DataError
            Shapes that do not fit the chain or each other.
        ParameterError
            A quaternion of length zero.
        """
        shape, (q, v, a) = self._states(q=q, v=v, a=a)
        return self._core.inverse_dynamics(q, v, a).reshape(*shape, self.nv)

    def mass_matrix(self, q: Any) -> Array:
        """The inertia matrices, shape (..., nv, nv), symmetric (composite bodies).

        Raises
        ------
        DataError
            A shape that does not fit the chain.
        ParameterError
            A quaternion of length zero.
        """
        shape, (q,) = self._states(q=q)
        return self._core.mass_matrix(q).reshape(*shape, self.nv, self.nv)

    @property
    def inertial_parameters(self) -> Array:
        """The inertial parameters, shape (10 bodies,): mass, kg, first moments, kg m, and second moments about the frame's origin in the order
        xx, xy, yy, xz, yz, zz, kg m^2, of every link that a joint carries, in its axes and with what is fixed to it; a free base comes first.
        """
        return np.array(self._core.inertial_parameters)

    def regressor(self, q: Any, v: Any, a: Any) -> Array:
        """The matrices, shape (..., nv, 10 bodies), that give the torques of `inverse_dynamics` from `inertial_parameters`.

        The order of the parameters is that of Pinocchio's ``computeJointTorqueRegressor``.

        Raises
        ------
        DataError
            Shapes that do not fit the chain or each other.
        ParameterError
            A quaternion of length zero.
        """
        shape, (q, v, a) = self._states(q=q, v=v, a=a)
        return self._core.regressor(q, v, a).reshape(*shape, self.nv, len(self._core.inertial_parameters))

    def inverse_dynamics_derivatives(self, q: Any, v: Any, a: Any) -> TorqueDerivatives:
        """How the torques of `inverse_dynamics` change with the state, as Pinocchio's ``computeRNEADerivatives``.

        Raises
        ------
        DataError
            Shapes that do not fit the chain or each other.
        ParameterError
            A quaternion of length zero.
        """
        shape, (q, v, a) = self._states(q=q, v=v, a=a)
        found = self._core.inverse_dynamics_derivatives(q, v, a).reshape(*shape, 2, self.nv, self.nv)
        return TorqueDerivatives(found[..., 0, :, :], found[..., 1, :, :])

    def forward_dynamics_derivatives(self, q: Any, v: Any, tau: Any) -> AccelerationDerivatives:
        """How the accelerations of `forward_dynamics` change with the state and the torques, as Pinocchio's ``computeABADerivatives``.

        Raises
        ------
        DataError
            Shapes that do not fit the chain or each other.
        ParameterError
            A quaternion of length zero.
        """
        shape, (q, v, tau) = self._states(q=q, v=v, tau=tau)
        found = self._core.forward_dynamics_derivatives(q, v, tau).reshape(*shape, 3, self.nv, self.nv)
        return AccelerationDerivatives(found[..., 0, :, :], found[..., 1, :, :], found[..., 2, :, :])

    def modes(self, q: Any = None, *, motors: Literal["free", "held"] = "free") -> list[Mode]:
        """The small vibrations about rest, the lowest first: of springs and gravity, without friction.

        The motors hold the links against gravity, and springs have the stiffness that they have there.

        Parameters
        ----------
        q : array of shape (nq,), optional
            The position of rest; `neutral` without it.
        motors : {"free", "held"}
            Whether motors turn freely or brakes hold them, and rigid joints too.

        Raises
        ------
        ParameterError
            A free base under gravity, which is never at rest.

        Examples
        --------
        >>> from flexure import Chain
        >>> rod = '''<robot name="pendulum"><link name="world"/><link name="rod"><inertial>
        ...   <origin xyz="0 0 -0.5"/><mass value="2"/><inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.001"/>
        ... </inertial></link><joint name="pivot" type="continuous"><parent link="world"/><child link="rod"/><axis xyz="0 1 0"/>
        ... </joint></robot>'''
        >>> [round(mode.frequency, 3) for mode in Chain.from_text(rod).modes()]
        [0.644]
        """
        return _modes(self._core, self.neutral if q is None else vector(q, "q", self.nq), motors)

    def energy(self, q: Any, v: Any) -> Energy:
        """The kinetic and the potential energy, J."""
        shape, (q, v) = self._states(q=q, v=v)
        found = self._core.energy(q, v).reshape(*shape, 2)
        return Energy(found[..., 0], found[..., 1])

    def centroidal_momentum(self, q: Any, v: Any) -> Momentum:
        """The momentum about the centre of mass, which without gravity is conserved where the base is free."""
        shape, (q, v) = self._states(q=q, v=v)
        found = self._core.centroidal_momentum(q, v).reshape(*shape, 3, 3)
        return Momentum(found[..., 0, :], found[..., 1, :], found[..., 2, :])

    def simulate(
        self,
        duration: float,
        dt: float,
        torque: Any = None,
        *,
        q: Any = None,
        v: Any = None,
        motor_q: Any = None,
        motor_v: Any = None,
        base: Any = None,
        rtol: float = 1e-9,
        atol: float = 1e-12,
        integrator: Literal["auto", "dop853", "radau"] = "auto",
    ) -> dict[str, Array]:
        """The motion over `duration` s, at instants `dt` s apart.

        Nothing acts on a free base. A fixed one may be moved. Limits of joints are not kept. Many runs are simulated on all cores, each with the
        bits that it has alone; what is given without runs is that of all.

        Parameters
        ----------
        duration, dt : float
            In s; the motion has ``duration / dt + 1`` instants.
        torque : array of shape (driven,), (instants, driven) or (runs, instants, driven), optional
            The torques of the joints that are `driven`, each held until the next instant; without it none act. Seen from the link's side of the gear.
        q, v : array of shape (nq,) or (runs, nq), (nv,) or (runs, nv), optional
            The state at the start; at rest in `neutral` without them.
        motor_q, motor_v : array of shape (flexible,) or (runs, flexible), one value a flexible joint, optional
            Angles and velocities of the motors at the start; those of the links without them, so that no spring is bent.
        base : array of shape (instants, 7), optional
            How a fixed base is moved, as by a ship or a vehicle: its position in the world, m, and its orientation as a quaternion, ``[x, y, z, qx,
            qy, qz, qw]``, of any length but zero, at every instant; it turns by at most 90 degrees from one to the next. Accelerations are
            continuous, and follow from the seven nearest instants, so smooth measured poses first. Without it the base stays at the origin.
        rtol, atol : float
            The error of a step, relative to a component of the state (1e-14 to 0.1), and the one that is always allowed.
        integrator : {"auto", "dop853", "radau"}
            The method: explicit of order 8 (Dormand and Prince), implicit of order 13 (Radau IIA), or by default the explicit one until the motion is
            stiff, and then the one that gets further for its work.

        Returns
        -------
        dict of arrays of shape (instants,) or (runs, instants)
            ``t``, and for a joint "a" ``tau_a``, ``q_a``, ``dq_a``, of a flexible one ``qm_a`` and ``dqm_a`` too, of a passive one no ``tau_a``; of a base that floats or is moved ``base_x`` to
            ``base_z``, ``base_qx`` to ``base_qw``, ``base_vx`` to ``base_vz`` and ``base_wx`` to ``base_wz``, the velocities in the base's own axes.

        Raises
        ------
        DataError
            Arrays of another shape, or with values that are not finite.
        ParameterError
            A quaternion of length zero, a turn by more than 90 degrees, or a motion of a base that floats.

        Examples
        --------
        >>> import numpy as np
        >>> from flexure import Chain
        >>> arm = Chain.preset("free-space-arm")
        >>> run = arm.simulate(10.0, 0.1, [1.0, 0.0])  # a constant torque of the shoulder
        >>> bool(run["q_joint1"][-1] > 0 > run["base_qz"][-1])  # the base turns back
        True
        >>> ship = np.zeros((101, 7))  # heaves by 0.5 m, once in 8 s
        >>> ship[:, 2], ship[:, 6] = 0.5 * np.sin(2 * np.pi / 8 * np.linspace(0, 10, 101)), 1.0
        >>> run = Chain.preset("six-joint-arm").simulate(10.0, 0.1, base=ship)
        >>> round(float(run["base_vz"][0]), 4)
        0.3927
        """
        joints = len(self.joints)
        flexible = np.array(self._core.flexible, bool)
        own = {
            "q": self.neutral if q is None else vectors(q, "q", self.nq),
            "v": np.zeros(self.nv) if v is None else vectors(v, "v", self.nv),
        }
        motors = [
            own[of][..., -joints:][..., flexible] if given is None else vectors(given, f"motor_{of}", int(flexible.sum()))
            for of, given in (("q", motor_q), ("v", motor_v))
        ]
        torque = None if torque is None else np.asarray(torque)
        runs, initial = starts([own["q"], motors[0], own["v"], motors[1]], torque)
        duration, dt = finite_number(duration, "duration"), finite_number(dt, "dt")
        instants = self._core.instants(duration, dt, runs or 1)
        columns = [] if torque is None else torques(torque, self.driven, instants, runs)
        tolerances = (finite_number(rtol, "rtol"), finite_number(atol, "atol"))
        moved = None if base is None else poses(np.asarray(base), instants)
        found = self._core.simulate(columns, moved, initial.tolist(), (duration, dt), tolerances, integrator)
        return found if runs is None else {name: values.reshape(runs, -1) for name, values in found.items()}

    def _states(self, **given: Any) -> tuple[tuple[int, ...], list[Array]]:
        """The shape of the states, and their values one after the other."""
        shape: tuple[int, ...] | None = None
        flat = []
        for name, values in given.items():
            array = np.asarray(values)
            width = self.nq if name == "q" else self.nv
            if array.ndim == 0 or array.shape[-1] != width:
                raise DataError(f"'{name}' has the shape {array.shape}, but this chain needs (..., {width})")
            if shape is None:
                shape = array.shape[:-1]
            elif array.shape[:-1] != shape:
                first = next(iter(given))
                raise DataError(f"'{name}' has {array.shape[:-1]} states, but '{first}' has {shape}")
            flat.append(samples(array.reshape(-1), name))
        return shape or (), flat


def _modes(core: _core.Chain | _core.FlexibleArm, q: Array, motors: str) -> list[Mode]:
    """The modes near rest at a position."""
    if motors not in ("free", "held"):
        raise ParameterError(f"motors is {motors!r}, but must be 'free' or 'held'")
    return [
        Mode(math.sqrt(square) / (2 * math.pi) if square >= 0 else math.nan, damping, np.array(shape))
        for square, damping, shape in core.modes(q.tolist(), motors == "held")
    ]
