"""Simulate an arm in MuJoCo, with its own drives, encoders, controller and clock.

`MujocoArm.advance(until, setpoint)` steps the arm to a time and returns its reports. The simulation uses no network and
no system clock. The joints are those of the robot model, so equal joints give the same flange pose as on the timeline;
the masses come from `twin.dynamics`. The controller reads the encoders at 1 kHz. It uses computed torque (Luh, Walker
and Paul, 1980), or a proportional-derivative law for each joint.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from enum import Enum
from typing import Any, NamedTuple

import mujoco
import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from vrs_cli.bodies import scenario
from vrs_cli.contacts.physics import link_bodies
from vrs_cli.kinematics.arrays import Floats
from vrs_cli.kinematics.joints import JointKind, Joints
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.twin.dynamics import GRAVITY, InertialModel, inertial_model, mass_matrix
from vrs_cli.values.measured import BodyMode, Report

STEP = 1e-3  # [s] time step of the controller and of the simulation
TICKS = 8  # number of simulation steps between two set points, which a quintic interpolates
SLIDE = 0.1  # [m/rad] resolution and noise of a prismatic joint, divided by the same values of a revolute joint
MIN_MASS = 1e-9  # [kg] minimum mass, because MuJoCo requires a mass for each moving body
END_STOP = 0.02  # [rad, m] distance from the end of a joint's range to its mechanical stop (our choice)
STILL = 1e-2  # [rad/s, m/s] speed of a joint below which its brake locks
BRAKE = 1.5  # ratio of a brake's torque to the maximum torque of its motor (our choice)
FADE = 0.2  # [s] minimum time in which an arm that begins to follow reaches its set points
GENTLE = 0.5  # fraction of the maximum velocity at which a joint then approaches the set points
FRICTION_AT = 2e-3  # [rad/s, m/s] speed above which nearly all Coulomb friction is compensated
LOCK = (0.9999, 0.9999, 1e-3, 0.5, 2.0)  # MuJoCo's `solimp` for brakes and blocked joints: as stiff as MuJoCo allows

ALPHA = 0.3  # position gain of the filter of the encoder readings
BETA = ALPHA * ALPHA / (2.0 - ALPHA)

State = Floats  # (3, n): joints, velocities, accelerations
SetPoint = Callable[[float], tuple[Sequence[float], Sequence[float], Sequence[float]]]


class Controller(Enum):
    """The control law: computed torque from a model of the arm, or an independent PD law for each joint."""

    COMPUTED = "computed"
    PD = "pd"


class ArmSettings(Struct, frozen=True):
    """Settings of an arm: the `bandwidth` of the critically damped controller [rad/s]; the rate of reports [1/s]; the
    `resolution` and the `noise` (standard deviation) of the encoders [rad]. For prismatic joints both are a tenth of
    these values, in metres."""

    controller: Controller = Controller.COMPUTED
    bandwidth: float = 40.0
    report_rate: float = 100.0
    resolution: float = 2.0**-16 * 6.283185307179586
    noise: float = 2e-5


USUAL_SETTINGS = ArmSettings()


class _Brake(NamedTuple):
    """A braking motion to rest from given joints and velocities (n,), with one constant deceleration per joint (n,)."""

    joints: Floats
    velocity: Floats
    deceleration: Floats

    def at(self, s: float) -> State:
        """Return the state after s seconds."""
        slowing = np.minimum(s, np.abs(self.velocity) / self.deceleration)  # [s] time for which a joint has slowed down
        a = -np.sign(self.velocity) * self.deceleration
        moves = s < np.abs(self.velocity) / self.deceleration
        joints = self.joints + slowing * (self.velocity + 0.5 * slowing * a)
        return np.array([joints, np.where(moves, self.velocity + slowing * a, 0.0), np.where(moves, a, 0.0)])


class _Quintic(NamedTuple):
    """The polynomial of degree 5 between two states, over `T` seconds: coefficients (6, n)."""

    T: float
    coefficients: Floats

    @classmethod
    def between(cls, begin: State, end: State, T: float) -> _Quintic:
        """Return the polynomial from one state to another in `T` seconds."""
        return cls(T, np.linalg.solve(_ends(T), np.concatenate([begin, end])))

    def at(self, s: float) -> State:
        """Return the state after s seconds."""
        return _powers(np.array([s]))[:, 0] @ self.coefficients


def _powers(s: Floats) -> Floats:
    """Return matrices (3, k, 6) that map coefficients (6,) to the value and two derivatives at times s (k,)."""
    k = np.arange(6)
    value = s[:, None] ** k
    rate = k * s[:, None] ** np.maximum(k - 1, 0)
    return np.stack([value, rate, k * (k - 1) * s[:, None] ** np.maximum(k - 2, 0)])


def _ends(T: float) -> Floats:
    """Return the matrix (6, 6) that maps coefficients (6,) to the states at 0 and at T [s]."""
    return _powers(np.array([0.0, T])).transpose(1, 0, 2).reshape(6, 6)


# matrices (3, TICKS, 6) that map the states at both ends of TICKS steps (6, n) to the state at the start of each step
AT_BEGIN: Floats = _powers(STEP * np.arange(TICKS, dtype=np.float64)) @ np.linalg.inv(_ends(TICKS * STEP))


class MujocoArm:
    """An arm that follows set points and reports its joints. `seed`: the seed of the noise of its encoders. `joints`:
    its joints at the time `start` of the robot's clock [s]; None: READY. Raises NotAvailable for a robot with unknown
    masses."""

    def __init__(
        self,
        model: RobotModel,
        *,
        seed: int = 0,
        controller: Controller | str = Controller.COMPUTED,
        settings: ArmSettings = USUAL_SETTINGS,
        joints: Joints | None = None,
        start: float = 0.0,
        disturbances: Sequence[scenario.Disturbance] = (),
    ) -> None:
        self.model, self.inertial = model, inertial_model(model)
        self.settings = replace(settings, controller=Controller(controller))
        self.mode = BodyMode.FOLLOWS
        self._random = np.random.default_rng(seed)
        self._m, self._d = compile_arm(model, self.inertial)
        # the model of the arm with which the controller computes torques
        self._own, self._guess = compile_arm(model, self.inertial)
        self._own.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
        self._own.dof_frictionloss[:] = 0.0
        self._flange = int(self._m.body(f"link{model.joint_count}").id)
        w = self.settings.bandwidth
        self._gains = w * w, 2.0 * w
        scale = np.array([SLIDE if link.kind is JointKind.PRISMATIC else 1.0 for link in model.links])
        self._resolution, self._noise = settings.resolution * scale, settings.noise * scale
        self._start, self._steps = start, 0
        self._every = max(1, round(1.0 / (settings.report_rate * STEP)))
        q = np.array(model.poses["ready"] if joints is None else joints)
        self._d.qpos[:] = self._guess.qpos[:] = q
        self._seen, self._rate = (
            self._guess.qpos,
            self._guess.qvel,
        )  # joints and velocities as the controller estimates them
        self._pushed = False
        self._effort, self._push = np.zeros_like(q), np.zeros_like(q)
        self._weights = np.diag(mass_matrix(model, self.inertial, q[None])[0])  # weights of the PD gains
        mujoco.mj_forward(self._m, self._d)
        self._reference = _rest_state(q)
        self._brake: _Brake | None = None  # the braking motion after an order to hold
        self._offset: _Quintic | None = None  # the offset of the arm from the set points, which fades to zero
        self._since = start
        self._arrives = True  # whether the next set point is the first one to follow
        # time of the robot's clock, the arm's clock at that time, and the gain of the
        # arm's clock per second since then [s/s]
        self._clock = (start, start, 0.0)
        self._waiting = sorted((one for one in disturbances if one.at is not None), key=_begin)
        # disturbances that act now, with the times at which they end [s]
        self._active = list[tuple[float, scenario.Disturbance]]()
        for one in disturbances:
            if one.at is None:
                self.disturb(one)

    # --- state and orders ---

    @property
    def time(self) -> float:
        """Return the robot's clock [s]."""
        return self._start + self._steps * STEP

    @property
    def joints(self) -> Joints:
        """Return the real joints [rad, m]."""
        return tuple(self._d.qpos.tolist())

    def own_time(self, t: float) -> float:
        """Return the time of the arm's own clock at a time of the robot's clock [s]."""
        begin, own, rate = self._clock
        return own + (1.0 + rate) * (t - begin)

    def order(self, mode: BodyMode) -> None:
        """Follow the set points, or hold still, as the server orders. After an emergency stop the arm does not follow
        again until the stop has been released and a new order to follow arrives."""
        if mode is BodyMode.STOPPED or self.mode is BodyMode.STOPPED or mode is self.mode:
            return
        self.mode, self._since = mode, self.time
        if mode is BodyMode.HOLDS:
            self._brake = self._new_brake()
        else:
            self._arrives = True

    def disturb(self, disturbance: scenario.Disturbance | scenario.Release) -> None:
        """Begin a disturbance, now or at its own time; or end all current disturbances of a kind."""
        if isinstance(disturbance, scenario.Release):
            self._end([one for _, one in self._active if isinstance(one, disturbance.kind or scenario.Disturbance)])
        elif disturbance.at is not None and disturbance.at > self.time:
            self._waiting = sorted([*self._waiting, disturbance], key=_begin)
        else:
            self._begin(disturbance)

    # --- time ---

    def advance(self, until: float, setpoint: SetPoint) -> list[Report]:
        """Step to the time `until` of the robot's clock [s], and return the reports, stamped by the arm's own clock.

        `setpoint` returns joints, velocities and accelerations at a time of the arm's own clock. The arm requests the
        set point TICKS steps ahead, and then does these TICKS steps; so it may end up to TICKS steps after `until`.
        """
        found = list[Report]()
        while self.time < until - 1e-9:
            self._disturbances_now()
            self._steps_to(self._next(setpoint), found)
        return found

    def _next(self, setpoint: SetPoint) -> State:
        """Return the state that the controller should reach after TICKS steps (the reference)."""
        t = self.time + TICKS * STEP
        if self.mode is BodyMode.STOPPED:
            return _rest_state(self._seen)
        if self.mode is BodyMode.HOLDS:
            assert self._brake is not None  # the order to hold has set it
            return self._brake.at(t - self._since)
        if self._arrives:
            off = self._reference - np.array(setpoint(self.own_time(self.time)))
            off[2] = 0.0  # accelerations may jump, because torques may jump: let only joints and velocities fade
            fastest = np.array(self.model.max_velocity)
            far = float(np.max(np.abs(off[0]) / fastest + np.abs(off[1]) / np.array(self.model.max_acceleration)))
            # limit the peak velocity of the quintic, which is 15/8 of its mean
            T = max(FADE, 15.0 / 8.0 * far / GENTLE)
            self._offset, self._since = _Quintic.between(off, np.zeros_like(off), T), self.time
            self._arrives = False
        wanted = np.array(setpoint(self.own_time(t)))
        if self._offset is not None:
            if t - self._since >= self._offset.T:
                self._offset = None
            else:
                wanted += self._offset.at(t - self._since)
        return wanted

    def _steps_to(self, target: State, found: list[Report]) -> None:
        """Do TICKS steps of the controller and of the arm, towards the reference `target`."""
        joints, velocities, accelerations = AT_BEGIN @ np.concatenate([self._reference, target])
        stiffness, damping = self._gains
        wanted = stiffness * joints + damping * velocities
        friction = self.inertial.coulomb * np.tanh(velocities * (1.0 / FRICTION_AT))
        noise = self._random.standard_normal((TICKS, len(self._noise))) * (self._noise / self._resolution)
        stopped, computed = self.mode is BodyMode.STOPPED, self.settings.controller is Controller.COMPUTED
        if computed:
            wanted += accelerations
        limit, effort, applied = self.inertial.max_torque, self._effort, self._d.qfrc_applied
        for k in range(TICKS):
            self._observe(noise[k], accelerations[k])
            error = wanted[k] - stiffness * self._seen
            error -= damping * self._rate
            if stopped:
                effort[:] = 0.0
            else:
                if computed:
                    self._guess.qacc[:] = error
                    mujoco.mj_inverse(self._own, self._guess)
                    np.add(self._guess.qfrc_inverse, friction[k], out=effort)
                else:
                    np.multiply(self._weights, error, out=effort)
                np.minimum(effort, limit, out=effort)
                np.maximum(effort, -limit, out=effort)
            applied[:] = effort
            if self._pushed:
                applied += self._push
            mujoco.mj_step(self._m, self._d)
            self._steps += 1
            if self._steps % self._every == 0:
                found.append(self._report())
        self._reference = target
        if stopped:  # lock joints that have stopped, as brakes do, unless a brake slips
            slipping = {one.joint - 1 for _, one in self._active if isinstance(one, scenario.SlippingBrake)}
            for i, rate in enumerate(self._d.qvel.tolist()):
                if abs(rate) < STILL and i not in slipping and not self._d.eq_active[i]:
                    self._hold_joint(i, True)

    def _observe(self, noise: Floats, acceleration: Floats) -> None:
        """Read the encoders, and filter them with fixed gains (Benedict and Bordner, 1962). This changes arrays in
        place, to save time."""
        seen, rate = self._seen, self._rate
        change = acceleration * STEP
        seen += STEP * rate
        seen += (0.5 * STEP) * change
        rate += change
        missed = self._d.qpos / self._resolution
        missed += noise
        np.rint(missed, out=missed)
        missed *= self._resolution
        missed -= seen
        seen += ALPHA * missed
        rate += (BETA / STEP) * missed

    def _report(self) -> Report:
        """Return a report of the encoder readings, and of the controller's velocities and torques."""
        noise = self._noise * self._random.standard_normal(len(self._noise))
        read = np.rint((self._d.qpos + noise) / self._resolution) * self._resolution
        rate, effort = tuple(self._rate.tolist()), tuple(self._effort.tolist())
        return Report(self.own_time(self.time), tuple(read.tolist()), rate, effort, self.mode)

    # --- disturbances ---

    def _disturbances_now(self) -> None:
        """Begin and end the disturbances whose time has come, and sum up the pushes that act now."""
        if not (self._waiting or self._active or self._pushed):
            return
        while self._waiting and _begin(self._waiting[0]) <= self.time + 1e-9:
            self._begin(self._waiting.pop(0))
        self._end([one for end, one in self._active if end <= self.time + 1e-9])
        pushes = [one for _, one in self._active if isinstance(one, scenario.Push)]
        self._pushed = bool(pushes)
        self._push[:] = 0.0
        flange = self._flange
        for push in pushes:
            mujoco.mj_applyFT(self._m, self._d, push.force, np.zeros(3), self._d.xpos[flange], flange, self._push)
            if push.joint:
                self._push[push.joint - 1] += push.torque

    def _begin(self, one: scenario.Disturbance) -> None:
        self._active.append((float("inf") if one.lasting is None else self.time + one.lasting, one))
        self._apply(one, on=True)

    def _end(self, ended: Sequence[scenario.Disturbance]) -> None:
        self._active = [row for row in self._active if row[1] not in ended]
        for one in ended:
            self._apply(one, on=False)

    def _apply(self, one: scenario.Disturbance, *, on: bool) -> None:
        match one:
            case scenario.Payload():
                self._carry([load for _, load in self._active if isinstance(load, scenario.Payload)])
            case scenario.BlockedJoint(joint=joint):
                blocked = any(
                    isinstance(other, scenario.BlockedJoint) and other.joint == joint for _, other in self._active
                )
                self._hold_joint(joint - 1, blocked)
            case scenario.SlippingBrake(joint=joint):
                if self.mode is BodyMode.STOPPED:
                    self._hold_joint(joint - 1, False)
                    self._set_brakes()
            case scenario.EmergencyStop():
                if on:
                    self.mode = BodyMode.STOPPED
                elif not any(isinstance(other, scenario.EmergencyStop) for _, other in self._active):
                    self._release_brakes()
                self._set_brakes()
            case scenario.ClockDrift(rate=rate, jump=jump):
                own = self.own_time(self.time)
                self._clock = (self.time, own + jump, rate) if on else (self.time, own, 0.0)

    def _carry(self, loads: Sequence[scenario.Payload]) -> None:
        """Add loads at the flange to the mass of the last link."""
        mass, centre, inertia = (x[-1] for x in self.inertial[:3])
        for load in loads:
            at, m = np.array(load.centre), load.mass
            apart, total = at - centre, mass + m
            inertia = inertia + mass * m / total * (apart @ apart * np.eye(3) - np.outer(apart, apart))
            mass, centre = total, (mass * centre + m * at) / total
        _set_inertia(self._m, self.model.joint_count, mass, centre, inertia)
        mujoco.mj_setConst(self._m, mujoco.MjData(self._m))

    def _hold_joint(self, i: int, held: bool) -> None:
        """Lock a joint at its current position, or unlock it."""
        self._m.eq_data[i, 0] = self._d.qpos[i]
        self._d.eq_active[i] = held

    def _set_brakes(self) -> None:
        """Apply the brakes if the arm has stopped; else release them."""
        brakes = BRAKE * self.inertial.max_torque if self.mode is BodyMode.STOPPED else np.zeros_like(self._effort)
        for _, one in self._active:
            if isinstance(one, scenario.SlippingBrake):
                brakes[one.joint - 1] = min(brakes[one.joint - 1], one.torque)
        self._m.dof_frictionloss[:] = self.inertial.coulomb + brakes

    def _release_brakes(self) -> None:
        """Release the brakes; the motors hold the joints."""
        blocked = {one.joint - 1 for _, one in self._active if isinstance(one, scenario.BlockedJoint)}
        for i in range(self.model.joint_count):
            if i not in blocked:
                self._d.eq_active[i] = False
        self._reference = _rest_state(self._seen)
        self.mode, self._since = BodyMode.HOLDS, self.time
        self._brake = self._new_brake()

    def _new_brake(self) -> _Brake:
        return _Brake(self._reference[0], self._reference[1], np.array(self.model.max_acceleration))


