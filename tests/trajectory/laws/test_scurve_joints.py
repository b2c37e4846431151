"""Tests of joints with phases of their own, out of any motion: all arrive together and at rest, within limits, and as
soon as Ruckig says.
"""

from __future__ import annotations

from collections.abc import Iterator
from random import Random

import pytest
from msgspec import structs

from tests.examples import some
from vrs_cli.engine.single_motion import hardest_limits, joint_limits
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.joints import Joints, Profile
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.trajectory.instant import TICK
from vrs_cli.trajectory.laws.scurve import joint_motion
from vrs_cli.trajectory.polynomial import derivative, extremes, value
from vrs_cli.trajectory.segment import JointPath, Phase, Segment
from vrs_cli.trajectory.state import JointLimits, JointState
from vrs_cli.values.commands import Motion, MotionKind, Start

ROBOTS = ("puma560", "ur5e", "panda", "cobra600", "so100")  # six joints, seven, four and five; two kinds of joint
ARMS = {name: arm_for(load_robot(name)) for name in ROBOTS}
MOTION = Motion(1, MotionKind.JOINT, Start.AT, profile=Profile.SCURVE)
ROUNDING = 1.0 + 1e-9
JUMP = 1.1  # of an acceleration, for which the jerk needs so many instants of the time grid


def check(state: JointState, goal: Joints, limits: JointLimits, least: float = 0.0) -> float:
    """Check every law for the motion from a state; return its duration [s]."""
    segments = joint_motion(state, goal, limits, 0.0, MOTION, least)
    lasting = segments[-1].finish if segments else 0.0
    assert lasting >= least
    rows = zip(
        state.joints, state.velocity, state.present_acceleration, goal, *structs.astuple(limits)[:3], strict=True
    )
    for joint, row in enumerate(rows):
        _check_joint([_of_joint(joint, segment) for segment in segments], *row)
    return lasting


def _of_joint(joint: int, segment: Segment) -> tuple[float, tuple[float, ...]]:
    assert isinstance(segment.path, JointPath)
    return segment.duration, segment.path.coefficients[joint]


def _check_joint(
    way: list[tuple[float, tuple[float, ...]]],
    q: float,
    v: float,
    a: float,
    goal: float,
    v_max: float,
    a_max: float,
    jerk: float,
) -> None:
    forced, jump = max(v_max, abs(v), abs(v + 0.5 * a * abs(a) / jerk)), JUMP * TICK * jerk
    assert all(0.0 < duration == round(duration / TICK) * TICK for duration, _ in way)
    for (_, row), before in zip([*way, (0.0, (goal, 0.0, 0.0, 0.0))], [None, *way], strict=True):
        now = (q, v, a) if before is None else tuple(_at(before[1], before[0]))
        for rate, (there, here) in enumerate(zip(_at(row, 0.0), now, strict=True)):
            assert abs(there - here) <= (1e-11, 1e-11, jump)[rate] + 1e-13 * abs(here)
    for duration, row in way:
        rates = derivative(row)
        low, high = extremes(rates, duration)
        assert max(-low, high) <= forced * ROUNDING
        assert max(abs(value(derivative(rates), s)) for s in (0.0, duration)) <= max(a_max, abs(a)) + jump
        assert abs(6.0 * row[3]) <= jerk * ROUNDING


def _at(row: tuple[float, ...], s: float) -> Iterator[float]:
    for _ in range(3):
        yield value(row, s)
        row = derivative(row)


# --- states ---------------------------------------------------------------------------------------------------------


def state(random: Random, limits: JointLimits) -> JointState:
    """Return a state inside the limits, often at one of them: no joint becomes too fast while its acceleration goes."""
    rows = [_inside(random, *row) for row in zip(*structs.astuple(limits)[:3], strict=True)]
    return JointState(place(random, limits), tuple(v for v, _ in rows), tuple(a for _, a in rows))


def _inside(random: Random, v_max: float, a_max: float, jerk: float) -> tuple[float, float]:
    a = random.choice((0.0, a_max, -a_max, *(random.uniform(-a_max, a_max) for _ in range(3))))
    low, high = _room(v_max, a, jerk)
    return random.choice((low, high, *(random.uniform(low, high) for _ in range(4)))), a


def _room(v_max: float, a: float, jerk: float) -> tuple[float, float]:
    """Return the range of velocities from which an acceleration can go within the limits."""
    gained = 0.5 * a * abs(a) / jerk
    return -v_max - min(gained, 0.0), v_max - max(gained, 0.0)


def amid(random: Random, limits: JointLimits) -> JointState:
    """Return any state inside the limits, with equal probability."""
    a = tuple(random.uniform(-most, most) for most in limits.acceleration)
    v = tuple(random.uniform(*_room(*row)) for row in zip(limits.velocity, a, limits.jerk, strict=True))
    return JointState(place(random, limits), v, a)


def place(random: Random, limits: JointLimits) -> Joints:
    return tuple(map(random.uniform, limits.lower, limits.upper))


def beside_its_stop(random: Random, state: JointState, limits: JointLimits) -> Joints:
    """Return goals near the place where each joint could stop, which is the most that braking joints can do."""
    rows = zip(state.joints, state.velocity, state.present_acceleration, *structs.astuple(limits)[1:3], strict=True)
    return tuple(
        q + 0.5 * v * abs(v) / a_max + random.choice((0.0, v * a / jerk, random.gauss(0.0, 0.02), 1e-9))
        for q, v, a, a_max, jerk in rows
    )


# --- how soon -------------------------------------------------------------------------------------------------------


