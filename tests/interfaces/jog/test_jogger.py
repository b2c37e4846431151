"""JOG: steps of joints and of the tool, in virtual and in real time."""

from __future__ import annotations

from itertools import pairwise, product
from math import degrees, radians

import pytest

from tests.engine.wall import ManualWall
from tests.examples import in_full
from tests.interfaces.terminals import RecordingTerminal
from tests.laws.motion_laws import check_continuous, check_limits, off_line
from vrs_cli.errors import (
    IllegalJoint,
    IllegalValue,
    JointOutOfRange,
    PowerOff,
    RequestRefused,
    RobotNotAttached,
    TooNear,
    UndefinedValue,
    UsageError,
)
from vrs_cli.interfaces.jog.jogger import AXES, NEXT_STEP_LEAD_S, Jogger, axis_of
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.targets import TargetControl
from vrs_cli.kinematics.joints import Profile, largest_change
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import angle_between, compose, distance, inverse
from vrs_cli.repl.player import JogPanel
from vrs_cli.values.commands import Break
from vrs_cli.values.diagnostics import LineRefused
from vrs_cli.values.hand import Axis, Frame, Look, Press, Seen, StopJog
from vrs_cli.values.questions import Answer, Jogging, Question
from vrs_cli.values.results import Message

TABLE = "MOVE TRANS(0, 450, -150, 90, 90, 0)"
FREE = "DO MOVE #PPOINT(0, -45, 180, 20, 45, 0)"


@pytest.fixture
def terminal() -> RecordingTerminal:
    return RecordingTerminal()


@pytest.fixture
def session(terminal: RecordingTerminal) -> Session:
    session = Session(terminal)
    session.perform(TABLE)
    return session


def told(terminal: RecordingTerminal) -> list[str]:
    return [reply.text for reply in terminal.replies if isinstance(reply, Message)]


# --- virtual time ----------------------------------------------------------------------------------------------------


def test_a_joint_moves_by_a_step(session: Session) -> None:
    before = session.engine.position().joints
    session.perform("JOG 2, 5")
    after = session.engine.position()
    assert [degrees(b - a) for a, b in zip(before, after.joints, strict=True)] == pytest.approx([0, 5, 0, 0, 0, 0])
    assert not after.moving
    assert session.engine.book.records()[-1].text == "JOG 2, 5"


@pytest.mark.parametrize("name", ["X", "Y", "Z", "TX", "TY", "TZ"])
def test_the_tool_moves_along_an_axis(session: Session, name: str) -> None:
    before = session.engine.position().T_world_tool
    session.perform(f"JOG {name}, 12.5")
    after = session.engine.position().T_world_tool
    assert distance(before, after) == pytest.approx(0.0125)
    assert angle_between(before, after) == pytest.approx(0.0, abs=1e-7)
    seen = compose(inverse(before), after) if name.startswith("T") else None
    moved = (after.px - before.px, after.py - before.py, after.pz - before.pz)
    along = (seen.px, seen.py, seen.pz) if seen is not None else moved
    assert along["XYZ".index(name[-1])] == pytest.approx(0.0125)


@pytest.mark.parametrize("name", ["RX", "RY", "RZ", "TRX", "TRY", "TRZ"])
def test_the_tool_turns_about_an_axis_and_its_tip_stays(session: Session, name: str) -> None:
    session.perform(FREE)
    before = session.engine.position().T_world_tool
    session.perform(f"JOG {name}, -3")
    after = session.engine.position().T_world_tool
    assert distance(before, after) == pytest.approx(0.0, abs=1e-9)
    assert angle_between(before, after) == pytest.approx(radians(3.0))
    turn = compose(inverse(before), after) if name.startswith("T") else compose(after, inverse(before))
    column = {"X": (turn.nx, 0), "Y": (turn.sy, 1), "Z": (turn.az, 2)}[name[-1]][0]
    assert column == pytest.approx(1.0)


@pytest.mark.parametrize("profile", list(Profile.__members__))
@pytest.mark.parametrize("line", ["JOG Z, -200", "JOG TX, 150", "JOG RY, 40", "JOG TRX, -40"])
def test_a_step_of_the_tool_is_straight(session: Session, line: str, profile: str) -> None:
    session.perform(f"PARAMETER PROFILE = {profile}")
    begun, before = session.engine.now, session.engine.position().T_world_tool
    session.perform(line)
    after = session.engine.position().T_world_tool
    a, b = (before.px, before.py, before.pz), (after.px, after.py, after.pz)
    for k in range(21):
        seen = session.engine.position(begun + (session.engine.now - begun) * k / 20).T_world_tool
        assert off_line((seen.px, seen.py, seen.pz), a, b) <= 1e-6
        turned = angle_between(before, seen) + angle_between(seen, after)
        assert turned == pytest.approx(angle_between(before, after), abs=1e-6)


