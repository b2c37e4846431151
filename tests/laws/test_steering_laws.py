"""Steering and jogging, whatever the targets and whenever they come: position and velocity are continuous, no limit is
exceeded; with a jerk-limited profile the acceleration is continuous too, and no joint has too much jerk.
"""

from __future__ import annotations

from contextlib import suppress
from math import radians
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.engine.wall import ManualWall
from tests.examples import examples, first, some
from tests.interfaces.terminals import RecordingTerminal
from tests.laws.motion_laws import check_continuous, check_limits
from tests.laws.streams import check_stream
from tests.laws.test_motion_laws import MODEL
from vrs_cli.engine.engine import Engine
from vrs_cli.errors import MotionError
from vrs_cli.interfaces.jog.jogger import AXES, Jogger, step_pose
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.streams import Steering
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.joints import Joints, Profile
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.robot_file import load_robot, robot_names
from vrs_cli.kinematics.transform import from_oat, translation
from vrs_cli.repl.player import JogPanel
from vrs_cli.trajectory.state import Target
from vrs_cli.values.commands import JointTarget, Move, PoseTarget, SetAcceleration, SetParameter, SetTool, Stamp

TICK = 0.02
PROFILES = tuple(Profile.__members__)

parts = st.tuples(*[st.sampled_from([0.0, 1.0]) | st.floats(0.0, 1.0)] * 6)
velocities = st.tuples(*[st.floats(-3.0, 3.0)] * 6)
lateness = st.sampled_from([0.2, 0.99, 1.0, 1.0, 1.0, 1.0, 1.3, 2.5, 20.0])  # of a tick
stretches = st.tuples(parts, velocities, st.integers(1, 25), lateness, st.sampled_from([1.0, 1.0, 0.3]))


def joints(part: tuple[float, ...]) -> tuple[float, ...]:
    return tuple(low + (high - low) * f for f, low, high in zip(part, MODEL.lower, MODEL.upper, strict=True))


def robot(profile: str, model: RobotModel = MODEL, start: Joints | None = None) -> Engine:
    engine = Engine(model, start=start)
    engine.perform(SetParameter("PROFILE", profile))
    return engine


@pytest.mark.parametrize("profile", PROFILES)
@examples(80)
@given(parts, st.floats(0.0, 1.5), st.lists(stretches, min_size=1, max_size=6))
def test_every_stream_keeps_the_laws(
    profile: str,
    start: tuple[float, ...],
    begin: float,
    stream: list[tuple[tuple[float, ...], tuple[float, ...], int, float, float]],
) -> None:
    engine = robot(profile)
    engine.perform(Move(JointTarget(joints(start)), straight=False), program=True)
    engine.clock.advance(begin)
    for part, velocity, count, late, speed in stream:
        for _ in range(count):
            engine.steer(Target(joints(part), velocity), TICK, speed=speed)
            engine.clock.advance(engine.now + late * TICK)
    check_continuous(engine, engine.timeline)
    check_limits(engine, engine.timeline)


@pytest.mark.parametrize("profile", PROFILES)
@examples(12)
@given(parts, parts)
def test_a_target_that_stands_is_reached(profile: str, start: tuple[float, ...], part: tuple[float, ...]) -> None:
    engine = robot(profile, start=joints(start))
    goal = joints(part)
    for _ in range(600):
        engine.steer(Target(goal, (0.0,) * 6), TICK)
        engine.clock.advance(engine.now + TICK)
    reached = engine.position(engine.end).joints
    assert max(abs(a - b) for a, b in zip(reached, goal, strict=True)) < radians(1e-3)


# --- streams that begin, change and end anyhow ----------------------------------------------------------------------

ROBOTS = ("puma560", "puma560", "irb120", "cobra600", "planar2")


