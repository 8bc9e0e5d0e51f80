"""The plant: MuJoCo's simulation of a robot, built from its Pinocchio model (`robots.mechanics.model`).

The model is not built from the URDF: its joints are in Pinocchio's order, and M, C·v + g, kinematics and
accelerations equal Pinocchio's to 1e-9. With `contacts` the robot touches itself and the objects of the
world; otherwise links pass through each other. With `joint_stops` a joint stops at its limits; otherwise a
joint that is pushed past its limit continues to move.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import mujoco
import numpy as np

from robots.arrays import Array
from robots.errors import InputError
from robots.joints import coupling
from robots.mechanics.contacts import Contact, Touch, contacts, touch_of
from robots.mechanics.model import compiled
from robots.robot import Robot
from robots.settings import PlantSettings
from robots.signals import Encoders, Motors, PlantState, as_vector
from robots.truth import encoder_resolution
from robots.world import World, check_world

_ZERO = (0.0, 0.0, 0.0)
_BROKEN = 1e6  # rad/s or m/s
# By default MuJoCo prints warnings and writes a log file to the user's folder.
mujoco.set_mju_user_warning(lambda _: None)


class Plant:
    """A robot in MuJoCo under torque control, integrated with RK4. SI units, world axes, joints in
    Pinocchio's order. With the same calls, all numbers are bitwise the same.

    `broken`: whether the simulation has diverged since the last reset; the robot was then stopped. Queries
    (`mass_matrix`, `bias`, `jacobian`, `frame_pose`, `acceleration`, `holding_torque`) return properties of
    the plant with its settings, and never change the simulation.
    """

    def __init__(
        self, robot: Robot, settings: PlantSettings | None = None, timestep: float = 1e-3, world: World = ()
    ) -> None:
        """timestep: s, the longest internal step; world: objects that the robot can touch with `contacts`.
        Raises InputError for an invalid setting, timestep or world."""
        if not (math.isfinite(timestep) and 0.0 < timestep <= 0.01):
            raise InputError(f"plant timestep is {timestep} s; give a value above 0 and at most 0.01.")
        self.robot = robot
        # MuJoCo's joints of the robot come first; some of them may follow others: G (joints, n), or None.
        self._joints = robot.model.njoints - 1
        self._own = np.array(robot.joints) - 1 if self._joints > robot.n else slice(0, robot.n)
        self._G = coupling(robot.model) if self._joints > robot.n else None
        check_world(world)
        self.timestep = timestep
        self.world = world
        self._build(PlantSettings() if settings is None else settings)
        self.reset(robot.home)

    def _build(self, settings: PlantSettings, model: mujoco.MjModel | None = None) -> None:
        robot = self.robot
        self._model = compiled(robot, settings, self.world) if model is None else model
        self.settings = settings
        self._data, self._probe = mujoco.MjData(self._model), mujoco.MjData(self._model)
        self._fresh = False
        self._armature = self._model.dof_armature[self._own].copy()
        self._diagonal = settings.per_joint("diagonal_scale", robot.n)
        self._resolution = encoder_resolution(robot, settings)
        self._altered, self._rounds = bool((self._diagonal != 1.0).any()), bool(self._resolution.any())
        limit = robot.tau_limit if settings.saturate else np.full(robot.n, np.inf)
        self._tau_lower, self._tau_upper = -limit, limit
        self._lag, self._delay = 1e-3 * settings.torque_lag_ms, 1e-3 * settings.delay_ms

    @property
    def n(self) -> int:
        """Number of joints."""
        return self.robot.n

    @property
    def t(self) -> float:
        """Time since the reset, s."""
        return float(self._data.time)

    @property
    def q(self) -> np.ndarray:
        """(n,) rad, the true position."""
        return self._data.qpos[self._own].copy()

    @property
    def v(self) -> np.ndarray:
        """(n,) rad/s, the true velocity."""
        return self._data.qvel[self._own].copy()

    @property
    def tau(self) -> np.ndarray:
        """(n,) N·m, the torque that acts on the joints, after saturation, delay and lag."""
        return self._motors.torque.copy()

    @property
    def touch(self) -> Touch:
        """The contacts of the robot with itself or the world during the last step."""
        return self._touch

    @property
    def contacts(self) -> tuple[Contact, ...]:
        """The points of contact at the present moment, with the forces at the torque of the last step."""
        if not self._seen.ncon:
            return ()
        self._accelerate(self._data.qpos, self._data.qvel, self._data.ctrl)
        self._fresh = False
        return contacts(self._model, self._probe, self.robot, self.world)

    def reset(self, q: np.ndarray, v: np.ndarray | None = None, tau: np.ndarray | None = None) -> None:
        """Sets the state q (rad), v (default 0), t = 0 without a push; free objects return to their start.

        tau: N·m, previous torque of the motors; default: `holding_torque`, as when brakes are released.
        Raises ValueError for vectors of the wrong length or with non-finite entries.
        """
        position = as_vector("q", q, self.n)
        velocity = np.zeros(self.n) if v is None else as_vector("v", v, self.n)
        torque = None if tau is None else as_vector("tau", tau, self.n)
        mujoco.mj_resetData(self._model, self._data)
        for values, given in ((self._data.qpos, position), (self._data.qvel, velocity)):
            values[: self._joints] = given if self._G is None else self._G @ given
        self._push: tuple[str | None, np.ndarray] = (None, np.zeros(6))
        self._fresh = self.broken = False
        self._touch = Touch()
        torque = self.holding_torque() if torque is None else torque
        self._motors = Motors(np.clip(torque, self._tau_lower, self._tau_upper), 0.0)
        self._encoders = Encoders(position, velocity, 0.0)

    def measure(self, period: float) -> PlantState:
        """Returns the measured state. With ideal encoders it is the true state; otherwise q is rounded and v
        is its backward difference over `period` (s, the control period). The call changes nothing.
        """
        if not self._rounds:
            return PlantState(self.t, self.q, self.v)
        q, v = self._encoders.read(period, self._resolution)
        return PlantState(self.t, q, np.where(self._resolution > 0.0, v, self.v))

    def step(self, tau: np.ndarray, period: float) -> np.ndarray:
        """Simulates `period` (s) with the command tau (n,), N·m, in equal internal steps, at most the
        timestep long. Returns the torque (n,) that acts at the end. Raises ValueError, and simulates nothing,
        if the command is not n finite numbers.
        """
        if not (math.isfinite(period) and period > 0.0):
            raise ValueError(f"the period is {period} s; it must be positive")
        data, motors = self._data, self._motors
        asked = as_vector("tau", tau, self.n)
        motors.command(np.minimum(np.maximum(asked, self._tau_lower), self._tau_upper), data.time)
        count = max(1, math.ceil(period / self.timestep - 1e-9))
        h = period / count
        self._model.opt.timestep = h
        self._touch = Touch()
        for _ in range(count):
            data.ctrl[:] = motors.advance(data.time, h, self._delay, self._lag)
            self._advance(h)
            self._encoders.record(self.q, data.time)
            self._feel()
        self._fresh = False
        return motors.torque.copy()

    def push(
        self,
        body: str | None,
        force: tuple[float, float, float] | np.ndarray = _ZERO,
        torque: tuple[float, float, float] | np.ndarray = _ZERO,
    ) -> None:
        """Applies a force (N) and a torque (N·m) in world axes at the centre of mass of a moving body, until
        the next call; None ends the push. body: the joint that moves the body, or any frame on it. Raises
        InputError for an unknown or fixed body, ValueError for a wrench that is not finite.
        """
        wrench = np.concatenate([np.asarray(force, dtype=float), np.asarray(torque, dtype=float)])
        if wrench.shape != (6,) or not np.all(np.isfinite(wrench)):
            raise ValueError("force and torque of a push must be three finite numbers each")
        self._data.xfrc_applied[:] = 0.0
        self._push = (None, np.zeros(6))
        if body is not None:
            self._data.xfrc_applied[self.robot.moving_body(body)] = wrench
            self._push = (body, wrench)
        self._fresh = False

    def configure(self, settings: PlantSettings, model: mujoco.MjModel | None = None) -> None:
        """Changes the plant while it runs. t, q, v, push and the states of motors and encoders are kept.
        Without `model` (`compiled`), raises InputError, and changes nothing, if the settings do not fit."""
        old, (body, wrench) = self._data, self._push
        self._build(settings, model)
        self._motors.limit(self._tau_lower, self._tau_upper)
        self._data.time = old.time
        for name in ("qpos", "qvel", "qacc_warmstart"):
            # The robot's part comes first. Objects exist only with contacts.
            now, before = getattr(self._data, name), getattr(old, name)
            k = self._joints if len(now) != len(before) else len(now)
            now[:k] = before[:k]
        self._touch = Touch()
        if body is not None:
            self._data.xfrc_applied[self.robot.moving_body(body)] = wrench

    def mass_matrix(self) -> np.ndarray:
        """Returns M(q) with payload and armature, (n, n) kg·m²."""
        return self._inertia(self._look())

    def bias(self) -> np.ndarray:
        """Returns C(q, v)·v + g(q), (n,) N·m: M q̈ + bias = τ − friction + push."""
        return self._reduced(self._look().qfrc_bias)

    def holding_torque(self) -> np.ndarray:
        """Returns the torque, (n,) N·m, that holds the plant at q without a push or friction (v = q̈ = 0)."""
        probe = self._probe
        probe.qpos[:], probe.qvel[:] = self._data.qpos, 0.0
        mujoco.mj_fwdPosition(self._model, probe)
        mujoco.mj_fwdVelocity(self._model, probe)
        self._fresh = False
        return self._reduced(probe.qfrc_bias)

    def jacobian(self, frame: str) -> np.ndarray:
        """Returns the Jacobian of a frame's origin, (6, n), world axes: linear (m/rad), then angular rows."""
        J = np.zeros((6, self._model.nv))
        mujoco.mj_jacSite(self._model, self._look(), J[:3], J[3:], self._site(frame))
        return J[:, : self.n].copy() if self._G is None else J[:, : self._joints] @ self._G

    def frame_pose(self, frame: str) -> tuple[np.ndarray, np.ndarray]:
        """Returns the orientation R, (3, 3), and the position p, (3,) m, of a frame in the world."""
        site, probe = self._site(frame), self._look()
        return probe.site_xmat[site].reshape(3, 3).copy(), probe.site_xpos[site].copy()

    def acceleration(self, tau: np.ndarray) -> np.ndarray:
        """Returns the acceleration, (n,) rad/s², if the torque tau (N·m) acted on the joints now: with
        friction, damping and push, without saturation, delay and lag."""
        found = self._accelerate(self._data.qpos, self._data.qvel, as_vector("tau", tau, self.n))
        self._fresh = True
        return found[self._own].copy()

    def objects(self) -> np.ndarray:
        """Returns the poses of the free objects in order, (k, 7): position, m; quaternion (w, x, y, z)."""
        if self.settings.contacts:
            return self._data.qpos[self._joints :].reshape(-1, 7).copy()
        return np.array([thing.pose for thing in self.world if thing.free]).reshape(-1, 7)

    def object_velocities(self) -> np.ndarray:
        """Returns the velocities of the middles of the free objects in order, (k, 3) m/s, world axes."""
        return self._data.qvel[self._joints :].reshape(-1, 6)[:, :3].copy()

    def carry(self, place: int, position: np.ndarray, velocity: np.ndarray) -> None:
        """Sets position, (3,) m, and velocity, (3,) m/s, of the free object with this index in `objects`, as
        if somebody carried it; requires `contacts`."""
        q, v = self._data.qpos[self._joints :].reshape(-1, 7), self._data.qvel[self._joints :].reshape(-1, 6)
        q[place, :3], v[place, :3], self._fresh = position, velocity, False

    def _advance(self, h: float) -> None:
        data, before = self._data, self._data.qpos.copy()
        if self._altered:
            q, v, tau = data.qpos, data.qvel, data.ctrl.copy()
            q[:], v[:] = rk4(q, v, h, lambda q, v: self._accelerate(q, v, tau))
            data.time += h
        else:
            mujoco.mj_step(self._model, data)
        if not ((v := data.qvel).dot(v) < _BROKEN**2 or np.abs(v).max() < _BROKEN):  # true for NaN, too
            data.qpos[:], data.qvel[:], data.qacc_warmstart[:] = before, 0.0, 0.0
            self.broken = True

    def _accelerate(self, q: np.ndarray, v: np.ndarray, tau: np.ndarray) -> np.ndarray:
        """Returns q̈ at q and v for the torque tau and the push, computed with `_probe`."""
        model, data, probe = self._model, self._data, self._probe
        probe.qpos[:], probe.qvel[:], probe.ctrl[:] = q, v, tau
        probe.xfrc_applied[:], probe.qacc_warmstart[:] = data.xfrc_applied, data.qacc_warmstart
        self._place(probe)
        mujoco.mj_forwardSkip(model, probe, mujoco.mjtStage.mjSTAGE_POS, 1)
        return probe.qacc.copy()

    def _place(self, data: mujoco.MjData) -> None:
        """Computes kinematics and M(q). A scaled diagonal of M is represented by an armature for this q."""
        mujoco.mj_fwdPosition(self._model, data)
        if self._altered:
            M = self._inertia(data)
            self._model.dof_armature[self._own] = self._armature + (self._diagonal - 1.0) * M.diagonal()
            mujoco.mj_fwdPosition(self._model, data)
            self._model.dof_armature[self._own] = self._armature

    def _reduced(self, values: np.ndarray) -> np.ndarray:
        """Returns Gᵀ x of values x (m, …) with a row for each of MuJoCo's coordinates, (n, …)."""
        return values[: self.n].copy() if self._G is None else self._G.T @ values[: self._joints]

    def _inertia(self, data: mujoco.MjData) -> np.ndarray:
        """Returns M(q) of the coordinates, (n, n)."""
        M = np.zeros((self._model.nv, self._model.nv))
        mujoco.mj_fullM(self._model, data, M)
        if self._G is None:
            return M[: self.n, : self.n].copy()
        return self._G.T @ M[: self._joints, : self._joints] @ self._G

    @property
    def _seen(self) -> mujoco.MjData:
        """MuJoCo's data at the last stage of the last step, with its contacts."""
        return self._probe if self._altered else self._data

    def _feel(self) -> None:
        """Records the contacts at the last stage of an internal step."""
        if self._seen.ncon:
            now = touch_of(self._model, self._seen, self.robot)
            self._touch = Touch(max(self._touch.depth, now.depth), max(self._touch.force, now.force))

    def _look(self) -> mujoco.MjData:
        if not self._fresh:
            self._probe.qpos[:], self._probe.qvel[:] = self._data.qpos, self._data.qvel
            self._place(self._probe)
            mujoco.mj_fwdVelocity(self._model, self._probe)
            self._fresh = True
        return self._probe

    def _site(self, frame: str) -> int:
        return self._model.site(f"frame{self.robot.frame_id(frame)}").id


def rk4(q: Array, v: Array, h: float, acceleration: Callable[[Array, Array], Array]) -> tuple[Array, Array]:
    """Returns (q, q̇) after a step of h (s) from q (n,) and v (n,). `acceleration` computes q̈ (n,) from q
    and q̇.

    Stages and weights are those of MuJoCo's RK4, for joints with one degree of freedom.
    """
    slopes = [np.array((v, acceleration(q, v)))]
    for share in (0.5, 0.5, 1.0):
        q_stage, v_stage = (q, v) + share * h * slopes[-1]
        slopes.append(np.array((v_stage, acceleration(q_stage, v_stage))))
    first, second, third, fourth = slopes
    q_end, v_end = (q, v) + (h / 6.0) * (first + 2.0 * second + 2.0 * third + fourth)
    return q_end, v_end
