"""Sessions: files and lines in, motion and answers out; programs beside motion; stopping and going on."""

from __future__ import annotations

import pytest

from tests.interfaces.terminals import RecordingTerminal
from tests.laws.motion_laws import check_continuous, check_limits
from vrs_cli.errors import (
    JointOutOfRange,
    LocationOutOfRange,
    NoProgramSpecified,
    ProgramNotExecutable,
    UndefinedName,
    UndefinedValue,
    UsageError,
    VrsError,
)
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.tasks.limits import Limits
from vrs_cli.kinematics.joints import Profile
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.values.diagnostics import LineRefused, Severity
from vrs_cli.values.results import Message, RunOutcome

PLACES = """
.LOCATIONS
a    0 500 -200 90 90 0
b  200 450 -150 90 90 0
.END
"""


@pytest.fixture
def terminal() -> RecordingTerminal:
    return RecordingTerminal()


@pytest.fixture
def session(terminal: RecordingTerminal) -> Session:
    session = Session(terminal)
    session.load_text(PLACES)
    return session


def load(session: Session, *lines: str, name: str = "p", parameters: str = "") -> None:
    diagnostics = session.load_text("\n".join([f".PROGRAM {name}({parameters})", *lines, ".END", ""]))
    assert not [d for d in diagnostics if d.severity.name == "ERROR"], diagnostics


# --- programs beside motion ---


def test_signals_come_when_motions_begin(session: Session, terminal: RecordingTerminal) -> None:
    load(session, "MOVE a", "TYPE /F6.3, TIME()", "MOVE b", "TYPE /F6.3, TIME()", "BREAK", "TYPE /F6.3, TIME()")
    result = session.execute("p")
    first, second, end = map(float, result.typed)
    slowing = session.engine.book.records()[1].executed
    assert first == 0.0
    assert second == pytest.approx(slowing, abs=1e-3)
    assert end == pytest.approx(session.engine.end, abs=1e-3)
    assert terminal.typed.count("\n") == 3


def test_wait_lets_time_pass(session: Session) -> None:
    load(session, "TIMER 1 = 0", "WAIT TIMER(1) > 2.5", "TYPE /F4.1, TIMER(1)")
    result = session.execute("p")
    assert result.typed == (" 2.5",)
    assert result.ended - result.started == pytest.approx(2.5, abs=0.03)


def test_a_busy_loop_lets_time_pass(session: Session) -> None:
    load(session, "TIMER 1 = 0", "WHILE TIMER(1) < 1 DO", "END")
    result = session.execute("p")
    assert result.outcome is RunOutcome.COMPLETED
    assert 1.0 <= result.ended < 1.1


def test_cycles_begin_at_full_speed_again(session: Session) -> None:
    load(session, "MOVE a", "SPEED 20 ALWAYS", "MOVE b")
    result = session.execute("p", cycles=2)
    assert result.cycles == 2
    speeds = {s.motion.number: s.motion.speed for s in session.engine.timeline if s.motion.number}
    assert list(speeds.values()) == [1.0, 0.2, 1.0, 0.2]


def test_the_speed_of_a_program_is_its_own(session: Session) -> None:
    load(session, "SPEED 10 ALWAYS")
    session.execute("p")
    session.perform("MOVE a")
    assert session.engine.timeline[-1].motion.speed == 1.0


def test_typed_lines_of_pieces(session: Session) -> None:
    load(session, 'TYPE "a", /S', 'TYPE "b"', 'TYPE "c", /S')
    assert session.execute("p").typed == ("ab", "c")


def test_messages_off_types_nothing(session: Session, terminal: RecordingTerminal) -> None:
    load(session, "DISABLE MESSAGES", 'TYPE "hush"')
    session.execute("p")
    assert terminal.typed == ""


# --- what stops a program ---


def test_a_motion_that_cannot_be_done_is_placed(session: Session) -> None:
    load(session, "MOVE a", "", "MOVE SHIFT(a BY 5000)", "MOVE b")
    result = session.execute("p")
    assert result.outcome is RunOutcome.FAILED
    assert result.fault is not None
    assert (result.fault.program, result.fault.step, result.fault.line) == ("p", 3, 4)
    assert "mm" in result.fault.message
    assert len(session.engine.book.records()) == 1


