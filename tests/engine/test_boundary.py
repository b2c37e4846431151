"""Tests of lines that leave the reach between two samples, or touch its boundary: they are refused, or stop at the
kink.
"""

from __future__ import annotations

from itertools import pairwise
from math import hypot, pi, radians
from random import Random

import pytest
from msgspec import structs

from tests.laws.boundary_lines import check_rates, check_segments
from vrs_cli.engine.boundary import pace_of, survey
from vrs_cli.engine.engine import Engine
from vrs_cli.engine.following import Follower
from vrs_cli.errors import LocationOutOfRange, LocationTooFar, StraightLineSingular
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.clearance import Clearance
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.joints import Configuration, Elbow
from vrs_cli.kinematics.model import PROFILES
from vrs_cli.kinematics.robot_file import load_robot, robot_names
from vrs_cli.kinematics.transform import (
    IDENTITY,
    Transform,
    along,
    at_position,
    compose,
    cross,
    from_oat,
    inverse,
    position,
    translation,
    unit,
    vector_difference,
)
from vrs_cli.trajectory.segment import CartesianPath, Phase, Segment, Turn
from vrs_cli.values.commands import Move, NamedTarget, PoseTarget, SetParameter, SetSpeed

PLACES = 40  # of a stretch, at which a bound is checked


def at_nest(robot: str = "puma560", profile: str = "LSPB") -> Engine:
    """Move to NEST: its wrist is in the plane that touches the cylinder around joint 1, before the place where the line
    touches.
    """
    engine = Engine(load_robot(robot))
    engine.perform(SetParameter("PROFILE", profile))
    engine.perform(Move(NamedTarget("nest"), straight=False))
    return engine


def by(engine: Engine, x: float, y: float, z: float = 0.0) -> Move:
    """Move straight by these distances [mm]."""
    here = engine.position().T_world_tool
    return Move(PoseTarget(here._replace(px=here.px + 1e-3 * x, py=here.py + 1e-3 * y, pz=here.pz + 1e-3 * z)), True)


def straight(engine: Engine) -> tuple[Segment, ...]:
    number = engine.book.deltas[-1].motion.number
    return tuple(segment for segment in engine.timeline if segment.motion.number == number)


def stops(segments: tuple[Segment, ...]) -> list[Transform]:
    """Return where a line comes to rest on its way."""
    return [
        b.path.pose(0.0)
        for a, b in pairwise(segments)
        if isinstance(b.path, CartesianPath) and (a.phase, b.phase) == (Phase.DECELERATE, Phase.ACCELERATE)
    ]


# --- the reach -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("robot", ["puma560", "puma260"])
@pytest.mark.parametrize(("speed", "x", "y"), [(1, 100, -0.006), (2, 200, -0.002), (1, 120, -0.0008), (10, 150, -1e-4)])
def test_a_line_that_leaves_the_reach_between_two_samples_is_refused(
    robot: str, speed: float, x: float, y: float
) -> None:
    engine = at_nest(robot)
    engine.perform(SetSpeed(speed))
    with pytest.raises(LocationOutOfRange, match="too close"):
        engine.perform(by(engine, x, y))


def test_a_line_whose_end_is_out_of_reach_says_so_and_does_not_blame_a_singularity() -> None:
    engine = Engine(load_robot("puma560"))
    with pytest.raises(LocationTooFar, match=r"628\.3 mm nearer"):
        engine.perform(Move(PoseTarget(from_oat(1.5, 0.0, 0.0, 0.0, radians(90), 0.0)), True))


# --- kinks -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("profile", PROFILES)
@pytest.mark.parametrize("robot", ["puma560", "puma260"])
@pytest.mark.parametrize(("speed", "x"), [(30, 150), (100, 120)])
def test_a_line_on_a_tangent_stops_where_it_touches(robot: str, profile: str, speed: float, x: float) -> None:
    engine = at_nest(robot, profile)
    engine.perform(SetSpeed(speed))
    engine.perform(by(engine, x, 0.0))
    segments = straight(engine)
    (stop,) = stops(segments)
    assert position(stop)[0] == pytest.approx(0.0, abs=1e-9), "where the wrist is beside the axis of joint 1"
    check_segments(engine.arm, segments)