def _begin(one: scenario.Disturbance) -> float:
    return 0.0 if one.at is None else one.at


def _rest_state(joints: Floats) -> State:
    return np.array([joints, np.zeros_like(joints), np.zeros_like(joints)])


def compile_arm(model: RobotModel, inertial: InertialModel) -> tuple[Any, Any]:
    """Return a MuJoCo model and its data: links, drives, and an open lock for each joint."""
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    spec.option.timestep, spec.option.gravity = STEP, GRAVITY
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    link_bodies(spec, model)
    for i, (low, high) in enumerate(zip(model.lower, model.upper, strict=True), 1):
        joint = spec.joint(f"joint{i}")
        joint.limited, joint.range = mujoco.mjtLimited.mjLIMITED_TRUE, [low - END_STOP, high + END_STOP]
        lock = spec.add_equality(type=mujoco.mjtEq.mjEQ_JOINT, name1=f"joint{i}", active=False)
        lock.solref, lock.solimp = [2.0 * STEP, 1.0], LOCK
    m = spec.compile()
    for i, row in enumerate(zip(*inertial[:3], strict=True), 1):
        _set_inertia(m, i, *row)
    m.dof_armature[:], m.dof_damping[:] = inertial.armature, inertial.viscous
    m.dof_frictionloss[:], m.dof_solimp[:] = inertial.coulomb, LOCK
    # do not let MuJoCo use the shortcuts that it chose before the masses were changed
    m.body_simple[:], m.dof_simplenum[:] = 0, 0
    mujoco.mj_setConst(m, mujoco.MjData(m))
    return m, mujoco.MjData(m)


def _set_inertia(m: Any, link: int, mass: float, centre: Floats, inertia: Floats) -> None:
    """Set the mass, the centre, and the inertia about the centre of a link, in the link's own frame."""
    body = m.body(f"link{link}").id
    moments, axes = np.linalg.eigh(inertia)
    axes[:, 2] *= np.sign(np.linalg.det(axes))  # make the axes right-handed, so that they are a rotation
    m.body_mass[body], m.body_ipos[body], m.body_inertia[body] = max(mass, MIN_MASS), centre, moments
    mujoco.mju_mat2Quat(m.body_iquat[body], axes.ravel())
    m.body_sameframe[body] = mujoco.mjtSameFrame.mjSAMEFRAME_NONE
