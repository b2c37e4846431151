"""EXPLAIN at the prompt: what it tells is so, by matrices of this file and by what the robot then does; and it changes
nothing.
"""

from __future__ import annotations

from math import degrees, radians
from random import Random
from typing import TypeVar

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.engine.wall import ManualWall
from tests.examples import some
from tests.interfaces.terminals import RecordingTerminal
from tests.kinematics.test_steps import flange
from vrs_cli.errors import VrsError
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.users import need_of
from vrs_cli.kinematics.transform import Transform
from vrs_cli.language.text.ast import ProgramHeader
from vrs_cli.language.text.parser import parse_prompt
from vrs_cli.language.words.word import Role
from vrs_cli.values.diagnostics import LineRefused
from vrs_cli.values.replies import (
    AnglesReport,
    ChainReport,
    ExplainOverview,
    InverseReport,
    MotionReport,
    SegmentFate,
    SpliceReport,
)
from vrs_cli.values.results import Message

R = TypeVar("R")
PLACES = ("POINT table = TRANS(100, 400, -300, 30, -90, 0)", "POINT part = TRANS(150, 60, 200, 40, 80, 10)")


def session(*lines: str, **options: object) -> Session:
    made = Session(RecordingTerminal(), **options)  # type: ignore[arg-type]
    for line in lines:
        made.perform(line)
    return made


def explained(of: Session, what: str, kind: type[R]) -> R:
    of.perform(f"EXPLAIN {what}")
    assert isinstance(of.terminal, RecordingTerminal)
    reply = of.terminal.replies[-1]
    assert isinstance(reply, kind)
    return reply


def matrix(T: Transform) -> NDArray[np.float64]:
    return np.vstack((np.reshape(T, (3, 4)), (0, 0, 0, 1)))


def Rz(angle: float) -> NDArray[np.float64]:
    c, s = np.cos(radians(angle)), np.sin(radians(angle))
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])


def Ry(angle: float) -> NDArray[np.float64]:
    c, s = np.cos(radians(angle)), np.sin(radians(angle))
    return np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])


def trans(x: float, y: float, z: float, o: float, a: float, t: float) -> NDArray[np.float64]:
    """A location by the yaw, pitch and roll of V+: O - 90, A + 90, T."""
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = Rz(o - 90.0) @ Ry(a + 90.0) @ Rz(t), np.array([x, y, z]) / 1000.0
    return T


# --- motions ---------------------------------------------------------------------------------------------------------


def random_line(random: Random, end: float) -> str:
    """A line of the prompt, most often a motion, perhaps with a time in the middle of what is there, to `end` [s]."""
    stamp = random.choice(("", "", f" AT {random.uniform(0.0, end):.3f}", f" IN {random.uniform(0.0, 2.0):.3f}"))
    x, y, z = random.uniform(-400, 400), random.uniform(250, 600), random.uniform(-300, 200)
    place = f"TRANS({x:.1f}, {y:.1f}, {z:.1f}, {random.uniform(60, 120):.0f}, {random.uniform(60, 90):.0f}, 0)"
    return random.choice(
        (
            f"MOVE {place}{stamp}",
            f"MOVES {place}{stamp}",
            f"MOVET {place}, 1{stamp}",
            f"APPRO {place}, 50{stamp}",
            f"DEPARTS {random.uniform(5, 60):.1f}{stamp}",
            f"DRIVE {random.randint(1, 6)}, {random.uniform(-40, 40):.1f}, 60{stamp}",
            f"READY{stamp}",
            f"DELAY {random.uniform(0, 1):.2f}",
            "DO DURATION 1.5",
            f"DO SPEED {random.uniform(20, 90):.0f}",
            f"PARAMETER PROFILE = {random.choice(('LSPB', 'SCURVE', 'QUINTIC'))}",
            f"PARAMETER INSERT = {random.choice(('ON', 'ON', 'OFF'))}",
            "UNDO",
        )
    )


