"""Timelines for the tests of this folder: planned ones, and arbitrary values by hypothesis."""

from __future__ import annotations

import random
import re
from functools import cache
from math import pi, radians
from pathlib import Path

from hypothesis import strategies as st
from msgspec import structs

from vrs_cli.engine.planner import plan
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.joints import ALL, Profile
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import compose, from_oat, translation
from vrs_cli.trajectory.instant import LATEST, TICK, on_grid
from vrs_cli.trajectory.segment import CartesianPath, JointPath, Phase, Segment, Turn
from vrs_cli.trajectory.timeline import Cause, Timeline, TimelineDelta
from vrs_cli.values.commands import (
    AlignedTarget,
    Event,
    EventEdit,
    Frames,
    JointOffsetTarget,
    Motion,
    MotionKind,
    Start,
    ToolOffsetTarget,
)
from vrs_cli.wire.records import MAX_NUMBER, Form

JOINTS = 6
STAND = (0.0, radians(-45.0), radians(150.0), 0.0, radians(30.0), 0.0)


@cache
def form() -> Form:
    """What the paths of a puma560 have."""
    return Form.of(arm_for(puma()))


@cache
def puma() -> RobotModel:
    return load_robot("puma560")


def initial(joints: tuple[float, ...] = STAND) -> Segment:
    """s_0: the robot stands at `joints` from t = 0 on."""
    still = JointPath(tuple((angle,) for angle in joints))
    return Segment(0.0, 0.0, still, Phase.REST, Motion(0, MotionKind.REST, Start.AT, goal=joints))


def planned(count: int, seed: int = 1) -> tuple[Timeline, tuple[TimelineDelta, ...]]:
    """A timeline made by `count` motions: appended, spliced in, of all kinds, and some undone again."""
    rng, arm = random.Random(seed), arm_for(puma())
    timeline, deltas = Timeline([initial()]), []
    for number in range(1, count + 1):
        executed = on_grid(rng.uniform(0.0, timeline.end) if rng.random() < 0.4 else timeline.end)
        delta = plan(arm, timeline, motion(rng, number), executed, executed)
        deltas.append(delta)
        before, timeline = timeline, timeline.apply(delta)
        if rng.random() < 0.2:
            deltas.append(before.inverse(delta))
            timeline = timeline.apply(deltas[-1])
    return timeline, tuple(deltas)


def without_checksums(path: Path) -> Path:
    """The file as it was written before lines had checksums."""
    path.write_bytes(re.sub(rb',"crc":"[0-9a-f]{8}"}', b"}", path.read_bytes()))
    return path


def appended(count: int) -> tuple[TimelineDelta, ...]:
    """Joint motions one after another."""
    rng, arm = random.Random(2), arm_for(puma())
    timeline, deltas = Timeline([initial()]), []
    for number in range(1, count + 1):
        goal = tuple(angle + rng.uniform(-0.2, 0.2) for angle in STAND)
        step = Motion(number, MotionKind.JOINT, Start.AFTER, goal=goal, text=f"MOVE p[{number}]")
        deltas.append(plan(arm, timeline, step, timeline.end, timeline.end))
        timeline = timeline.apply(deltas[-1])
    return tuple(deltas)


def motion(rng: random.Random, number: int) -> Motion:
    kind = rng.choice((MotionKind.JOINT, MotionKind.STRAIGHT, MotionKind.REST))
    goal = tuple(angle + rng.uniform(-0.2, 0.2) for angle in STAND)
    frames = Frames(tool=translation(0.0, 0.0, 0.1)) if rng.random() < 0.3 else Frames()
    pose = compose(arm_for(puma()).forward(goal), frames.tool)
    return Motion(
        number,
        kind,
        rng.choice((Start.AT, Start.AFTER)),
        goal=goal if kind is MotionKind.JOINT else None,
        pose=pose if kind is MotionKind.STRAIGHT else None,
        speed=rng.choice((1.0, 0.3)),
        duration=0.5 if kind is MotionKind.REST else 0.0,
        frames=frames,
        text=f"MOVE p[{number}] ;größer",
        profile=rng.choice(list(Profile)),
    )