def past_the_fold(profile: str, off: float) -> Engine:
    """Plan a straight line of 100 mm for a UR5e, past the place where its forearm would lie folded on the upper arm, at
    this distance [m] perpendicular to both.
    """
    arm = arm_for(load_robot("ur5e"))
    folded = (0.3, -1.0, pi, -0.7, 1.2, 0.4)
    touch, (_, shoulder, _, elbow, *_) = arm.forward(folded), arm.frames(folded)
    across = shoulder.ax, shoulder.ay, shoulder.az  # of the plane that the bars fold in
    bar = unit(vector_difference(position(elbow), position(shoulder)))
    way = unit(cross(across, bar))
    begin, end = (along(along(position(touch), bar, off), way, part) for part in (-0.05, 0.05))
    start = arm.select(at_position(touch, *begin), folded, Configuration.of(elbow=Elbow.BELOW))
    engine = Engine(arm.model, start=start)
    engine.perform(SetParameter("PROFILE", profile))
    engine.perform(Move(PoseTarget(at_position(touch, *end)), True))
    return engine


@pytest.mark.parametrize("profile", PROFILES)
@pytest.mark.parametrize("off", [0.0, 1e-10])
def test_a_line_through_a_folded_elbow_stops_where_it_folds(profile: str, off: float) -> None:
    """The elbow folds and opens again the same way, so joint 3 turns back at once."""
    engine = past_the_fold(profile, off)
    (stop,) = stops(straight(engine))
    assert engine.arm.clearance(stop, engine.arm.configuration(engine.position().joints)).inner < 1e-9
    check_segments(engine.arm, straight(engine))


@pytest.mark.parametrize("profile", PROFILES)
def test_a_line_beside_a_folded_elbow_is_too_fast_or_out_of_reach(profile: str) -> None:
    with pytest.raises(StraightLineSingular, match="elbow singularity"):
        past_the_fold(profile, 1e-6)
    with pytest.raises(LocationOutOfRange, match="leaves the reach"):
        past_the_fold(profile, -1e-6)


@pytest.mark.parametrize("profile", PROFILES)
@pytest.mark.parametrize(("robot", "stretched"), [("ur5e", (0.3, -1.0, 0.0, -0.7, 1.2, 0.4)), ("planar2", (0.3, 0.0))])
def test_a_line_out_of_a_stretched_elbow_is_refused(robot: str, stretched: tuple[float, ...], profile: str) -> None:
    """Joint 3 would move with the square root of the way."""
    engine = Engine(load_robot(robot), start=stretched)
    engine.perform(SetParameter("PROFILE", profile))
    shoulder, *_, flange = (position(T) for T in engine.arm.frames(stretched)[robot == "ur5e" :])
    x, y, z = (0.1 * 1e3 * part for part in unit(vector_difference(shoulder, flange)))
    with pytest.raises(StraightLineSingular, match="elbow"):
        engine.perform(by(engine, x, y, z))


@pytest.mark.parametrize("off", [-0.9e-9, -1e-12, 1e-12, 0.9e-9])
def test_on_the_boundary_is_within_a_billionth_of_a_metre(off: float) -> None:
    """The line comes that near where it passes the axis, at 60.9 of the 120 mm from NEST."""
    engine = at_nest()
    engine.perform(by(engine, 121.893924889978, 2e3 * off))
    segments = straight(engine)
    assert len(stops(segments)) == 1
    check_segments(engine.arm, segments)


def test_more_than_a_billionth_of_a_metre_inside_is_out_of_reach() -> None:
    engine = at_nest()
    with pytest.raises(LocationOutOfRange):
        engine.perform(by(engine, 121.893924889978, -2.2e-6))