def test_a_joint_stops_at_the_end_of_its_range(session: Session, terminal: RecordingTerminal) -> None:
    session.perform("JOG 1, 500")
    limit = session.engine.model.upper[0]
    assert session.engine.position().joints[0] == pytest.approx(limit)
    said = f"Joint 1 stops at the end of its range, {degrees(limit):.1f} deg"
    count = len(session.engine.book.records())
    session.perform("JOG 1, 1")
    assert told(terminal) == [said, said]
    assert len(session.engine.book.records()) == count


def test_no_way_is_none_also_for_a_joint_beside_its_range_by_rounding(
    session: Session, terminal: RecordingTerminal
) -> None:
    beside = session.engine.model.upper[5] + 1e-10
    session.engine.redirect((0.0, *session.engine.position().joints[1:5], beside))
    session.engine.perform(Break())
    assert session.engine.position().joints[5] > session.engine.model.upper[5]
    session.perform("JOG 6, -0")
    assert not told(terminal)


def test_the_tool_stops_where_the_arm_ends(session: Session, terminal: RecordingTerminal) -> None:
    session.perform("JOG Y, 800")
    assert told(terminal)[0].startswith("The arm reaches no farther along Y: the wrist would be")
    reached = session.engine.position().T_world_tool
    assert (reached.px, reached.pz) == pytest.approx((0.0, -0.15), abs=1e-9)
    session.perform("JOG Y, 1")
    assert session.engine.position().T_world_tool.py == pytest.approx(reached.py, abs=2e-5)


def test_the_joint_that_ends_a_step_of_the_tool_is_named() -> None:
    terminal = RecordingTerminal()
    Session(terminal, load_robot("cobra600")).perform("JOG Z, -500")
    assert told(terminal) == [
        "The arm reaches no farther along Z: joint 3 would be 220.00 mm, its range is 0.00 to 210.00 mm"
    ]


def test_a_line_to_the_end_of_the_reach_ends_where_the_joints_can_follow() -> None:
    terminal = RecordingTerminal()
    session = Session(terminal, load_robot("planar2"))
    before = session.engine.position().T_world_tool
    session.perform("JOG Y, 800")
    assert told(terminal)[0].startswith("The arm reaches no farther along Y: the wrist would be")
    assert 0.0762 < session.engine.position().T_world_tool.py - before.py < 0.0772


def test_a_line_through_a_singularity_is_refused_and_names_the_joint() -> None:
    session = Session(RecordingTerminal(), load_robot("irb120"))
    before = session.engine.position().joints
    where = r"Joint 4 .* near X 302.0 Y 0.0 Z 54.1 mm \(wrist singularity\) \(jog the joints away"
    with pytest.raises(JointOutOfRange, match=where):
        session.perform("JOG Z, -700")
    assert session.engine.position().joints == before


def test_an_axis_that_the_arm_does_not_have_is_told_of() -> None:
    terminal = RecordingTerminal()
    Session(terminal, load_robot("planar2")).perform("JOG TRZ, 5")
    assert told(terminal) == ["This arm does not move along TRZ"]


def test_too_near_a_singularity_nothing_moves(session: Session) -> None:
    session.perform("MOVE #PPOINT(0, -60, 120, 0, 0, 0)")
    before = session.engine.position().joints
    with pytest.raises(TooNear, match="jog the joints away"):
        session.perform("JOG RX, 2")
    assert session.engine.position().joints == before


def test_the_arm_of_a_task_is_not_jogged(session: Session) -> None:
    session.load_text(".PROGRAM own()\nATTACH\nWAIT SIG(1001)\n.END\n")
    session.perform("PCEXECUTE own")
    with pytest.raises(RobotNotAttached):
        session.perform("JOG 1, 5")


def test_a_task_goes_on_beside(session: Session) -> None:
    session.load_text(".PROGRAM count()\nFOR i = 1 TO 100\nWAIT.EVENT , 0.01\nEND\n.END\n")
    session.perform("PCEXECUTE count")
    begun = session.engine.now
    session.perform("JOG 1, 20")
    passed = session.engine.now - begun
    assert session.environment.reference("i").value() == pytest.approx(passed / 0.01, abs=2.0)