class Stream:
    """A robot whose targets come from a seed."""

    def __init__(self, seed: int, profiles: tuple[str, ...]) -> None:
        self.random, self.profiles = Random(seed), profiles
        self.engine = robot(profiles[0], load_robot(self.random.choice(ROBOTS)))

    def joints(self) -> Joints:
        """Anywhere, often at the ends of ranges."""
        source, model = self.random, self.engine.model
        parts = [source.choice((0.0, 1.0, source.random(), source.random())) for _ in model.lower]
        return tuple(low + (high - low) * f for f, low, high in zip(parts, model.lower, model.upper, strict=True))

    def run(self) -> None:
        """Out of a motion, targets near and far, early and late; settings change, other motions take over."""
        engine, source = self.engine, self.random
        engine.perform(Move(JointTarget(self.joints()), straight=False), program=True)
        engine.clock.advance(1.5 * source.random())
        for _ in range(source.randint(1, 5)):
            self.settings()
            self.targets()
            self.interruption()

    def settings(self) -> None:
        if self.random.random() < 0.3:
            self.engine.perform(SetAcceleration(self.random.uniform(10.0, 100.0)))
        self.engine.perform(SetParameter("PROFILE", self.random.choice(self.profiles)))

    def targets(self) -> None:
        engine, source, goal = self.engine, self.random, self.joints()
        tick, speed = source.choice((TICK, TICK, 0.001, 0.1, 0.4)), source.choice((1.0, 1.0, 0.3, 0.01))
        velocity = tuple(source.choice((0.0, source.uniform(-3.0, 3.0))) for _ in goal)
        walk = source.choice((0.0, 0.05))
        for _ in range(source.randint(1, 25)):
            engine.steer(Target(goal, velocity), tick, speed=speed)
            engine.clock.advance(engine.now + source.choice((0.0, 0.3, 1.0, 1.0, 1.0, 1.2, 3.0)) * tick)
            ends = zip(goal, engine.model.lower, engine.model.upper, strict=True)
            goal = tuple(min(max(q + source.gauss(0.0, walk), low), high) for q, low, high in ends)

    def interruption(self) -> None:
        engine, source = self.engine, self.random
        kind = source.randint(0, 5)
        if kind == 0:
            engine.redirect(self.joints(), speed=0.5)
        elif kind == 1:
            engine.stop()
        elif kind == 2:
            engine.perform(Move(JointTarget(self.joints()), straight=False, stamp=Stamp(engine.now)), program=True)
        if kind <= 2:
            engine.clock.advance(engine.now + source.random())


@pytest.mark.parametrize("profiles", [("SCURVE",), ("SCURVE", "LSPB")], ids="-".join)
@pytest.mark.parametrize("first", range(0, some(60), 10))
def test_streams_that_begin_and_end_anyhow_keep_the_laws(first: int, profiles: tuple[str, ...]) -> None:
    for seed in range(first, first + 10):
        stream = Stream(seed, profiles)
        stream.run()
        check_continuous(stream.engine, stream.engine.timeline)
        check_limits(stream.engine, stream.engine.timeline)


def test_streams_of_any_robot_are_no_errors() -> None:
    """`python -m tests.laws.streams` runs more of them."""
    arms = [arm_for(load_robot(name)) for name in robot_names()]
    for seed in range(some(20 * len(arms))):
        check_stream(arms[seed % len(arms)], seed)


# --- the tool steered, and jogged with keys, while the clock runs as somebody likes -----------------------------------

TABLE = from_oat(0.0, 0.45, -0.15, radians(90), radians(90), 0.0)


@pytest.mark.parametrize("profile", PROFILES)
@pytest.mark.parametrize("seed", range(some(8)))
def test_a_tool_that_is_steered_keeps_the_laws(profile: str, seed: int) -> None:
    """Poses on axes of the world and of the tool, some of them out of reach."""
    source = Random(seed)
    engine = robot(profile)
    engine.perform(SetTool(translation(0.0, 0.0, 0.1)))
    engine.perform(Move(PoseTarget(TABLE), straight=False))
    steering, pose, t = Steering(engine, speed=source.choice((1.0, 0.3))), TABLE, engine.now
    for _ in range(12):
        axis, step = source.choice(list(AXES.values())), source.choice((-8.0, -1.0, 1.0, 8.0))
        for _ in range(source.randint(1, 20)):
            pose, t = step_pose(pose, axis, step), t + source.choice((TICK, TICK, 0.5 * TICK, 3.0 * TICK, 1.0))
            with suppress(MotionError):
                steering.to(pose, t)
        if source.random() < 0.3:
            steering.finish()
        pose = engine.position(engine.end).T_world_tool
    check_continuous(engine, engine.timeline)
    check_limits(engine, engine.timeline)


@pytest.mark.parametrize("profile", first(1, PROFILES))
@pytest.mark.parametrize("seed", range(some(8) // 2))
def test_a_robot_that_is_jogged_keeps_the_laws(profile: str, seed: int) -> None:
    """Keys that repeat, other axes, steps, speeds and frames, stops; the clock is paused, and changes its rate."""
    source, wall = Random(seed), ManualWall()
    clock = wall.clock()
    session = Session(RecordingTerminal(), clock=clock)
    session.perform(f"PARAMETER PROFILE = {profile}")
    session.perform("MOVE TRANS(0, 450, -150, 90, 90, 0)")
    panel = JogPanel(Jogger(session))
    for _ in range(25):
        key = source.choice([panel.next_frame, panel.stop, *[lambda: panel.next_axis(source.randint(1, 5))] * 4])
        key()
        panel.longer(source.choice((-1, 1)))
        panel.faster(source.choice((-1, 1)))
        clock.change(rate=source.choice((0.25, 1.0, 1.0, 4.0)), paused=source.random() < 0.1)
        sign, repeats = source.choice((-1.0, 1.0)), source.choice((0.0, 0.03, 0.03, 0.1, 0.5))
        for _ in range(source.randint(1, 12)):
            session.settle()
            panel.move(sign)
            wall.seconds += repeats
    engine = session.engine
    assert len(engine.book.records()) > 10
    check_continuous(engine, engine.timeline)
    check_limits(engine, engine.timeline)