@pytest.mark.parametrize("profile", PROFILES)
def test_a_line_square_to_the_cylinder_is_refused_where_it_starts_and_where_it_ends(profile: str) -> None:
    """Joint 1 would move with the square root of the way, so it would be in motion at once."""
    engine = at_nest(profile=profile)
    engine.perform(by(engine, 60.946962444989046, 0.0))
    with pytest.raises(StraightLineSingular, match=r"shoulder singularity. joint . would have to change its speed"):
        engine.perform(by(engine, 0.0, 100.0))
    on_it = engine.position().T_world_tool
    engine.perform(Move(PoseTarget(on_it._replace(py=on_it.py + 0.1)), straight=False))
    with pytest.raises(StraightLineSingular, match=r"joint . would have to change its speed in no time"):
        engine.perform(Move(PoseTarget(on_it), straight=True))


@pytest.mark.parametrize("profile", PROFILES)
@pytest.mark.parametrize(
    ("first", "then", "kinks"), [((20, 0), (200, 0), 1), ((20, 10), (150, -10), 0), ((20, 0), (150, 0.5), 0)]
)
def test_a_line_out_of_motion_touches_no_boundary(
    profile: str, first: tuple[float, float], then: tuple[float, float], kinks: int
) -> None:
    """A blend is planned where there is room. Along the tangent the arm comes to rest first, and stops at the kink."""
    engine = at_nest(profile=profile)
    engine.perform(by(engine, *first), program=True)
    corner = engine.timeline[-1].motion.pose
    assert corner is not None
    beyond = corner._replace(px=corner.px + 1e-3 * then[0], py=corner.py + 1e-3 * then[1])
    engine.perform(Move(PoseTarget(beyond), True), program=True)
    assert len(stops(straight(engine))) == kinks
    check_rates(engine.arm, tuple(s for s in engine.timeline if isinstance(s.path, CartesianPath)))


# --- the bounds ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("robot", [name for name in robot_names() if arm_for(load_robot(name)).hand is not None])
def test_no_clearance_on_a_way_is_less_than_its_bound(robot: str) -> None:
    arm, random = arm_for(load_robot(robot)), Random(9)
    hand = arm.hand
    assert hand is not None
    known = 0
    for _ in range(12):
        tool, path = random_path(arm, random)
        pace = pace_of(path, 1.0, hand, inverse(tool))
        for h in (0.5, 0.05):
            begin = random.uniform(0.0, 1.0 - h)
            seen = [seen_at(arm, path, tool, begin + h * k / PLACES) for k in range(PLACES + 1)]
            least = arm.least_clearance(seen[0], seen[-1], pace, h)
            for column, low in zip(zip(*(each.sizes for each in seen), strict=True), least.sizes, strict=True):
                assert min(column) >= low - 1e-15
                known += 0.0 < low < 1e6
    assert known > 20


def test_the_pace_of_a_tool_that_turns_evenly_is_that_of_a_circle() -> None:
    """The tool turns about its tip, which stands or moves straight: v = w r, v' = w^2 r."""
    arm, reach, w = arm_for(load_robot("puma560")), 0.3, 0.7
    hand = arm.hand
    assert hand is not None
    assert hand.centre[:2] == (0.0, 0.0)
    tool, at_rest = translation(0.0, 0.0, reach + hand.centre[2]), ((0.1,), (0.2,), (0.3,))
    turn = Turn((1.0, 0.0, 0.0), (0.0, w))
    path = CartesianPath(at_rest, IDENTITY, (turn,), arm.ways[0], ((0.0,) * 6,), 1.0)
    pace = pace_of(path, 1.0, hand, inverse(tool))
    round_it = w * reach, w * w * reach, w * reach, w * w * reach, w, w * w
    assert structs.astuple(pace) == pytest.approx(round_it)
    for v in ((0.4, 0.0, 0.0), (0.0, 0.0, 0.5)):
        going = structs.replace(path, position=tuple((x, rate) for (x,), rate in zip(at_rest, v, strict=True)))  # type: ignore[arg-type]
        beside, all_of_it = hypot(*v[:2]), hypot(*v)
        faster = beside, 0.0, all_of_it, 0.0, 0.0, 0.0
        wanted = [one + more for one, more in zip(round_it, faster, strict=True)]
        assert structs.astuple(pace_of(going, 1.0, hand, inverse(tool))) == pytest.approx(wanted)
    two = structs.replace(path, turns=(turn, Turn((0.0, 1.0, 0.0), (0.0, 0.5))))
    both = pace_of(two, 1.0, hand, inverse(tool))
    assert both.speed == pytest.approx((w + 0.5) * reach)
    assert both.bend == pytest.approx(2.0 * (w + 0.5) ** 2 * reach)