def test_what_is_planned_stays(session: Session) -> None:
    session.perform("READY IN 5")
    session.perform("JOG 1, 5")
    assert [record.text for record in session.engine.book.records()] == [TABLE, "READY IN 5", "JOG 1, 5"]
    assert None not in [record.end for record in session.engine.book.records()]


@pytest.mark.parametrize(
    ("line", "kind", "message"),
    [
        ("JOG 7, 5", IllegalJoint, "1 to 6"),
        ("JOG U, 5", UsageError, "there is no axis U"),
        ("JOG 1", UsageError, "an axis and an amount"),
        ("JOG 1, far", UndefinedValue, "far"),
        ("JOG 1, $ENCODE(1)", LineRefused, "real"),
        ("JOG 1.5, 2", UsageError, "there is no axis 1.5"),
        ("JOG 1, 2000", IllegalValue, "up to 1000"),
        ("JOG TRZ, 180", IllegalValue, "less than 180 deg in a step"),
        ("JOG", UsageError, "needs a terminal with keys"),
    ],
)
def test_what_it_does_not_take(session: Session, line: str, kind: type[Exception], message: str) -> None:
    with pytest.raises(kind, match=message):
        session.perform(line)


def test_without_power_nothing_moves(session: Session) -> None:
    session.perform("DISABLE POWER")
    with pytest.raises(PowerOff):
        session.perform("JOG 1, 5")


def test_amounts_and_joints_may_be_expressions(session: Session) -> None:
    before = session.engine.position().joints
    session.perform("far = 4")
    session.perform("JOG 1+1, -far/2")
    assert degrees(session.engine.position().joints[1] - before[1]) == pytest.approx(-2.0)


def test_every_axis_has_its_name() -> None:
    session = Session(RecordingTerminal())
    for name, axis in AXES.items():
        assert (axis_of(session.engine, name.lower()), axis.name) == (axis, name)


# --- real time -------------------------------------------------------------------------------------------------------


@pytest.fixture
def wall() -> ManualWall:
    return ManualWall()


@pytest.fixture
def live(terminal: RecordingTerminal, wall: ManualWall) -> Session:
    session = Session(terminal, clock=wall.clock())
    session.perform(TABLE)
    session.perform("BREAK")
    return session


HELD = tuple(product((Axis(Frame.JOINT, 0), AXES["Z"], AXES["TRX"]), Profile.__members__))[:: 1 if in_full() else 4]


def hold(session: Session, wall: ManualWall, axis: Axis, amount: float, presses: int) -> None:
    """A key that repeats 30 times a second."""
    jogger = Jogger(session, speed=50.0)
    for _ in range(presses):
        session.settle()
        jogger.press(axis, amount)
        wall.seconds += 1 / 30


@pytest.mark.parametrize(("axis", "profile"), HELD, ids=lambda one: one if isinstance(one, str) else one.name)
def test_a_key_that_is_held_moves_the_arm_smoothly(live: Session, wall: ManualWall, axis: Axis, profile: str) -> None:
    live.perform(f"PARAMETER PROFILE = {profile}")
    begun, before = live.engine.now, live.engine.position()
    hold(live, wall, axis, 1.0, 30)
    live.settle()
    engine = live.engine
    assert engine.end - engine.now <= NEXT_STEP_LEAD_S + 0.4
    times = [begun + 0.3 + k * 0.02 for k in range(35)]
    assert all(engine.position(t).moving for t in times)
    assert any(a != b for a, b in zip(before.joints, engine.position().joints, strict=True))
    check_continuous(engine, engine.timeline)
    check_limits(engine, engine.timeline)


@pytest.mark.parametrize("profile", list(Profile.__members__))
def test_a_key_that_is_held_moves_the_tip_on_a_line(live: Session, wall: ManualWall, profile: str) -> None:
    live.perform(f"PARAMETER PROFILE = {profile}")
    engine, begun = live.engine, live.engine.now
    hold(live, wall, AXES["X"], 2.0, 30)
    hold(live, wall, AXES["X"], -2.0, 15)
    live.settle()
    assert engine.position().moving
    Jogger(live).stop()
    engine.clock.advance(engine.end)
    for k in range(100):
        tip = engine.position(begun + (engine.end - begun) * k / 99).T_world_tool
        assert off_line((tip.px, tip.py, tip.pz), (0.0, 0.45, -0.15), (1.0, 0.45, -0.15)) <= 1e-6


