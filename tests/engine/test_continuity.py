"""Tests of lines of arms without a closed form: a line that may leave the reach between two samples is refused."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from random import Random

import numpy as np
import pytest
from msgspec import structs

from tests.examples import some
from vrs_cli.engine.continuity import MAX_EXTRA_SAMPLES, Gap
from vrs_cli.engine.engine import Engine
from vrs_cli.engine.following import Follower
from vrs_cli.engine.position import joints_over
from vrs_cli.errors import LocationOutOfRange, MotionError, StraightLineSingular
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.model import PROFILES, RobotModel
from vrs_cli.kinematics.numeric.arm import NumericArm
from vrs_cli.kinematics.numeric.batch import Continuation, Cubic, Gaps
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import at_position, compose, position, rotation_x
from vrs_cli.values.commands import Move, NamedTarget, PoseTarget, SetParameter, SetSpeed

URDF = Path(__file__).parents[1] / "kinematics" / "urdf"
CLOSELY = 1e-4  # [s] between two readings


@cache
def crooked_puma() -> RobotModel:
    """Return a PUMA 560 whose wrist has an offset of 1 mm, so it has no closed form. At NEST the wrist passes the
    cylinder around joint 1 on a tangent, 60.947 mm before the point where it touches.
    """
    model = load_robot("puma560")
    links = list(model.links)
    links[4] = structs.replace(links[4], d=0.001)
    return structs.replace(model, links=tuple(links))


def line_from_nest(x: float, y: float, speed: float, profile: str = "LSPB") -> Engine:
    """Move straight from NEST by these distances [mm]."""
    engine = Engine(crooked_puma())
    engine.perform(SetParameter("PROFILE", profile))
    engine.perform(Move(NamedTarget("nest"), straight=False))
    engine.perform(SetSpeed(speed))
    here = engine.position().T_world_tool
    goal = here._replace(px=here.px + 1e-3 * x, py=here.py + 1e-3 * y)
    engine.perform(Move(PoseTarget(goal), straight=True))
    return engine


def test_the_arm_has_no_closed_form() -> None:
    assert isinstance(arm_for(crooked_puma()), NumericArm)


@pytest.mark.parametrize(
    ("speed", "x", "y"),
    [
        (1, 120, -6.5e-4),
        (2, 120, -1.8e-4),
        (30, 120, -1.2e-4),
        (2, 100, -7.2e-6),
        (1, 120, -4.6e-7),
        (30, 150, -1.4e-7),
    ],
)
def test_a_line_that_leaves_the_reach_between_two_samples_is_refused(speed: float, x: float, y: float) -> None:
    with pytest.raises(LocationOutOfRange, match=r"leaves the reach of the arm near X -?0\.[01] Y 150\.1"):
        line_from_nest(x, y, speed)


def test_a_line_that_only_touches_is_refused_too() -> None:
    with pytest.raises(MotionError, match=r"too near to a singularity|leaves the reach|would have to"):
        line_from_nest(120, 0, 10)


@pytest.mark.parametrize("profile", PROFILES)
@pytest.mark.parametrize(("x", "y"), [(100, 5), (60, -5e-5), (30, 20)])
def test_a_line_that_keeps_off_goes_on(profile: str, x: float, y: float) -> None:
    check_velocities(line_from_nest(x, y, 30, profile))


@pytest.mark.parametrize(("x", "y", "z"), [(-43, 5, -80), (10, 90, -120), (50, 60, -150)])
def test_a_line_may_begin_in_a_singular_pose(x: float, y: float, z: float) -> None:
    engine = Engine(crooked_puma())
    here = engine.position().T_world_tool
    goal = at_position(here, here.px + 1e-3 * x, here.py + 1e-3 * y, here.pz + 1e-3 * z)
    engine.perform(Move(PoseTarget(goal), straight=True))
    check_velocities(engine)


def test_a_line_may_end_in_a_singular_pose() -> None:
    engine = Engine(crooked_puma())
    singular = engine.position()
    here = singular.T_world_tool
    engine.perform(Move(PoseTarget(at_position(here, here.px + 0.01, here.py + 0.09, here.pz - 0.12)), straight=True))
    engine.perform(Move(PoseTarget(here), straight=True))
    check_velocities(engine)
    assert engine.position(engine.end).joints == pytest.approx(singular.joints, abs=1e-4)


def check_velocities(engine: Engine) -> None:
    """Check that no joint of the last motion exceeds its velocity limit anywhere."""
    motion = engine.book.deltas[-1].motion.number
    begin = min(segment.start for segment in engine.timeline if segment.motion.number == motion)
    q = joints_over(engine.arm, engine.timeline, np.arange(begin, engine.end, CLOSELY))
    steps = np.abs(np.diff(q, axis=0)).max(axis=0)
    assert (steps <= 1.05 * CLOSELY * np.array(engine.model.max_velocity)).all()


@pytest.mark.parametrize("seed", range(some(24)))
def test_lines_on_the_edge_of_the_reach_keep_the_velocities(seed: int) -> None:
    """The lines pass the cylinder, from nanometres to a millimetre beyond it or clear of it."""
    random = Random(seed)
    way = random.uniform(61.5, 160.0)
    beside = random.choice((-1.0, 1.0, 1.0)) * 10.0 ** random.uniform(-7.0, 0.5)
    try:
        engine = line_from_nest(way, beside, 10.0 ** random.uniform(0.8, 2.0), random.choice(PROFILES))
    except (LocationOutOfRange, StraightLineSingular):
        return
    assert beside > 0.0
    check_velocities(engine)


@pytest.mark.parametrize("name", ["seven", "crooked", "gantry"])
def test_joints_of_one_branch_are_proved_and_a_jump_is_not(name: str) -> None:
    arm = arm_for(load_robot(URDF / f"{name}.urdf"))
    proof = arm.continuation
    assert isinstance(proof, Continuation)
    random = Random(3)
    rows = list(zip(arm.model.lower, arm.model.upper, strict=True))
    some = [tuple(random.uniform(low, high) for low, high in rows) for _ in range(30)]
    q = max(some, key=lambda q: min(arm.singularity(q)))
    pose = arm.forward(q)
    goal = at_position(compose(pose, rotation_x(1e-5)), *(x + 1e-5 for x in position(pose)))
    there = arm.branch_joints(goal, arm.ways[0], q)
    assert there is not None
    weights = np.eye(len(q))[list(arm.still_joints)]
    assert proof.prove(between(q, there, there, weights), 1).tolist() == [True]
    jumped = tuple(x + 0.3 for x in there)
    for pieces in (1, 64):
        assert proof.prove(between(q, there, jumped, weights), pieces).tolist() == [False]
    if arm.redundancy:
        moved = tuple(x + 0.3 * w for x, w in zip(there, weights[0], strict=True))
        assert proof.prove(between(q, there, moved, weights), 64).tolist() == [False]


def between(a: tuple[float, ...], b: tuple[float, ...], found: tuple[float, ...], weights: np.ndarray) -> Gaps:
    """Return a short way from a to b at constant speed. At its end joints of another branch may have been found."""
    way = (np.array(b) - np.array(a))[None]
    turned = np.array([[1e-5, 0.0, 0.0, 0.0]])
    return Gaps(Cubic(np.array([a]), np.array([found]), way, way), np.zeros(1), turned, np.zeros(1), weights)


@pytest.mark.parametrize(
    ("start", "way"),
    [
        ((-0.005, -1.339, 0.384, 0.172, 0.0, -0.863), (0.012, 0.092, 0.019)),
        ((-0.738, -1.963, 0.854, 0.146, 0.0, -0.818), (0.014, 0.048, 0.047)),
    ],
)
def test_a_line_that_nothing_proves_is_refused_soon(
    monkeypatch: pytest.MonkeyPatch, start: tuple[float, ...], way: tuple[float, float, float]
) -> None:
    """The finest gaps come first, with no more samples than a possible line takes."""
    halved, halves = list[Gap](), Gap.halves

    def counted(gap: Gap, follower: Follower) -> tuple[Gap, Gap]:
        halved.append(gap)
        return halves(gap, follower)

    monkeypatch.setattr(Gap, "halves", counted)
    engine = Engine(crooked_puma(), start=start)
    here = engine.position().T_world_tool
    goal = at_position(here, *(a + b for a, b in zip(position(here), way, strict=True)))
    with pytest.raises(StraightLineSingular):
        engine.perform(Move(PoseTarget(goal), straight=True))
    assert 20 < len(halved) <= MAX_EXTRA_SAMPLES
