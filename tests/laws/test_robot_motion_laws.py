"""The laws of every timeline, for robots of every kind: closed forms and the numerical one, 2 to 7 joints."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec import structs

from tests.examples import examples
from tests.kinematics.pointing import CLOSED, FIVE, SEVEN
from tests.laws.motion_laws import check_accelerations, check_continuous, check_limits, check_lines, check_target
from tests.robots import QUICK, SEARCHED
from vrs_cli.engine.engine import Engine
from vrs_cli.errors import VrsError
from vrs_cli.kinematics.model import PROFILES, RobotModel
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.values.commands import JointTarget, Move, PoseTarget, SetSpeed, Stamp

URDF = Path(__file__).parent.parent / "kinematics" / "urdf"
OTHERS = [*SEARCHED, "crooked.urdf", "gantry.urdf"]
NEAR = 0.15  # of the ranges: a straight line that far is often possible

fractions = st.lists(st.floats(0.0, 1.0), min_size=7, max_size=7)
steps = st.lists(
    st.tuples(st.sampled_from(["joints", "pose", "line", "line", "speed"]), fractions, st.none() | st.floats(0.0, 6.0)),
    min_size=3,
    max_size=8,
)


def joints_at(model: RobotModel, parts: list[float], around: tuple[float, ...] | None = None) -> tuple[float, ...]:
    """In the ranges, or around a place in them."""
    rows = zip(parts, model.lower, model.upper, around or model.lower, strict=False)
    if around is None:
        return tuple(low + part * (high - low) for part, low, high, _ in rows)
    return tuple(
        min(max(at + (part - 0.5) * NEAR * (high - low), low), high) for part, low, high, at in rows
    )  # fmt: skip


def perform(engine: Engine, kind: str, parts: list[float], at: float | None) -> None:
    if kind == "speed":
        engine.perform(SetSpeed(5.0 + 95.0 * parts[0], always=True))
        return
    goal = joints_at(engine.model, parts, engine.destination(engine.end).joints if kind == "line" else None)
    target = JointTarget(goal) if kind == "joints" else PoseTarget(engine.arm.forward(goal))
    stamp = None if at is None else Stamp(at)
    engine.perform(Move(target, straight=kind == "line", stamp=stamp, text=kind), program=True)


def check_robot(model: RobotModel, sequence: list[tuple[str, list[float], float | None]]) -> int:
    """How many requests were possible."""
    engine, done = Engine(model), 0
    for kind, parts, at in sequence:
        before = engine.timeline
        try:
            perform(engine, kind, parts, at)
            done += 1
        except VrsError:
            assert engine.timeline is before
    segments = list(engine.timeline)
    check_continuous(engine, segments)
    check_limits(engine, segments)
    check_accelerations(engine, segments)
    check_lines(engine, segments)
    check_target(engine)
    return done


@pytest.mark.parametrize("name", [name for name in QUICK if name != "puma560"])  # which has tests of its own
@examples(40)
@given(sequence=steps)
def test_every_robot_keeps_the_laws(name: str, sequence: list[tuple[str, list[float], float | None]]) -> None:
    check_robot(load_robot(name), sequence)


@pytest.mark.parametrize("name", OTHERS)
@examples(16)
@given(sequence=steps)
def test_a_robot_whose_joints_are_searched_keeps_the_laws(
    name: str, sequence: list[tuple[str, list[float], float | None]]
) -> None:
    check_robot(load_robot(URDF / name if name.endswith(".urdf") else name), sequence)


@pytest.mark.parametrize("model", [FIVE, SEVEN, CLOSED], ids=lambda model: str(model.name))
@examples(24)
@given(profile=st.sampled_from(PROFILES), sequence=steps)
def test_a_robot_that_points_keeps_the_laws(
    model: RobotModel, profile: str, sequence: list[tuple[str, list[float], float | None]]
) -> None:
    check_robot(structs.replace(model, profile=profile), sequence)