@pytest.mark.parametrize("seed", range(some(60)))
def test_a_motion_has_exactly_the_times_that_were_told(seed: int) -> None:
    of, told, random = session(), 0, Random(seed)
    for place in range(12):
        line = random_line(random, 2.0 + 0.7 * place)
        motion = line.split(" ", 1)[0] not in ("DO", "PARAMETER", "UNDO")
        before, refusal = of.engine.timeline, ""
        report = explained(of, line, MotionReport) if motion else None
        assert of.engine.timeline is before
        try:
            of.perform(line)
        except VrsError as error:
            refusal = str(error)
        if report is None:
            continue
        assert report.refusal == refusal
        plan, number = report.plan, of.engine.book.number
        assert (plan is None) == bool(refusal)
        if plan is None:
            continue
        own = [(one.start, one.finish, one.phase.value) for one in of.engine.timeline if one.motion.number == number]
        assert [(one.start, one.finish, one.phase) for one in plan.stretches] == own
        assert plan.joints == of.engine.position(plan.end).joints
        told += 1
    assert told


def test_a_motion_that_cuts_in() -> None:
    of = session("DO MOVE #PPOINT(60,-90,90,0,0,0) AT 0")
    plan = explained(of, "MOVE #PPOINT(0,-90,90,0,0,0) AT 0.6", MotionReport).plan
    assert plan is not None
    assert plan.cut is not None
    assert (plan.cut.number, plan.cut.phase) == (1, "cruise")
    assert plan.cut.since == pytest.approx(0.3, abs=1e-3)
    # joint 1 at 82 deg/s; the tip of READY is 150.5 mm from its axis
    assert plan.cut.speed == pytest.approx(radians(82.0) * np.hypot(0.02032, 0.14909))
    assert plan.stretches[0].phase == "blend"


def test_a_later_motion_that_is_moved_is_told() -> None:
    of = session("DO DRIVE 1, 60 AT 1", "DO DRIVE 2, 20 AT 4")
    plan = explained(of, "DRIVE 1, 170, 40 AT 0", MotionReport).plan
    assert plan is None or plan.displaced is not None
    lines = session("DO MOVE #PPOINT(60,-90,90,0,0,0) AT 0", "DO MOVE #PPOINT(60,-60,90,0,0,0) AT 1.1", "DO DURATION 4")
    moved = explained(lines, "MOVE #PPOINT(0,-90,90,0,0,0) AT 0.6", MotionReport).plan
    assert moved is not None
    assert moved.displaced is not None
    assert [one.text for one in moved.displaced.later] == ["MOVE #PPOINT(60, -60, 90, 0, 0, 0) AT 1.1"]


def test_the_limit_that_slows_a_line_down_is_named() -> None:
    """Near the axis of joint 1 that joint is what binds, and the tip stays far below its speed."""
    of = session("DO MOVE TRANS(-300, 170, -450, 90, 90, 0)")
    plan = explained(of, "MOVES TRANS(300, 170, -450, 90, 90, 0)", MotionReport).plan
    assert plan is not None
    load = plan.loads[0]
    assert 0.95 < load.velocity.share <= 1.0
    assert all(other.velocity.share < 0.95 for other in plan.loads[1:5])
    assert plan.tip.share < 0.5
    assert abs(load.velocity.place[0]) < 0.2
    assert plan.length == pytest.approx(0.6, abs=1e-9)


def test_a_refusal_is_that_of_the_motion() -> None:
    of = session()
    report = explained(of, "MOVES TRANS(3000, 0, 0)", MotionReport)
    with pytest.raises(VrsError) as refused:
        of.perform("MOVES TRANS(3000, 0, 0)")
    assert report.plan is None
    assert report.refusal == str(refused.value)


def test_random_numbers_are_those_that_the_motion_finds() -> None:
    of = session()
    plan = explained(of, "DRIVE 1, 40*RANDOM", MotionReport).plan
    of.perform("DRIVE 1, 40*RANDOM")
    assert plan is not None
    assert plan.end == of.engine.end
    assert plan.joints == of.engine.position().joints


