"""The tool pulled about: it follows where it can, and says what holds it where it cannot."""

from __future__ import annotations

from math import radians
from pathlib import Path

import pytest

from vrs_cli.engine.engine import Engine
from vrs_cli.errors import PowerOff
from vrs_cli.interfaces.dragging import Dragging
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.joints import Jacobian, Joints
from vrs_cli.kinematics.numeric.search import NEAREST_STEPS
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import IDENTITY, Transform, angle_between, at_position, distance, from_oat
from vrs_cli.values.commands import JointTarget, Move, PoseTarget, SetSwitch
from vrs_cli.values.dragging import Hold, Limit, Shortfall

MODEL = load_robot("puma560")
SEVEN = Path(__file__).parent.parent / "kinematics" / "urdf" / "seven.urdf"
TABLE = from_oat(0.0, 0.45, -0.15, radians(90), radians(90), 0.0)


@pytest.fixture
def engine() -> Engine:
    engine = Engine(MODEL)
    engine.perform(Move(PoseTarget(TABLE), straight=False))
    return engine


def pull(dragging: Dragging, wish: Transform, seconds: float) -> Shortfall:
    """Hold the wish for so long; what is said last."""
    engine, held = dragging.engine, Shortfall()
    until = engine.now + seconds
    while engine.now < until:
        held = dragging.to(wish)
        engine.clock.advance(engine.now + 0.02)
    return held


def moved(x: float, y: float, z: float) -> Transform:
    return at_position(TABLE, TABLE.px + x, TABLE.py + y, TABLE.pz + z)


def test_a_wish_in_reach_is_reached_to_the_bit_of_the_eye(engine: Engine) -> None:
    wish = moved(0.1, 0.05, 0.1)
    assert pull(Dragging(engine), wish, 3.0) == Shortfall()
    tool = engine.position().T_world_tool
    assert distance(tool, wish) < 1e-6
    assert angle_between(tool, wish) < 1e-6


def test_it_is_one_motion_that_undo_takes_back(engine: Engine) -> None:
    before = engine.position().T_world_tool
    pull(Dragging(engine), moved(0.1, 0.05, 0.1), 1.0)
    engine.clock.advance(engine.end)
    assert engine.undo() == ("DRAG",)
    assert engine.position(engine.end).T_world_tool == pytest.approx(before)


def test_another_way_round_leads_over_the_axis_of_joint_1_at_full_speed() -> None:
    """The arm does not creep there, as it does where it only comes near to that axis."""
    model = load_robot("ur5e")
    engine = Engine(model, start=(5.4, -1.9, 3.5, -0.3, -5.5, -1.1))
    wish = engine.world_pose((-2.0, 5.2, 4.9, 4.4, -2.6, 5.3))
    assert pull(Dragging(engine), wish, 3.6) == Shortfall()
    assert distance(engine.position().T_world_tool, wish) < 1e-6


def test_without_wishes_it_comes_to_rest_by_itself(engine: Engine) -> None:
    dragging = Dragging(engine)
    for k in range(30):
        dragging.to(moved(0.0, 0.0, 0.004 * k))
        engine.clock.advance(engine.now + 0.02)
    assert 0.0 < engine.end - engine.now < 0.5
    assert max(map(abs, engine.position(engine.end).velocity)) == 0.0


def test_beyond_reach_it_is_on_the_edge_and_comes_back(engine: Engine) -> None:
    dragging = Dragging(engine)
    held = pull(dragging, moved(0.0, 2.0, 0.0), 4.0)
    assert Hold(Limit.REACH, which="far") in held.holds
    assert held.away > 1.0
    assert engine.position().T_world_tool.py > 0.8
    assert "too far" in " ".join(hold.describe(MODEL) for hold in held.holds)
    assert pull(dragging, TABLE, 3.0) == Shortfall()
    assert engine.arm.configuration(engine.position().joints) == dragging.pursuit.kept


def test_it_slides_along_the_edge(engine: Engine) -> None:
    dragging = Dragging(engine)
    pull(dragging, moved(0.0, 2.0, 0.0), 3.0)
    for k in range(100):
        held = dragging.to(moved(0.02 * k, 2.0, 0.0))
        engine.clock.advance(engine.now + 0.02)
    assert Hold(Limit.REACH, which="far") in held.holds
    assert engine.position().T_world_tool.px > 0.4