class Oracle:
    """Ruckig, for one robot."""

    def __init__(self, limits: JointLimits) -> None:
        ruckig = pytest.importorskip("ruckig")  # it has no wheels for all machines
        count = len(limits.velocity)
        self._solver, self.motion, self._task = (
            ruckig.Ruckig(count),
            ruckig.Trajectory(count),
            ruckig.InputParameter(count),
        )
        self._working = ruckig.Result.Working
        task = self._task
        task.max_velocity, task.max_acceleration, task.max_jerk = structs.astuple(limits)[:3]

    def lasting(self, state: JointState, goal: Joints) -> float:
        """Return the least time of a motion [s]."""
        task = self._task
        task.current_position, task.current_velocity, task.target_position = state.joints, state.velocity, goal
        task.current_acceleration = state.present_acceleration
        assert self._solver.calculate(task, self.motion) == self._working
        return float(self.motion.duration)

    def state_at(self, t: float) -> JointState:
        """Return the state at a time of the last motion."""
        return JointState(*map(tuple, self.motion.at_time(t)))


@pytest.mark.parametrize("name", ROBOTS)
def test_they_arrive_as_soon_as_can_be(name: str) -> None:
    limits, random = hardest_limits(ARMS[name]), Random(1)
    oracle, late = Oracle(limits), list[float]()
    for _ in range(1000):
        begin, goal = amid(random, limits), place(random, limits)
        segments = joint_motion(begin, goal, limits, 0.0, MOTION, 0.0)
        late.append(segments[-1].finish / oracle.lasting(begin, goal) - 1.0)
    assert max(late) <= 0.05
    assert min(late) >= -1e-7
    assert sum(one <= 1e-4 for one in late) >= 990


@pytest.mark.parametrize("name", ROBOTS)
def test_a_motion_goes_on_from_any_state_of_another(name: str) -> None:
    """Many of these states have a velocity at its limit, and no acceleration."""
    limits, random = hardest_limits(ARMS[name]), Random(2)
    oracle = Oracle(limits)
    for _ in range(some(200)):
        oracle.lasting(state(random, limits), place(random, limits))
        begin = oracle.state_at(random.uniform(0.0, oracle.motion.duration))
        check(begin, place(random, limits), limits)


# --- laws -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ROBOTS)
def test_every_limit_is_kept_from_any_state(name: str) -> None:
    hardest, random = hardest_limits(ARMS[name]), Random(3)
    for _ in range(some(400)):
        begin = state(random, hardest)
        goal = random.choice((place(random, hardest), beside_its_stop(random, begin, hardest), begin.joints))
        check(begin, goal, hardest, random.choice((0.0, 0.0, 3.0)))


@pytest.mark.parametrize("name", ROBOTS)
def test_a_lower_speed_is_exceeded_by_no_more_than_the_state_forces(name: str) -> None:
    """The same holds if ACCEL is lower now than it was."""
    arm, random = ARMS[name], Random(4)
    hardest = hardest_limits(arm)
    for _ in range(some(400)):
        speed, acceleration = random.choice((0.01, 0.2, 0.7)), random.choice((1.0, 1.0, 0.3))
        limits = joint_limits(arm, structs.replace(MOTION, speed=speed, acceleration=acceleration))
        begin = state(random, hardest)
        check(begin, random.choice((place(random, hardest), beside_its_stop(random, begin, hardest))), limits)


def test_a_joint_inside_a_lower_speed_stays_inside() -> None:
    """Joint 1 of a PUMA at SPEED 20: its acceleration must go as fast as it can, not together with that of other
    joints.
    """
    limits = joint_limits(ARMS["puma560"], structs.replace(MOTION, speed=0.2))
    begin = JointState((0.0,) * 6, (-0.263, 0.0, 0.0, 0.0, 0.0, 0.0), (4.76, 0.0, 0.0, 0.0, 0.0, 0.0))
    for goal in ((2.0, -0.5, 0.1, 0.0, 0.0, 0.0), (-2.0, 1.0, 0.5, 0.3, 0.2, 0.1), (0.01, 0.0, 0.0, 3.0, 0.0, 0.0)):
        check(begin, goal, limits)


def test_a_joint_that_brakes_for_long_comes_to_rest_a_little_farther_in_time() -> None:
    """It could stop after 0.0892 rad, and would need 0.380 s if it stopped braking in between."""
    limits = JointLimits((0.9425,), (3.1416,), (31.4159,), (0.9425,), (-9.0,), (9.0,))
    begin = JointState((0.0,), (0.6745,), (-0.9557,))
    assert check(begin, (0.1039,), limits) < 0.332
    for least in (0.335, 0.35, 0.37, 0.39, 0.5, 2.0):
        assert check(begin, (0.1039,), limits, least) == pytest.approx(least, abs=1e-8)


def test_joints_that_stop_where_they_are_to_be_wait_there() -> None:
    limits = hardest_limits(ARMS["puma560"])
    begin = JointState((0.0,) * 6, tuple(1e-9 * v for v in limits.velocity))
    assert check(begin, begin.joints, limits, 2.0) == 2.0


def test_nothing_to_do_takes_no_time() -> None:
    limits = hardest_limits(ARMS["puma560"])
    assert joint_motion(JointState((0.0,) * 6, (0.0,) * 6), (0.0,) * 6, limits, 0.0, MOTION, 0.0) == ()


def test_joints_that_can_share_their_instants_do() -> None:
    limits = hardest_limits(ARMS["puma560"])
    begin = JointState((0.0,) * 6, tuple(0.1 * v for v in limits.velocity))
    segments = joint_motion(begin, tuple(0.9 * v for v in limits.velocity), limits, 0.0, MOTION, 0.0)
    three = [Phase.BLEND] * 3, [Phase.DECELERATE] * 3
    assert [segment.phase for segment in segments] == [*three[0], Phase.CRUISE, *three[1]]