def test_a_step_that_is_refused_leaves_the_motion_under_way(live: Session) -> None:
    live.perform("MOVE #PPOINT(0, -60, 120, 0, 0, 0)")
    timeline = live.engine.timeline
    with pytest.raises(TooNear):
        live.perform("JOG RX, 2")
    assert live.engine.timeline is timeline


def test_what_is_planned_gives_way(live: Session) -> None:
    live.perform("READY IN 5")
    live.perform("JOG 1, 5")
    assert live.engine.book.records()[1].end is None
    assert live.engine.end < 5.0 + live.engine.now


def test_a_step_is_issued_and_executed_now(live: Session, wall: ManualWall) -> None:
    wall.seconds += 2.0
    live.perform("JOG 1, 5")
    record = live.engine.book.records()[-1]
    assert record.issued == record.executed == pytest.approx(live.engine.now)


def test_space_stops(live: Session, wall: ManualWall) -> None:
    panel = JogPanel(Jogger(live))
    panel.step = 50.0
    panel.move(1.0)
    wall.seconds += 0.3
    live.settle()
    end = live.engine.end
    panel.stop()
    assert live.engine.end < end


# --- the last key counts --------------------------------------------------------------------------------------------

JOINT_1, JOINT_2 = Axis(Frame.JOINT, 0), Axis(Frame.JOINT, 1)


def degrees_of(session: Session) -> list[float]:
    session.settle()
    return [degrees(q) for q in session.engine.position().joints]


@pytest.mark.parametrize("profile", ["LSPB", "SCURVE"])  # QUINTIC turns round in one polynomial, which takes more room
@pytest.mark.parametrize("axis", [JOINT_1, AXES["Z"], AXES["TRX"]], ids=lambda axis: axis.name)
def test_a_reversal_brakes_and_reverses(live: Session, wall: ManualWall, axis: Axis, profile: str) -> None:
    live.perform(f"PARAMETER PROFILE = {profile}")
    engine, jogger = live.engine, Jogger(live, speed=20.0)
    here = engine.position().joints
    jogger.press(axis, 50.0)
    wall.seconds += 0.5
    live.settle()
    there = engine.position()
    assert jogger.press(axis, -5.0) == ""
    wall.seconds += 60.0
    live.settle()
    ended = engine.position().joints
    assert largest_change(here, ended) < largest_change(here, there.joints) + radians(1.0)
    assert engine.end - there.time < 1.5
    check_continuous(engine, engine.timeline)
    check_limits(engine, engine.timeline)


def test_many_keys_to_and_fro_stay_where_they_began(live: Session, wall: ManualWall) -> None:
    panel = JogPanel(Jogger(live, speed=100.0), frame=Frame.WORLD, index=0)
    engine, begun = live.engine, live.engine.position().T_world_tool
    for k in range(60):
        panel.move(-1.0 if k % 2 else 1.0)
        assert panel.look().said == ""
        wall.seconds += 0.03
        live.settle()
        assert distance(engine.position().T_world_tool, begun) < 0.003
    check_continuous(engine, engine.timeline)
    check_limits(engine, engine.timeline)


def test_another_axis_takes_over(live: Session, wall: ManualWall) -> None:
    jogger = Jogger(live, speed=1.0)
    before = degrees_of(live)
    jogger.press(JOINT_1, 50.0)
    wall.seconds += 1.0
    live.settle()
    jogger.press(JOINT_2, 1.0)
    wall.seconds += 10.0
    changes = [b - a for a, b in zip(before, degrees_of(live), strict=True)]
    assert 0.5 < changes[0] < 1.5
    assert changes[1] == pytest.approx(1.0)
    assert not any(changes[2:])


def test_another_speed_takes_over(live: Session, wall: ManualWall) -> None:
    jogger = Jogger(live, speed=1.0)
    jogger.press(JOINT_1, 50.0)
    slow = live.engine.end
    wall.seconds += 1.0
    jogger.speed = 100.0
    jogger.press(JOINT_1, 50.0)
    assert live.engine.end < 4.0 < slow - 40.0


def test_a_key_takes_over_from_any_motion(live: Session, wall: ManualWall) -> None:
    live.perform("DRIVE 1, 60, 1")
    wall.seconds += 1.0
    Jogger(live).press(JOINT_2, 1.0)
    assert live.engine.end < live.engine.now + 1.0