def test_an_error_of_an_argument_leaves_no_error_behind() -> None:
    of = session()
    with pytest.raises(VrsError, match="nowhere"):
        of.perform("EXPLAIN MOVE nowhere")
    assert of.environment.last_error == 0


def test_in_real_time_it_begins_now_and_waits_for_nothing() -> None:
    wall = ManualWall()
    of = session("CLOCK RATE = 2", "PARAMETER CAUSALITY = POSTPONE", clock=wall.clock())
    wall.seconds += 3.0
    plan = explained(of, "DRIVE 1, 20", MotionReport).plan
    assert plan is not None
    assert plan.begin == pytest.approx(6.0, abs=1e-3)
    late = explained(of, "DRIVE 1, 20 AT 1", MotionReport).plan
    assert late is not None
    assert late.notes == (f"DRIVE 1, 20 AT 1 is postponed from 1.000 to {late.begin:.3f} s",)
    assert of.engine.end == 0.0


def test_what_moves_nothing_is_said() -> None:
    of = session("ENABLE DRY.RUN")
    assert "moves nothing" in explained(of, "DRIVE 1, 20", Message).text
    assert "moves nothing" in explained(of, "BREAK", Message).text


def test_who_looks_may_ask_and_beside_a_program_too() -> None:
    line = parse_prompt("EXPLAIN MOVE part")
    assert line is not None
    assert not isinstance(line, ProgramHeader)
    assert need_of(line) == ("EXPLAIN", Role.OBSERVER)
    wall = ManualWall()
    of = session(*PLACES, clock=wall.clock())
    of.load_text(".PROGRAM slow\nDRIVE 1, 30, 5\nBREAK\n.END\n")
    of.begin("slow")
    of.settle()
    before = of.engine.timeline
    assert of.running
    report = explained(of, "DRIVE 2, 10", MotionReport)
    assert report.plan is not None
    assert report.plan.begin == of.engine.end
    assert of.engine.timeline is before


# --- locations -------------------------------------------------------------------------------------------------------


def test_a_chain_is_the_product_of_its_factors() -> None:
    of = session(*PLACES, "TOOL TRANS(0, 0, 120, 90, -90, 30)", "BASE 10, 20, 30, 40")
    report = explained(of, "table:part:TRANS(1, 2, 3, 90, -90, 5)", ChainReport)
    table, part = trans(100, 400, -300, 30, -90, 0), trans(150, 60, 200, 40, 80, 10)
    factors = [table, part, trans(1, 2, 3, 90, -90, 5)]
    assert [one.name for one in report.factors] == ["table", "part", "TRANS(1, 2, 3, 90, -90, 5)"]
    assert [(one.outer, one.inner) for one in report.factors][:2] == [("world", "table"), ("table", "part")]
    product = np.eye(4)
    for one, factor in zip(report.factors, factors, strict=True):
        product = product @ factor
        assert matrix(one.T) == pytest.approx(factor, abs=1e-12)
        assert matrix(one.product) == pytest.approx(product, abs=1e-12)
    base, tool = matrix(of.engine.frames.base), matrix(of.engine.frames.tool)
    assert matrix(report.arm[-1].product) == pytest.approx(base @ product @ np.linalg.inv(tool), abs=1e-12)
    assert tool == pytest.approx(trans(0, 0, 120, 90, -90, 30), abs=1e-12)


def test_a_precision_point_is_the_chain_of_the_links() -> None:
    of = session("TOOL TRANS(0, 0, 120)")
    q = (20.0, -60.0, 150.0, 10.0, 30.0, -40.0)
    report = explained(of, f"#PPOINT({', '.join(map(str, q))})", ChainReport)
    assert [one.name for one in report.factors] == ["BASE^-1", "A1", "A2", "A3", "A4", "A5", "A6", "TOOL"]
    T = flange(tuple(map(radians, q))) @ trans(0, 0, 120, 90, -90, 0)
    assert matrix(report.factors[-1].product) == pytest.approx(T, abs=1e-9)
    for one in report.factors:
        assert np.linalg.det(matrix(one.T)) == pytest.approx(1.0)