# --- arbitrary values: as a file must give them back, whether or not a robot could do them -----------------

floats = st.floats(-MAX_NUMBER, MAX_NUMBER)
times = st.integers(-(2**53), 2**53).map(lambda ticks: ticks * TICK)
polynomials = st.lists(floats, min_size=1, max_size=4).map(tuple)
joints = st.tuples(*[floats] * JOINTS)
angles = st.floats(-pi, pi)
transforms = st.builds(from_oat, floats, floats, floats, angles, angles, angles)
axes = transforms.map(lambda T: (T.nx, T.ny, T.nz))
frames = st.builds(Frames, base=transforms, tool=transforms) | st.just(Frames())
relatives = (
    st.builds(JointOffsetTarget, joint=st.integers(1, JOINTS), change=floats)
    | st.builds(ToolOffsetTarget, transforms)
    | st.just(AlignedTarget())
)
fractions = st.floats(0.0, 1.0, exclude_min=True)
positive = st.floats(0.0, MAX_NUMBER, exclude_min=True)
every_motion = st.builds(
    Motion,
    number=st.integers(0, 9),
    kind=st.sampled_from(MotionKind),
    start=st.sampled_from(Start),
    goal=joints,
    pose=transforms,
    speed=fractions,
    acceleration=fractions,
    tip_speed=st.none() | positive,
    rotation=st.none() | positive,
    duration=st.floats(0.0, LATEST),
    hand=floats,
    frames=frames,
    text=st.text(st.characters(codec="utf-8")),
    relative=st.none() | relatives,
    profile=st.sampled_from(Profile),
    rounding=st.none() | st.floats(0.0, MAX_NUMBER),
    swivel=st.none(),  # no joint of this robot is too many
).map(lambda motion: structs.replace(motion, goal=None, pose=None) if motion.kind is MotionKind.REST else motion)
joint_paths = st.integers(1, 4).flatmap(lambda n: st.tuples(*[st.tuples(*[floats] * n)] * JOINTS)).map(JointPath)
lines = st.builds(
    CartesianPath,
    position=st.tuples(*[polynomials] * 3),
    orientation=transforms,
    turns=st.lists(st.builds(Turn, axes, polynomials), max_size=2).map(tuple),
    configuration=st.sampled_from(ALL),
    seeds=st.lists(joints, min_size=1, max_size=3).map(tuple),
    seed_interval=st.floats(1e-6, 10.0),
    guides=st.just(()),
)
motions = every_motion.filter(lambda motion: motion.kind not in (MotionKind.EVENT, MotionKind.RECORDED))
segments = st.builds(
    lambda edges, path, phase, motion: Segment(min(edges), max(edges), path, phase, motion),
    st.tuples(times, times),
    joint_paths | lines,
    st.sampled_from(Phase),
    motions,
)
events = st.builds(
    Event,
    time=times,
    channel=st.integers(0, 2**31 - 1),
    value=floats,
    number=st.integers(0, 9),
    tied=st.booleans(),
    duration=st.floats(0.0, LATEST),
    observed=st.booleans(),
)
edits = st.builds(
    EventEdit,
    keep=st.integers(0, 10**6),
    drop=st.integers(0, 10**6),
    shift=times,
    events=st.lists(events, max_size=3).map(tuple),
)
deltas = st.builds(
    TimelineDelta,
    version=st.integers(0, 10**6),
    cause=st.sampled_from(Cause),
    motion=motions,
    issued=floats,
    executed=floats,
    cut=times,
    keep=st.integers(0, 10**6),
    drop=st.integers(0, 10**6),
    shift=times,
    segments=st.lists(segments, max_size=2).map(tuple),
    events=st.none() | edits,
)