def test_proceed_goes_on_behind_the_fault_and_retry_repeats_it(session: Session) -> None:
    load(session, 'TYPE "one"', "x = nothing", 'TYPE "two"')
    assert session.execute("p").outcome is RunOutcome.FAILED
    assert session.converse(session.wait(session.resume(retry=True))).outcome is RunOutcome.FAILED

    session.perform("nothing = 3")
    assert session.converse(session.wait(session.resume(retry=True))).typed == ("two",)


def test_pause_and_proceed(session: Session) -> None:
    load(session, 'TYPE "one"', "PAUSE", 'TYPE "two"')
    first = session.execute("p")
    assert (first.outcome, first.typed) == (RunOutcome.PAUSED, ("one",))
    second = session.converse(session.wait(session.resume()))
    assert (second.outcome, second.typed) == (RunOutcome.COMPLETED, ("two",))
    with pytest.raises(NoProgramSpecified):
        session.converse(session.wait(session.resume()))


def test_halt_ends_it(session: Session) -> None:
    load(session, "HALT", 'TYPE "never"')
    assert session.execute("p").outcome is RunOutcome.HALTED


def test_a_program_that_never_ends_is_stopped(session: Session) -> None:
    load(session, "WAIT TIMER(1) < 0")
    result = session.execute("p", limits=Limits(max_time=60.0))
    assert result.fault is not None
    assert "60 s" in result.fault.message
    assert result.fault.step == 1


def test_a_number_of_steps_may_be_the_bound(session: Session) -> None:
    load(session, "WHILE TRUE DO", "END")
    result = session.execute("p", limits=Limits(max_steps=50_000))
    assert result.fault is not None
    assert "50000 steps" in result.fault.message


def test_interrupt_stops_program_and_robot(session: Session) -> None:
    load(session, "SPEED 10", "MOVE a", "WAIT SIG(1001)")
    session.terminal.progress = lambda _doing: session.interrupt() if session.engine.now > 1.0 else None  # type: ignore[method-assign]
    result = session.execute("p")
    assert result.outcome is RunOutcome.ABORTED
    assert session.engine.end < 3.0
    assert not session.running


@pytest.mark.parametrize(
    ("name", "error"), [("q", UndefinedName), (None, NoProgramSpecified), ("bad", ProgramNotExecutable)]
)
def test_programs_that_cannot_start(session: Session, name: str | None, error: type[VrsError]) -> None:
    session.load_text(".PROGRAM bad()\nMOVE MOVE MOVE\n.END\n")
    with pytest.raises(error):
        session.execute(name)


# --- the prompt ---


def test_a_bare_instruction_is_done_at_once(session: Session) -> None:
    session.perform("MOVE a")
    assert session.engine.now == session.engine.end > 0.0
    session.perform("DO DRIVE 1, 10, 50")
    session.perform("DO")
    assert session.engine.book.records()[-1].number == 3


def test_a_stamped_motion_leaves_the_clock_alone(session: Session) -> None:
    session.perform("MOVE a AT 2.5")
    assert session.engine.now == 0.0
    assert session.engine.book.records()[0].executed == 2.5


def test_a_called_program_runs_as_any_other(session: Session) -> None:
    load(session, "MOVE a", "MOVE b")
    session.perform("CALL p")
    assert {s.motion.start.value for s in session.engine.timeline if s.motion.number == 2} == {"blend"}


@pytest.mark.parametrize(
    ("line", "error"),
    [
        ("MOVE nowhere", UndefinedValue),
        ("MOVE SHIFT(a BY 9000)", LocationOutOfRange),
        ("DRIVE 1, 400, 50", JointOutOfRange),
        ("MOOVE a", LineRefused),
        ("x = (1 + ", LineRefused),
        ("DO", UsageError),
        (".PROGRAM p()", UsageError),
    ],
)
def test_mistakes_are_said_and_change_nothing(session: Session, line: str, error: type[VrsError]) -> None:
    timeline = session.engine.timeline
    with pytest.raises(error):
        session.perform(line)
    assert session.engine.timeline is timeline