def test_where_the_last_key_can_do_nothing_the_arm_brakes(live: Session, wall: ManualWall) -> None:
    live.perform("JOG 6, -300")
    live.perform("BREAK")
    jogger = Jogger(live, speed=1.0)
    jogger.press(JOINT_1, 50.0)
    wall.seconds += 1.0
    assert "stops at the end of its range" in jogger.press(Axis(Frame.JOINT, 5), -300.0)
    assert live.engine.end < live.engine.now + 0.5
    wall.seconds += 1.0
    jogger.press(JOINT_1, 50.0)
    wall.seconds += 1.0
    live.perform("DISABLE POWER")
    with pytest.raises(PowerOff):
        jogger.press(JOINT_2, 1.0)
    assert live.engine.end < live.engine.now + 0.5


def test_keys_begin_slow(live: Session) -> None:
    asked: list[Question] = []

    class Keys(RecordingTerminal):
        def ask(self, question: Question) -> Answer:
            asked.append(question)
            return True

    live.terminal, live.user_state.attended = Keys(), True
    live.perform("JOG")
    (keys,) = asked
    assert isinstance(keys, Jogging)
    assert (keys.joints, keys.speed) == (6, 10.0)


# --- the panel -------------------------------------------------------------------------------------------------------


def test_the_panel_steps_through_axes_frames_steps_and_speeds(session: Session) -> None:
    panel = JogPanel(Jogger(session))
    assert (panel.axis, panel.unit) == (Axis(Frame.JOINT, 0), "deg")
    panel.next_axis(-1)
    assert panel.axis.name == "6"
    panel.next_frame()
    assert (panel.axis.name, panel.unit) == ("RZ", "deg")
    panel.choose(1)
    panel.choose(17)
    panel.next_frame()
    assert (panel.axis.name, panel.unit) == ("TY", "mm")
    panel.longer(1)
    panel.faster(-1)
    panel.faster(-1)
    assert (panel.step, panel.speed) == (5.0, 20.0)
    for _ in range(20):
        panel.longer(-1)
        panel.faster(1)
    assert (panel.step, panel.speed) == (0.1, 100.0)


def test_the_panel_says_why_nothing_moves(session: Session) -> None:
    panel = JogPanel(Jogger(session))
    session.perform("DISABLE POWER")
    panel.move(1.0)
    assert "ENABLE POWER" in panel.look().said


# --- a button that is held down ---------------------------------------------------------------------------------------


UP = Press(AXES["Z"], 25.0, 10.0)


class HeldButton:
    """A button of the page."""

    def __init__(self, session: Session) -> None:
        self._control, self._jogger = TargetControl(session), Jogger(session)

    def do(self, act: Press | StopJog | Look) -> Seen:
        return self._control.jog(self._jogger, act)


def held_down(session: Session, wall: ManualWall, presses: int) -> HeldButton:
    """Its page says so ten times a second."""
    held = HeldButton(session)
    for _ in range(presses):
        held.do(UP)
        wall.seconds += 0.1
    return held


def test_an_arm_that_is_held_moves_evenly_and_stops_when_it_is_let_go(live: Session, wall: ManualWall) -> None:
    engine = live.engine
    begun, before = engine.now, engine.position().T_world_tool
    held = held_down(live, wall, 20)
    heights = [engine.position(begun + 0.7 + 0.1 * k).T_world_tool.pz for k in range(13)]
    assert [b - a for a, b in pairwise(heights)] == pytest.approx([0.005] * 12, abs=1e-6), "50 mm/s"
    seen = held.do(StopJog())
    assert seen.end - engine.now < 0.1
    assert distance(before, engine.position(seen.end).T_world_tool) == pytest.approx(0.1, abs=0.005)


def test_an_arm_of_which_nothing_is_heard_any_more_stops_by_itself(live: Session, wall: ManualWall) -> None:
    held_down(live, wall, 20)
    assert live.engine.end - live.engine.now <= NEXT_STEP_LEAD_S + 0.6


def test_an_arm_that_was_stopped_by_hand_waits_until_the_button_is_let_go(live: Session, wall: ManualWall) -> None:
    held = held_down(live, wall, 5)
    live.stop()
    stands = live.engine.end
    wall.seconds += 0.5
    with pytest.raises(RequestRefused, match="let the button go"):
        held.do(UP)
    assert live.engine.end == stands
    held.do(StopJog())
    held.do(UP)
    assert live.engine.end > live.engine.now


def test_what_something_else_does_is_not_braked_by_a_button_that_is_let_go(live: Session, wall: ManualWall) -> None:
    held = held_down(live, wall, 5)
    live.perform("JOG 1, 30")
    end = live.engine.end
    held.do(StopJog())
    assert live.engine.end == end
    HeldButton(live).do(StopJog())
    assert live.engine.end == end, "nor by one that was never pressed"
    assert held.do(Look()).end == end