def random_path(arm: RobotArm, random: Random) -> tuple[Transform, CartesianPath]:
    model = arm.model
    q = tuple(random.uniform(low, high) for low, high in zip(model.lower, model.upper, strict=True))
    whole = model.joint_count == 6
    tool = translation(*(random.uniform(-0.1, 0.1) for _ in range(3))) if whole else translation(0.0, 0.0, 0.0)
    pose, size = compose(arm.forward(q), tool), random.choice((0.001, 0.1))
    x, y, z = ((p, *(random.gauss(0.0, size) for _ in range(random.choice((1, 2, 3))))) for p in position(pose))
    turns = tuple(random_turn(random, size) for _ in range(random.choice((0, 1, 2)) if whole else 0))
    return tool, CartesianPath((x, y, z), pose, turns, arm.configuration(q), (q,), 1.0)


def random_turn(random: Random, size: float) -> Turn:
    x, y, z = (random.gauss(0.0, 1.0) for _ in range(3))
    far = hypot(x, y, z)
    return Turn((x / far, y / far, z / far), (0.0, random.gauss(0.0, size), random.gauss(0.0, size)))


def seen_at(arm: RobotArm, path: CartesianPath, tool: Transform, s: float) -> Clearance:
    return arm.clearance(compose(path.pose(s), inverse(tool)), path.configuration)


def test_a_path_far_from_all_boundaries_needs_few_looks() -> None:
    engine = Engine(load_robot("puma560"), start=(0.0, -0.8, 3.1, 0.0, 0.8, 0.0))
    pose = engine.position().T_world_tool
    x, y, z = position(pose)
    path = CartesianPath(((x,), (y, 0.2), (z,)), pose, (), engine.arm.configuration(engine.position().joints), (), 1.0)
    looks = 0
    clearance = engine.arm.clearance

    class Counting:
        def __getattr__(self, name: str) -> object:
            return getattr(engine.arm, name)

        def clearance(self, *args: object) -> Clearance:
            nonlocal looks
            looks += 1
            return clearance(*args)  # type: ignore[arg-type]

    follower = Follower(Counting(), path.configuration, IDENTITY)  # type: ignore[arg-type]
    assert not survey(follower, path, 1.0).touches
    assert looks <= 4


def test_a_path_that_comes_again_is_not_looked_at_again() -> None:
    """The path comes again while a key is held and the arm cannot go on, from whatever joints it is followed."""
    engine = at_nest()
    pose, joints = engine.position().T_world_tool, engine.position().joints
    x, y, z = position(pose)
    path = CartesianPath(((x, 0.1), (y,), (z,)), pose, (), engine.arm.configuration(joints), (), 1.0)
    follower = Follower(engine.arm, path.configuration, IDENTITY)
    first = survey(follower, path, 1.0)
    assert survey(follower, structs.replace(path, seeds=(joints,)), 1.0) is first
    assert survey(follower, path, 0.5) is not first
    assert survey(Follower(engine.arm, path.configuration, translation(0.0, 0.0, 0.1)), path, 1.0) is not first