def test_prompt_asks_the_terminal(session: Session, terminal: RecordingTerminal) -> None:
    terminal.answers = ["12.5"]
    load(session, 'PROMPT "How many? ", n', "TYPE /F5.1, n")
    assert session.execute("p").typed == (" 12.5",)
    assert terminal.asked == ["How many? "]


def test_every_value_of_a_file_that_cannot_be_kept_is_told_with_its_line(session: Session) -> None:
    text = """
.LOCATIONS
w[-1] 500 150 -100 90 90 0
good 500 150 -100 90 90 0
.END
.REALS
n[0,-2] 4
count 12
.END
.STRINGS
$s "%s"
.END
.PROGRAM a()
    x = (1
.END
"""
    before = set(session.environment.kinds)
    found = session.load_text(text % ("x" * 200))
    errors = {one.span.line: (one.code, one.span.column) for one in found if one.severity is Severity.ERROR}
    assert errors == {3: (-404, 1), 7: (-404, 1), 11: (-416, 1), 14: (-457, 9)}
    assert set(session.environment.kinds) == before  # nothing of a section with a mistake is loaded
    session.load_text(text.replace("w[-1] 500 150 -100 90 90 0\n", "") % "a")
    assert set(session.environment.kinds) == {*before, "good", "$s"}


def test_what_keeps_a_program_from_running_is_told(session: Session) -> None:
    session.load_text(".PROGRAM a()\n    IF x THEN\n.END\n.PROGRAM b()\n    MOVEX c\n.END\n")
    with pytest.raises(ProgramNotExecutable, match="IF at step 1 has no END"):
        session.execute("a")
    with pytest.raises(ProgramNotExecutable, match="LISTP b shows its bad lines"):
        session.execute("b")


@pytest.mark.parametrize("profile", list(Profile.__members__))
@pytest.mark.parametrize("begin", [3.05, 3.2, 3.4, 3.5])
@pytest.mark.parametrize("word", ["MOVE", "MOVES"])
def test_a_duration_is_the_least_time_out_of_a_motion_too(profile: str, begin: float, word: str) -> None:
    session = Session(RecordingTerminal())
    session.perform(f"PARAMETER PROFILE = {profile}")
    session.perform("MOVE TRANS(0, 450, -150, 90, 90, 0)")
    session.perform("MOVES TRANS(150, 450, -150, 90, 90, 0) AT 3")
    session.perform("DURATION 4")
    session.perform(f"{word} TRANS(0, 450, -150, 90, 90, 0) AT {begin}")
    record = session.engine.book.records()[-1]
    assert record.end is not None
    assert 4.0 - 1e-6 <= record.end - record.executed <= 4.01


def test_a_line_carries_on_the_acceleration_of_an_arm_that_turns_its_tool_by_the_way() -> None:
    session = Session(RecordingTerminal(), load_robot("planar2"))
    session.perform("PARAMETER PROFILE = SCURVE")
    session.perform("SPEED 27")
    session.perform("MOVE #PPOINT(25.168, -71.249) AT 20")
    session.perform("SPEED 27")
    session.perform("READY")
    session.perform("MOVES SHIFT(DEST BY 2.8, -27, 0) AT 22.3")
    check_continuous(session.engine, session.engine.timeline)
    check_limits(session.engine, session.engine.timeline)


def test_a_tool_that_is_turned_otherwise_than_asked_is_told_once(terminal: RecordingTerminal) -> None:
    session = Session(terminal, load_robot("so100"))
    session.perform("MOVE TRANS(50, -200, 20, -90, 90, 0)")
    assert not terminal.replies, "so its joints can turn the tool"
    session.perform("SET aside = TRANS(50, -200, 100, 0, 0, 0)")
    session.perform("MOVE aside")
    session.perform("MOVE SHIFT(aside BY 0, 0, 30)")
    (said,) = terminal.replies
    assert isinstance(said, Message)
    assert said.text.startswith("MOVE aside: 5 joints turn the tool as nearly as they can, here ")
    assert said.text.endswith(" deg off what is asked (said once)")
