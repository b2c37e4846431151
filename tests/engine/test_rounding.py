"""Tests of PARAMETER ROUNDING: the tool passes within that distance of a via point, for all kinds of motion and
profiles.
"""

from __future__ import annotations

from math import radians

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.examples import examples
from tests.laws.motion_laws import check_continuous, check_limits
from vrs_cli.engine.engine import Engine
from vrs_cli.engine.position import positions_at
from vrs_cli.errors import IllegalValue
from vrs_cli.kinematics.joints import Profile
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import Transform, from_oat, position
from vrs_cli.values.commands import JointTarget, Move, PoseTarget, SetParameter, Stamp, Start

MODEL = load_robot("puma560")
PROFILES = pytest.mark.parametrize("profile", list(Profile.__members__))
DOWN = tuple(map(radians, (90.0, 90.0, 0.0)))


def located(x: float, y: float, z: float) -> Transform:
    return from_oat(x, y, z, *DOWN)


HERE, VIA, THERE = located(-0.15, 0.45, -0.15), located(0.15, 0.45, -0.15), located(0.15, 0.65, -0.15)


def driven(profile: str, rounding: float | str, straight: tuple[bool, bool], via: Transform = VIA) -> Engine:
    engine = Engine(MODEL)
    engine.perform(Move(PoseTarget(HERE), straight=False))
    engine.perform(SetParameter("PROFILE", profile))
    engine.perform(SetParameter("ROUNDING", rounding))
    engine.perform(Move(PoseTarget(via), straight=straight[0]), program=True)
    engine.perform(Move(PoseTarget(THERE), straight=straight[1]), program=True)
    return engine


def nearest(engine: Engine, via: Transform = VIA) -> float:
    """Return how near the tip comes to a place [m], sampled at the boundaries of segments and often between."""
    times = np.sort([*np.linspace(0.0, engine.end, 3001), *(s.start for s in engine.timeline)])
    ways = positions_at(engine.arm, engine.timeline, times).T_world_tool[:, :, 3] - position(via)
    return float(np.linalg.norm(ways, axis=1).min())


@PROFILES
@pytest.mark.parametrize("straight", [(False, False), (True, False), (False, True), (True, True)])
@pytest.mark.parametrize("millimetres", [0.0, 0.5, 5.0, 20.0])
def test_the_path_passes_within_the_distance(profile: str, straight: tuple[bool, bool], millimetres: float) -> None:
    engine = driven(profile, millimetres, straight)
    assert nearest(engine) <= 1e-3 * millimetres + 1e-7
    check_continuous(engine, engine.timeline)
    check_limits(engine, engine.timeline)


@given(
    st.floats(-0.25, 0.25),
    st.floats(0.35, 0.55),
    st.floats(0.0, 30.0),
    st.booleans(),
    st.booleans(),
    st.sampled_from(list(Profile.__members__)),
)
@examples(60)
def test_any_corner(x: float, y: float, millimetres: float, first: bool, second: bool, profile: str) -> None:
    via = located(x, y, -0.1)
    engine = driven(profile, millimetres, (first, second), via)
    assert nearest(engine, via) <= 1e-3 * millimetres + 1e-7


@pytest.mark.parametrize("profile", ["LSPB", "SCURVE"])  # a polynomial of degree 5 out of full speed may swing wide
def test_a_larger_rounding_takes_no_longer(profile: str) -> None:
    ends = [driven(profile, rounding, (True, True)).end for rounding in (0.0, 2.0, 10.0, 30.0, "DECEL")]
    assert ends == sorted(ends, reverse=True)
    assert ends[0] > ends[-1] + 0.1


@PROFILES
def test_rounding_takes_no_longer_than_stopping(profile: str) -> None:
    stopping, *rounded = [driven(profile, rounding, (True, True)).end for rounding in (0.0, 2.0, 10.0, 30.0, "DECEL")]
    assert max(rounded) <= stopping


def test_zero_stops_at_the_corner_and_is_no_break() -> None:
    engine = driven("LSPB", 0.0, (True, True))
    motions = [segment.motion for segment in engine.timeline]
    assert motions[-1].start is Start.BLEND
    stopped = [s.finish for s in engine.timeline if s.motion.number == motions[-1].number - 1][-1]
    assert max(map(abs, engine.position(stopped - 1e-9).velocity)) < 1e-6
    assert engine.now < stopped + 1e-9, "the program has not waited for the second motion"


def test_a_motion_planned_again_keeps_its_rounding() -> None:
    """After a motion is inserted before two that blend, the corner between these is as before."""
    engine = driven("SCURVE", 5.0, (True, True))
    engine.perform(Move(JointTarget(engine.position(0.0).joints), straight=False, stamp=None))
    before = nearest(engine)
    first = next(s for s in engine.timeline if s.motion.number == 2)
    engine.perform(Move(PoseTarget(located(-0.2, 0.5, -0.1)), straight=True, stamp=Stamp(first.start - 0.01)))
    assert before <= 5e-3 + 1e-7
    assert nearest(engine) <= 5e-3 + 1e-7
    check_limits(engine, engine.timeline)


@pytest.mark.parametrize("value", [-1.0, 1e6, "SHARP"])
def test_other_values_are_refused(value: float | str) -> None:
    with pytest.raises(IllegalValue, match="it is DECEL or a number from 0 to 10000 mm"):
        Engine(MODEL).perform(SetParameter("ROUNDING", value))
