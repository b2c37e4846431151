"""Real time: the clock goes on while nobody types, programs wait for it, and what has happened stays."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.engine.wall import ManualWall
from tests.examples import in_full
from tests.interfaces.terminals import RecordingTerminal
from tests.programs.test_samples import peers_of, robot_for
from vrs_cli.errors import ClockPaused, TooLate, UsageError, VrsError
from vrs_cli.files.opening import Folder
from vrs_cli.files.timed_lines import parse_signals
from vrs_cli.interfaces.conversation.conversation import Conversation
from vrs_cli.interfaces.session.session import Session
from vrs_cli.render.text import plain_text
from vrs_cli.repl.prompt import toolbar
from vrs_cli.trajectory.instant import TICK
from vrs_cli.values.commands import SetParameter
from vrs_cli.values.replies import ClockReport, Whereabouts
from vrs_cli.values.results import Message, RunOutcome

PROGRAMS = Path(__file__).parents[3] / "programs"
SLOW = "DRIVE 1, 90, 20"  # five seconds and more


@pytest.fixture
def wall() -> ManualWall:
    return ManualWall()


@pytest.fixture
def terminal() -> RecordingTerminal:
    return RecordingTerminal()


@pytest.fixture
def session(terminal: RecordingTerminal, wall: ManualWall) -> Session:
    return Session(terminal, clock=wall.clock())


def load(session: Session, *lines: str, name: str = "main") -> None:
    found = session.load_text("\n".join([f".PROGRAM {name}()", *lines, ".END", ""]))
    assert not [one for one in found if one.severity.name == "ERROR"], found


def joint_1(session: Session, terminal: RecordingTerminal) -> tuple[float, float]:
    """What WHERE says of time and joint 1."""
    session.perform("WHERE")
    reply = terminal.replies[-1]
    assert isinstance(reply, Whereabouts)
    return reply.position.time, reply.position.joints[0]


def told(terminal: RecordingTerminal) -> list[str]:
    return [reply.text for reply in terminal.replies if isinstance(reply, Message)]


def test_a_program_that_is_late_is_interrupted_now(terminal: RecordingTerminal) -> None:
    wall = ManualWall(each_look=lambda: 0.7)
    clock = wall.clock()
    session = Session(terminal, clock=clock)
    load(session, "DRIVE 1, 150, 0.1", "FOR i = 1 TO 1000", "WAIT TIMER(0) > i", "END")
    pressed: list[float] = []

    def press(_doing: object) -> None:
        if not pressed and session.engine.now > 5.0:
            session.interrupt()
            pressed.append(clock.reached)

    terminal.progress = press  # type: ignore[method-assign]
    result = session.execute("main")
    assert result.outcome is RunOutcome.ABORTED
    brake = next(record for record in session.engine.book.records() if record.text == "BRAKE")
    assert brake.executed >= pressed[0]


# --- the same timeline -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("path", sorted(PROGRAMS.glob("*.v2"))[:: 1 if in_full() else 2], ids=lambda path: path.stem)
def test_a_program_gives_the_timeline_of_batch_to_the_bit(path: Path, tmp_path: Path) -> None:
    text, timelines = path.read_text(encoding="utf-8"), []
    for clock in (None, ManualWall(each_look=lambda: 1e-3).clock(), ManualWall(each_look=lambda: 0.7).clock(30.0)):
        folder = tmp_path / str(len(timelines))
        folder.mkdir()
        session = Session(
            RecordingTerminal(), robot_for(text), clock=clock, folder=Folder(folder), outside=peers_of(text)
        )
        session.load_text(text)
        session.engine.perform(SetParameter("CAUSALITY", "POSTPONE"))
        result = session.execute(next(iter(session.environment.programs)))
        assert result.outcome is RunOutcome.COMPLETED
        timelines.append([repr(segment) for segment in session.engine.timeline])
    assert timelines[0] == timelines[1] == timelines[2]


def test_a_program_takes_its_time(session: Session, wall: ManualWall) -> None:
    load(session, "DRIVE 1, 60, 50", "BREAK", "DELAY 2")
    begun = wall.seconds
    result = session.execute("main")
    assert wall.seconds - begun == pytest.approx(result.ended - result.started)
    assert result.ended - result.started > 3.0


# --- the prompt ------------------------------------------------------------------------------------------------------


def test_the_arm_moves_while_one_types(session: Session, terminal: RecordingTerminal, wall: ManualWall) -> None:
    session.perform(SLOW)
    assert wall.slept == []
    readings = []
    for _ in range(4):
        wall.seconds += 1.0
        readings.append(joint_1(session, terminal))
    assert [t for t, _ in readings] == pytest.approx([1.0, 2.0, 3.0, 4.0], abs=1e-6)
    angles = [q for _, q in readings]
    assert angles == sorted(angles)
    assert angles[0] < angles[-1]


def test_the_second_motion_follows_the_first(session: Session) -> None:
    session.perform(SLOW)
    session.perform(SLOW.replace("90", "-90"))
    first, second = session.engine.book.records()
    assert first.end == second.executed > 4.0


def test_a_motion_in_no_time_interrupts_the_one_under_way(session: Session, wall: ManualWall) -> None:
    session.perform(SLOW)
    wall.seconds += 1.5
    session.perform("READY IN 0")
    assert session.engine.book.records()[-1].executed == pytest.approx(1.5, abs=1e-6)


@pytest.mark.parametrize("line", ["BREAK", "OPENI", "WAIT NOT STATE(2) == 1", "TOOL TRANS(0,0,100)"])
def test_what_waits_waits(session: Session, wall: ManualWall, line: str) -> None:
    session.perform(SLOW)
    end = session.engine.end
    session.perform(line)
    assert session.engine.now == pytest.approx(end, abs=0.03)
    assert sum(wall.slept) == pytest.approx(end, abs=0.03)


@pytest.mark.parametrize("line", ["DELAY 3", "READY"])
def test_what_is_a_motion_returns_at_once(session: Session, wall: ManualWall, line: str) -> None:
    session.perform(SLOW)
    end = session.engine.end
    session.perform(line)
    assert wall.slept == []
    assert session.engine.end > end


def test_a_wait_can_be_interrupted_and_the_arm_goes_on(session: Session, wall: ManualWall) -> None:
    session.perform(SLOW)
    end = session.engine.end
    looks = iter([0.0] * 40)

    def look() -> float:
        if next(looks, None) is None:
            session.interrupt()
        return 0.0

    wall.each_look = look
    with pytest.raises(KeyboardInterrupt):
        session.perform("BREAK")
    assert 0.1 < session.engine.now < end == session.engine.end


def test_ctrl_c_in_a_program_brakes(session: Session, wall: ManualWall) -> None:
    load(session, SLOW, "BREAK", "x = 1")
    looks = iter([0.0] * 40)

    def look() -> float:
        if next(looks, None) is None:
            session.interrupt()
        return 0.0

    wall.each_look = look
    assert session.execute("main").outcome is RunOutcome.ABORTED
    assert session.engine.end < 2.0
    assert session.engine.book.records()[-1].text == "BRAKE"


def test_abort_does_not_wait(session: Session, wall: ManualWall) -> None:
    session.perform(SLOW)
    wall.seconds += 1.0
    session.perform("ABORT")
    assert wall.slept == []
    assert 1.0 < session.engine.end < 1.5


def test_tasks_go_on_while_one_types(session: Session, wall: ManualWall) -> None:
    load(session, "FOR i = 1 TO 1000", "WAIT.EVENT , 0.5", "END", name="counter")
    session.perform("PCEXECUTE counter")
    wall.seconds += 10.25
    session.settle()
    assert session.environment.reference("i").value() == 21.0
    assert session.engine.now == pytest.approx(10.25, abs=1e-6)


def test_a_question_waits_until_somebody_can_answer(
    session: Session, terminal: RecordingTerminal, wall: ManualWall
) -> None:
    terminal.answers.append("7")
    load(session, "WAIT.EVENT , 1", 'PROMPT "How many? ", n', "t = TIME()", name="asker")
    session.perform("PCEXECUTE asker")
    wall.seconds += 2.0
    session.settle()
    assert terminal.asked == []
    wall.seconds += 1.0
    session.perform("x = 1")
    assert terminal.asked == ["How many? "]
    assert session.environment.reference("n").value() == 7.0
    assert session.environment.reference("t").value() == pytest.approx(3.0, abs=1e-6)


def test_signals_of_a_file_come_when_their_time_comes(session: Session, wall: ManualWall) -> None:
    session.driver.inputs = parse_signals("2, 1001, 1")
    load(session, "WAIT SIG(1001)", "t = TIME()", name="waiter")
    session.perform("PCEXECUTE waiter")
    wall.seconds += 3.0
    session.settle()
    assert session.environment.reference("t").value() == 2.0


# --- what has happened stays -----------------------------------------------------------------------------------------


def test_a_motion_for_the_past_is_refused(session: Session, wall: ManualWall) -> None:
    session.perform(SLOW)
    wall.seconds += 2.0
    before = session.engine.timeline
    with pytest.raises(TooLate, match=r"READY AT 1 was to begin at 1\.000 s, and it is 2\.000 s"):
        session.perform("READY AT 1")
    assert session.engine.timeline is before


def test_or_it_is_postponed_to_the_end_of_the_segment(
    session: Session, terminal: RecordingTerminal, wall: ManualWall
) -> None:
    session.perform(SLOW)
    cruise = session.engine.timeline[2]
    wall.seconds += 2.0
    session.perform("PARAMETER CAUSALITY = POSTPONE")
    session.perform("READY AT 1")
    record = session.engine.book.records()[-1]
    assert (record.issued, record.executed) == (pytest.approx(2.0), pytest.approx(cruise.finish))
    assert told(terminal) == [f"READY AT 1 is postponed from 1.000 to {cruise.finish:.3f} s"]


def test_standing_still_it_is_postponed_to_now(session: Session, wall: ManualWall) -> None:
    session.perform("PARAMETER CAUSALITY = POSTPONE")
    wall.seconds += 2.0
    session.perform("READY AT 1")
    assert session.engine.book.records()[-1].executed == pytest.approx(2.0, abs=1e-6)


def test_a_program_that_comes_too_late_is_told_so(session: Session) -> None:
    load(session, "DELAY 2", "BREAK", "READY AT 1")
    fault = session.execute("main").fault
    assert fault is not None
    assert fault.message.startswith("*Execution time is past* READY AT 1")


def test_undo_takes_back_what_has_not_begun(session: Session, wall: ManualWall) -> None:
    session.perform("READY AT 5")
    wall.seconds += 4.0
    session.perform("UNDO")
    assert session.engine.book.records() == ()
    assert session.engine.now == 4.0
    session.perform("READY AT 5")
    wall.seconds += 2.0
    with pytest.raises(TooLate, match=r"READY AT 5 has begun at 5\.000 s"):
        session.perform("UNDO")


def test_redo_does_again_what_has_not_begun(session: Session, wall: ManualWall) -> None:
    session.perform("READY AT 5")
    session.perform("UNDO")
    wall.seconds += 4.0
    session.perform("REDO")
    assert session.engine.book.records()[-1].executed == 5.0
    session.perform("UNDO")
    wall.seconds += 2.0
    with pytest.raises(TooLate, match=r"READY AT 5"):
        session.perform("REDO")


def test_undo_takes_back_what_begins_at_this_very_instant(session: Session, wall: ManualWall) -> None:
    wall.seconds += 1.0
    timeline = session.engine.timeline
    session.perform("CLOCK PAUSE")
    session.perform("NEST IN 0")
    session.perform("UNDO")
    assert session.engine.timeline == timeline
    session.perform("REDO")
    session.perform("CLOCK GO")
    wall.seconds += TICK
    with pytest.raises(TooLate):
        session.perform("UNDO")


def test_in_real_time_there_is_one_course_of_events(session: Session) -> None:
    with pytest.raises(UsageError, match="one course of events"):
        session.perform("BRANCH trial")


# --- a clock that stands ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("line", ["EXECUTE main", "WAIT SIG(1001)", "BREAK"])
def test_nothing_waits_for_a_clock_that_stands(session: Session, line: str) -> None:
    load(session, "DELAY 1")
    session.perform(SLOW)
    session.engine.clock.change(paused=True)  # type: ignore[attr-defined]
    with pytest.raises(ClockPaused, match="CLOCK GO"):
        session.perform(line)
    assert not session.running
    session.engine.clock.change(paused=False)  # type: ignore[attr-defined]
    if line == "EXECUTE main":
        session.perform(line)


def test_the_clock_that_is_paused_tells_where_it_stands(
    session: Session, terminal: RecordingTerminal, wall: ManualWall
) -> None:
    """Also when it has gone on while the command was read."""
    wall.each_look = lambda: 0.05
    session.perform("CLOCK PAUSE")
    told = terminal.replies[-1]
    assert told == ClockReport(session.engine.clock.reached, 1.0, paused=True)
    session.perform("CLOCK")
    assert terminal.replies[-1] == told


def test_motions_are_planned_while_it_stands(session: Session) -> None:
    session.engine.clock.change(paused=True)  # type: ignore[attr-defined]
    session.perform(SLOW)
    session.perform("READY AT 1")
    assert len(session.engine.book.records()) == 2


def test_errors_in_real_time_leave_the_prompt_in_order(session: Session) -> None:
    for line in ("MOVE nowhere", "READY AT -1", "WAIT nothing"):
        with pytest.raises(VrsError):
            session.perform(line)
    session.perform(SLOW)
    assert not session.running


# --- CLOCK -----------------------------------------------------------------------------------------------------------


def clock_said(session: Session, terminal: RecordingTerminal, line: str) -> ClockReport:
    session.perform(line)
    reply = terminal.replies[-1]
    assert isinstance(reply, ClockReport)
    return reply


def test_the_clock_pauses_goes_on_and_changes_its_rate(
    session: Session, terminal: RecordingTerminal, wall: ManualWall
) -> None:
    wall.seconds += 2.0
    assert clock_said(session, terminal, "CLOCK PAUSE") == ClockReport(2.0, 1.0, paused=True)
    wall.seconds += 60.0
    assert clock_said(session, terminal, "CLOCK") == ClockReport(2.0, 1.0, paused=True)
    assert clock_said(session, terminal, "CLOCK GO") == ClockReport(2.0, 1.0)
    assert clock_said(session, terminal, "clock rate = 0.5") == ClockReport(2.0, 0.5)
    wall.seconds += 2.0
    assert clock_said(session, terminal, "TIME") == ClockReport(3.0, 0.5)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("CLOCK STOP", "CLOCK PAUSE, CLOCK GO, CLOCK RATE"),
        ("CLOCK RATE", "a rate of nothing"),
        ("CLOCK RATE = fast", "a rate of fast"),
        ("CLOCK RATE = 0", "CLOCK RATE = 0.001 to 1e"),
        ("CLOCK GO = 2", "CLOCK GO"),
    ],
)
def test_what_a_clock_cannot_do(session: Session, line: str, message: str) -> None:
    with pytest.raises(VrsError, match=message):
        session.perform(line)


def test_virtual_time_has_no_rate(terminal: RecordingTerminal) -> None:
    session = Session(terminal)
    assert clock_said(session, terminal, "CLOCK") == ClockReport(0.0)
    with pytest.raises(UsageError, match="vrs --realtime"):
        session.perform("CLOCK PAUSE")


def test_plain_where_tells_its_time_while_time_passes(
    session: Session, terminal: RecordingTerminal, wall: ManualWall
) -> None:
    wall.seconds += 1.25
    for line in ("WHERE", "CLOCK PAUSE", "WHERE"):
        session.perform(line)
    first, last = (reply for reply in terminal.replies if isinstance(reply, Whereabouts))
    assert plain_text(first).startswith("At 1.250 s, standing still\n")
    assert not plain_text(last).startswith("At")


def test_the_toolbar_tells_pace_and_motion(session: Session, wall: ManualWall) -> None:
    dialogue = Conversation(session)
    assert toolbar(dialogue.status(), "", 160).startswith(" t 0.00 s | ^X ABORT | at rest | X")
    session.perform(SLOW)
    wall.seconds += 1.0
    session.perform("CLOCK RATE = 2")
    assert toolbar(dialogue.status(), "", 160).startswith(
        f" t 1.00 s | ^X ABORT | rate 2, moves until {session.engine.end:.1f} s | X"
    )
    session.perform("CLOCK PAUSE")
    assert "paused, moves" in toolbar(dialogue.status(), "", 160)