@pytest.mark.parametrize("angles", [(30, 40, 50), (-170, -89, 10), (0, 0, 0), (120, 90, 30), (20, -90, 70)])
def test_the_three_turns_give_the_rotation(angles: tuple[float, float, float]) -> None:
    o, a, t = angles
    report = explained(session(), f"OAT TRANS(1, 2, 3, {o}, {a}, {t})", AnglesReport)
    # VAL's manual of 1977: with all angles 0 the hand points along -Y, and its Y along X
    M = np.array([[0, 1, 0], [0, 0, -1], [-1, 0, 0]])
    R = Rz(o) @ M @ Ry(a) @ Rz(t)
    said = [matrix(turn)[:3, :3] for turn in report.turns]
    assert matrix(report.T)[:3, :3] == pytest.approx(R, abs=1e-12)
    assert said[0] @ said[1] @ said[2] @ said[3] == pytest.approx(R, abs=1e-12)
    assert said[1] == pytest.approx(M)
    assert report.vertical == (abs(a) == 90)
    told = tuple(map(degrees, report.angles))
    if not report.vertical:
        assert told == pytest.approx((o, a, t))
        assert R[:, 2] == pytest.approx(
            [np.sin(radians(o)) * np.cos(radians(a)), -np.cos(radians(o)) * np.cos(radians(a)), -np.sin(radians(a))]
        )
    else:
        assert told[:2] == pytest.approx((90, a))
        assert Rz(told[2]) == pytest.approx(Rz(t + (o - 90.0) * (-1 if a > 0 else 1)), abs=1e-9)


def test_the_configuration_that_move_takes() -> None:
    of = session("DO MOVE #PPOINT(40, -45, 180, 10, 30, 0)", *PLACES)
    report = explained(of, "IK table:part", InverseReport)
    assert len(report.solutions) == 8
    of.perform("MOVE table:part")
    q = of.engine.position().joints
    assert report.chosen == of.engine.arm.configuration(q)
    chosen = next(one for one in report.solutions if one.option.configuration == report.chosen)
    assert chosen.option.joints == pytest.approx(q, abs=1e-9)
    asked = [one.time for one in report.solutions if one.option.usable]
    assert all(time is not None for time in asked)
    assert chosen.time == pytest.approx(
        max(abs(b - a) / v for a, b, v in zip(report.here, q, of.engine.model.max_velocity, strict=True))
    )


def test_the_steps_lead_to_the_joints_that_are_shown_in_a_singular_pose_too() -> None:
    """READY has a straight wrist: joint 4 is free there."""
    of = session()
    report = explained(of, "IK HERE", InverseReport)
    for one in report.solutions:
        assert one.option.joints is not None
        told = [one.steps[f"q{i}"] for i in range(1, 7)]
        assert np.cos(told) == pytest.approx(np.cos(one.option.joints), abs=1e-9)
        assert np.sin(told) == pytest.approx(np.sin(one.option.joints), abs=1e-9)
    assert report.solutions[0].steps["s5"] == pytest.approx(0.0, abs=1e-9)


def test_a_place_out_of_reach_shows_how_far_it_came() -> None:
    report = explained(session(), "IK TRANS(2000, 0, 0)", InverseReport)
    assert report.chosen is None
    assert all(one.steps["k"] > 1.0 and "q2" not in one.steps for one in report.solutions)
    inside = explained(session(), "IK TRANS(50, 0, 0)", InverseReport)
    assert all(one.steps["u2"] < 0.0 and "u" not in one.steps for one in inside.solutions)


# --- the last change -------------------------------------------------------------------------------------------------