def test_a_joint_at_its_limit_is_named() -> None:
    engine = Engine(MODEL)
    engine.perform(Move(JointTarget((radians(150.0), radians(-120.0), radians(30.0), 0.0, radians(60.0), 0.0)), False))
    dragging, q = Dragging(engine), engine.position().joints
    held = Shortfall()
    for k in range(60):
        held = dragging.to(engine.world_pose((q[0] + radians(0.4 * k), *q[1:])))
        engine.clock.advance(engine.now + 0.02)
    assert held.holds[0] == Hold(Limit.JOINT, 1, "upper")
    assert held.holds[0].describe(MODEL) == "JT1 is at its upper limit, 160.0 deg"
    assert dragging.pursuit.goal[0] == MODEL.upper[0]
    assert engine.position(engine.end).joints[0] == pytest.approx(MODEL.upper[0], abs=1e-3)


def test_from_ready_where_three_singularities_are_near_it_can_be_dragged_at_once() -> None:
    engine = Engine(MODEL)
    dragging, ready = Dragging(engine), engine.position().T_world_tool
    for k in range(150):
        dragging.to(at_position(ready, ready.px - 0.002 * k, ready.py, ready.pz - 0.002 * k))
        engine.clock.advance(engine.now + 0.02)
    assert pull(dragging, at_position(ready, ready.px - 0.3, ready.py, ready.pz - 0.3), 3.0) == Shortfall()


def test_the_wrist_passes_through_straight_without_a_stop() -> None:
    engine = Engine(MODEL, start=tuple(map(radians, (10.0, -140.0, 60.0, 0.0, 30.0, 0.0))))
    dragging, q, worst = Dragging(engine), engine.position().joints, 0.0
    for k in range(150):
        held = dragging.to(engine.world_pose((*q[:4], q[4] - radians(0.4 * k), q[5])))
        worst = max(worst, held.turned)
        engine.clock.advance(engine.now + 0.02)
    assert worst < radians(1.0)
    assert engine.position().joints[4] < radians(-25.0)


def test_what_is_too_fast_is_said_and_caught_up(engine: Engine) -> None:
    dragging = Dragging(engine)
    held = dragging.to(moved(0.4, 0.1, 0.2))
    assert held.holds[0].limit is Limit.SPEED
    assert "as fast as it may be" in held.holds[0].describe(MODEL)
    assert pull(dragging, moved(0.4, 0.1, 0.2), 4.0) == Shortfall()


def test_without_power_it_is_refused(engine: Engine) -> None:
    engine.perform(SetSwitch("POWER", on=False))
    with pytest.raises(PowerOff):
        Dragging(engine).to(moved(0.0, 0.0, 0.1))


def test_where_it_stands_already_nothing_is_added_to_the_timeline(engine: Engine) -> None:
    dragging, version = Dragging(engine), engine.timeline.version
    assert pull(dragging, engine.position().T_world_tool, 1.0) == Shortfall()
    assert engine.timeline.version == version


def test_without_a_closed_form_no_wish_costs_a_search_all_over(monkeypatch: pytest.MonkeyPatch) -> None:
    """Somebody else's motions wait meanwhile."""
    engine = Engine(load_robot(SEVEN))
    dragging, arm, counts = Dragging(engine), type(engine.arm), list[int]()
    here, jacobian = engine.position().T_world_tool, arm.jacobian

    def counted(self: RobotArm, q: Joints, T_flange_tool: Transform = IDENTITY) -> Jacobian:
        counts[-1] += 1
        return jacobian(self, q, T_flange_tool)

    monkeypatch.setattr(arm, "jacobian", counted)
    for _ in range(150):
        counts.append(0)
        dragging.to(at_position(here, 0.3, -0.4, -2.0))
        engine.clock.advance(engine.now + 0.02)
    first, *others = counts  # which sees how freely the arm moves as a rule
    assert max(others) <= 2 * (NEAREST_STEPS + 1), first
    assert max(others) > NEAREST_STEPS + 3, "nothing is searched at all"


def test_without_a_closed_form_it_comes_to_where_only_another_way_round_leads() -> None:
    engine = Engine(load_robot(SEVEN), start=(0.0, 1.9, 0.0, 1.9, 0.0, 1.9, 0.0))
    wish = engine.world_pose((2.0, -1.6, 1.0, -1.8, -2.0, -1.0, 2.5))
    assert pull(Dragging(engine), wish, 10.0) == Shortfall()