def test_what_the_last_command_did() -> None:
    of = session("DO MOVE #PPOINT(60,-90,90,0,0,0) AT 0", "DO MOVE #PPOINT(60,-60,90,0,0,0) AT 4")
    of.perform("DO MOVE #PPOINT(30,-60,90,0,0,0) AT 6")
    of.perform("DO DURATION 6")
    before = [(one.start, one.finish) for one in of.engine.timeline]
    of.perform("DO MOVE #PPOINT(60,-90,90,0,0,0) AT 0.6")
    after = [(one.start, one.finish) for one in of.engine.timeline]
    report = explained(of, "SPLICE", SpliceReport)
    rows = report.rows
    assert [row.fate for row in rows] == [
        SegmentFate.KEPT,
        SegmentFate.CUT,
        SegmentFate.DROPPED,
        *[SegmentFate.PLANNED] * 3,
        *[SegmentFate.SHIFTED] * 3,
    ]
    assert rows[1].before == pytest.approx((0.3, 0.732), abs=1e-3)
    assert rows[1].after == pytest.approx((0.3, 0.6), abs=1e-3)
    assert [row.before for row in rows if row.before] == before[1 : len([row for row in rows if row.before]) + 1]
    assert [row.after for row in rows if row.after] == after[1 : len([row for row in rows if row.after]) + 1]
    assert report.shift == after[-1][0] - before[-1][0]
    assert report.later == 3


def test_undo_and_redo_are_changes_too() -> None:
    of = session("DO DRIVE 1, 30", "DO DRIVE 2, 10", "UNDO")
    report = explained(of, "SPLICE", SpliceReport)
    assert report.cause == "UNDO"
    assert {row.fate for row in report.rows} == {SegmentFate.KEPT, SegmentFate.DROPPED}
    assert {row.text for row in report.rows if row.fate is SegmentFate.DROPPED} == {"DRIVE 2, 10"}
    of.perform("REDO")
    again = explained(of, "SPLICE", SpliceReport)
    assert (again.cause, again.text) == ("REDO", "DRIVE 2, 10")
    assert {row.fate for row in again.rows} == {SegmentFate.KEPT, SegmentFate.PLANNED}


def test_nothing_has_changed_yet() -> None:
    with pytest.raises(VrsError, match="give a motion first"):
        session().perform("EXPLAIN SPLICE")


# --- lines -----------------------------------------------------------------------------------------------------------


def test_alone_it_tells_what_it_explains() -> None:
    forms = [row.form for row in explained(session(), "", ExplainOverview).rows]
    assert forms == ["motion", "location", "OAT location", "IK location", "SPLICE"]


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("EXPLAIN SIGNAL 1", "SIGNAL is no motion (EXPLAIN alone lists what there is)"),
        ("EXPLAIN OAT", "EXPLAIN OAT: location is missing (the form is EXPLAIN OAT location)"),
        ("EXPLAIN IK", "EXPLAIN IK: location is missing"),
        ("EXPLAIN SPLICE 3", "SPLICE stands alone"),
        ("EXPLAIN x = 5", "this is no motion"),
        ("EXPLAIN MOVE", "MOVE: location is missing"),
        ("EXPLAIN 5", "a transformation or a precision point is wanted"),
        ("EXPLAIN OAT IK part", "part"),
    ],
)
def test_lines_that_are_wrong(line: str, said: str) -> None:
    with pytest.raises(LineRefused) as refused:
        session(*PLACES).perform(line)
    assert said in str(refused.value)


def test_a_precision_point_has_no_angles() -> None:
    for topic in ("OAT", "IK"):
        with pytest.raises(VrsError, match=f"EXPLAIN {topic} explains a transformation"):
            session().perform(f"EXPLAIN {topic} #PPOINT(0, -90, 90, 0, 0, 0)")


def test_locations_that_bear_the_name_of_a_topic() -> None:
    of = session("POINT oat = TRANS(1, 2, 3)", "POINT ik = TRANS(4, 5, 6)")
    assert explained(of, "oat", ChainReport).text == "oat"
    assert explained(of, "oat:ik", ChainReport).text == "oat:ik"
    assert explained(of, "OAT oat", AnglesReport).text == "oat"
    assert explained(of, "IK ik", InverseReport).text == "ik"


def test_frames_that_are_functions() -> None:
    of = session()
    here, tool = (explained(of, name, ChainReport).factors[0].T for name in ("HERE", "TOOL"))
    assert (here, tool) == (of.engine.position().T_world_tool, of.engine.frames.tool)
