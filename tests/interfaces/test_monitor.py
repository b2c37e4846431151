"""Monitor commands: what they do to a session, and what they answer. Whole dialogues: tests/repl/sessions."""

from __future__ import annotations

from math import degrees
from pathlib import Path
from typing import Any, TypeVar

import pytest

from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.errors import (
    FileExists,
    IllegalJoint,
    IllegalValue,
    InvalidName,
    ProgramExists,
    UndefinedName,
    UndefinedValue,
    UsageError,
    VrsError,
)
from vrs_cli.interfaces import replies
from vrs_cli.interfaces.monitor import MONITOR, changed, free_memory
from vrs_cli.interfaces.session import Dialogue, Session
from vrs_cli.kinematics.transform import IDENTITY
from vrs_cli.language.ast import Kind
from vrs_cli.language.monitor import COMMANDS
from vrs_cli.language.values import numbers_of
from vrs_cli.language.words import State

R = TypeVar("R")

PART = "POINT part = TRANS(500,150,-100,90,90,0)"
PROGRAMS = """\
.PROGRAM main
    CALL helper
    CALL shared
    x = 1
.END
.PROGRAM helper
    y = x
    MOVE only.here
.END
.PROGRAM shared
    z = 1
.END
.PROGRAM other
    CALL shared
    z = x
.END
"""


class Person(RecordingTerminal):
    """Somebody at the terminal; None among the answers is Ctrl-C."""

    def __init__(self, *changes: str | None, sure: bool = True) -> None:
        super().__init__(sure=sure)
        self.changes = list(changes)
        self.progressed: list[float] = []
        self.running = 0

    def change(self, question: str) -> str | None:
        self.asked.append(question)
        return self.changes.pop(0)

    def begin_progress(self) -> None:
        self.running += 1

    def progress(self, clock: float) -> None:
        self.progressed.append(clock)

    def end_progress(self) -> None:
        self.running -= 1


def at(terminal: RecordingTerminal, *lines: str) -> Session:
    session = Session(terminal)
    for line in lines:
        session.perform(line)
    return session


def last(session: Session, kind: type[R]) -> R:
    """The latest reply, which is of that kind."""
    reply = session.terminal.replies[-1]  # type: ignore[attr-defined]
    assert isinstance(reply, kind)
    return reply


def location(session: Session, name: str) -> list[float]:
    values = {variable.name: variable.value for kind in Kind for variable in session.environment.variables(kind)}
    value: Any = values[name]
    return [round(number, 6) for number in numbers_of(value)]


# --- the table -----------------------------------------------------------------------------------------------------


def test_every_supported_command_has_a_handler_and_no_other_has() -> None:
    supported = {name for name, word in COMMANDS.items() if word.state is State.SUPPORTED}
    assert set(MONITOR) == supported - {"DO"}  # DO is a statement of its own: Session carries it out


@pytest.mark.parametrize("name", [name for name, word in COMMANDS.items() if word.state is not State.SUPPORTED])
def test_other_commands_are_refused_by_name(name: str) -> None:
    terminal = RecordingTerminal()
    with pytest.raises(Exception, match=name.replace(".", r"\.")):
        at(terminal, name)
    assert terminal.replies == []


# --- positions -----------------------------------------------------------------------------------------------------


def test_where_is_g() -> None:
    session = at(RecordingTerminal(), "DRIVE 1, 60", "WHERE AT 0.5")
    reply = last(session, replies.Whereabouts)
    assert reply.position == session.engine.position(0.5)
    assert reply.stamped


def test_where_over_time_ends_at_the_exact_end() -> None:
    session = at(RecordingTerminal(), "DRIVE 1, 60", "WHERE FROM 0.1 STEP 0.3")
    times = [position.time for position in last(session, replies.WhereaboutsTable).positions]
    assert times == pytest.approx([0.1, 0.4, 0.7, 1.0, session.engine.end])


@pytest.mark.parametrize(
    ("line", "times"),
    [
        ("WHERE FROM 0 TO 1 STEP 0.25", [0.0, 0.25, 0.5, 0.75, 1.0]),
        ("WHERE FROM 0 TO 0.3 STEP 0.1", [0.0, 0.1, 0.2, 0.3]),
        ("WHERE FROM 1 TO 1", [1.0]),
        ("WHERE FROM 0 TO 1 STEP 9", [0.0, 1.0]),
    ],
)
def test_times_of_where(line: str, times: list[float]) -> None:
    session = at(RecordingTerminal(), line)
    assert [position.time for position in last(session, replies.WhereaboutsTable).positions] == pytest.approx(times)


@pytest.mark.parametrize(
    "line", ["WHERE FROM 2 TO 1", "WHERE FROM 0 TO 1 STEP 0", "WHERE FROM 0 TO 1 STEP 1E-9", "WHERE 2"]
)
def test_where_refuses(line: str) -> None:
    with pytest.raises(IllegalValue):
        at(RecordingTerminal(), line)


# --- Change? -------------------------------------------------------------------------------------------------------


def test_changes_until_an_empty_line() -> None:
    person = Person(",,-50", "510", "")
    session = at(person, PART)
    assert location(session, "part") == [510.0, 150.0, -50.0, 90.0, 90.0, 0.0]
    assert person.asked == ["Change?"] * 3
    assert len(person.replies) == 3


def test_changes_of_joints() -> None:
    session = at(Person(",-80,100,,30", ""), "HERE #safe")
    assert location(session, "#safe") == [0.0, -80.0, 100.0, 0.0, 30.0, 0.0]


def test_a_new_point_begins_at_null() -> None:
    session = at(Person("1,2,3", "", "5", ""), "POINT new", "POINT #new")
    assert location(session, "new") == [1.0, 2.0, 3.0, 90.0, -90.0, 0.0]
    assert location(session, "#new") == [5.0, 0.0, 0.0, 0.0, 0.0, 0.0]


def test_ctrl_c_leaves_it_as_it_was() -> None:
    session = at(Person("", "1,2,3", None), PART, "POINT part")
    assert location(session, "part") == [500.0, 150.0, -100.0, 90.0, 90.0, 0.0]
    session = at(Person(None), "POINT new")
    assert session.environment.kind_of("new") is None


def test_a_change_of_a_compound_is_relative_to_its_frame() -> None:
    session = at(Person(",,7", ""), "SET table = TRANS(100,0,0)", "HERE table:inside")
    assert location(session, "inside") == [-120.32, 149.09, 7.0, 90.0, -90.0, 0.0]


@pytest.mark.parametrize("answer", ["1,2,3,4,5,6,7", "a", "1,b", "1:2"])
def test_a_wrong_change_is_asked_again(answer: str) -> None:
    person = Person(answer, "1", "")
    session = at(person, PART)
    assert location(session, "part")[0] == 1.0
    errors = [reply for reply in person.replies if isinstance(reply, replies.Message)]
    assert [message.tone for message in errors] == [replies.Tone.ERROR]


def test_changed_keeps_what_is_skipped() -> None:
    assert numbers_of(changed(IDENTITY, ",,5")) == pytest.approx((0.0, 0.0, 5.0, 90.0, -90.0, 0.0))
    assert [round(degrees(q)) for q in changed((0.1, 0.2), "10")] == [10, 11]  # type: ignore[arg-type]


def test_where_nobody_is_there_nothing_is_asked() -> None:
    terminal = RecordingTerminal()
    at(terminal, PART, "HERE start", "POINT part")
    assert terminal.asked == []
    with pytest.raises(UndefinedValue, match="nothing"):
        at(terminal, "POINT nothing")


# --- deleting ------------------------------------------------------------------------------------------------------


def loaded(terminal: RecordingTerminal) -> Session:
    session = Session(terminal)
    session.load_text(PROGRAMS)
    for line in ("x = 1", "y = 2", "z = 3", "SET only.here = TRANS(1,2,3)"):
        session.perform(line)
    return session


def test_delete_takes_what_nobody_else_uses() -> None:
    session = loaded(RecordingTerminal())
    session.perform("DELETE main")
    assert list(session.environment.programs) == ["shared", "other"]
    assert sorted(session.environment.kinds()) == ["x", "z"]


def test_delete_of_a_called_program_leaves_what_others_need() -> None:
    session = loaded(RecordingTerminal())
    session.perform("DELETE shared")
    assert list(session.environment.programs) == ["main", "helper", "other"]
    assert sorted(session.environment.kinds()) == ["only.here", "x", "y", "z"]


def test_deletep_takes_the_program_alone() -> None:
    session = loaded(RecordingTerminal())
    session.perform("DELETEP main, other")
    assert list(session.environment.programs) == ["helper", "shared"]
    assert len(session.environment.kinds()) == 4


@pytest.mark.parametrize("line", ["DELETE main", "DELETEP main", "DELETER x", "DELETEL only.here", "ZERO"])
def test_nothing_goes_without_a_yes(line: str) -> None:
    for terminal in (Person(sure=False), RecordingTerminal(sure=False)):
        session = loaded(terminal)
        session.perform(line)
        assert (len(session.environment.programs), len(session.environment.kinds())) == (4, 4)
        assert terminal.asked[0].endswith("Are you sure (Y/N)?")
        refused = last(session, replies.Message)
        assert (refused.tone is replies.Tone.ERROR) is not isinstance(terminal, Dialogue)


def test_disable_interactive_asks_nothing() -> None:
    terminal = Person(sure=False)
    session = loaded(terminal)
    session.perform("DISABLE INTERACTIVE")
    session.perform("ZERO")
    assert (terminal.asked, session.environment.programs, session.environment.kinds()) == ([], {}, {})


def test_zero_forgets_the_last_program() -> None:
    session = loaded(RecordingTerminal())
    session.perform("EXECUTE other")
    session.perform("ZERO")
    assert (session.last_program, session.task) == (None, None)


@pytest.mark.parametrize(
    ("line", "error"),
    [("DELETEL nothing", UndefinedValue), ("DELETEP nothing", UndefinedName), ("COPY main = other", ProgramExists)],
)
def test_what_cannot_be_deleted_or_copied(line: str, error: type[Exception]) -> None:
    with pytest.raises(error):
        loaded(RecordingTerminal()).perform(line)


def test_elements_and_whole_arrays() -> None:
    session = at(RecordingTerminal(), "a[1] = 1", "a[2] = 2", "b[1,2] = 3", "i = 1")
    session.perform("DELETER a[i+1], b")
    assert [variable.name for variable in session.environment.variables(Kind.REAL)] == ["a[1]", "i"]


# --- listings ------------------------------------------------------------------------------------------------------


def test_listr_is_a_desk_calculator() -> None:
    session = at(RecordingTerminal(), "n = 3", "LISTR n*2, SQRT(16)")
    assert last(session, replies.RealTable).rows == (("n*2", 6.0), ("SQRT(16)", 4.0))


@pytest.mark.parametrize("line", ["LISTL a", "LISTL a[1]", "LISTS a", "LISTR $s"])
def test_values_of_another_kind_are_refused(line: str) -> None:
    session = at(RecordingTerminal(), "a[1] = 1", '$s = "text"')
    with pytest.raises(VrsError, match="type mismatch"):
        session.perform(line)


def test_a_name_alone_is_the_variable_and_its_array() -> None:
    session = at(RecordingTerminal(), "a = 5", "a[1] = 1", "LISTR a", "LISTR A[1]")
    tables = [reply.rows for reply in session.terminal.replies]  # type: ignore[attr-defined]
    assert tables == [(("a", 5.0), ("a[1]", 1.0)), (("a[1]", 1.0),)]


def test_directory_by_pattern() -> None:
    session = loaded(RecordingTerminal())
    session.perform("DIRECTORY *HE*")
    assert [row.name for row in last(session, replies.ProgramNames).rows] == ["helper", "other"]


# --- files ---------------------------------------------------------------------------------------------------------


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_store_and_load_bring_everything_back(folder: Path) -> None:
    session = loaded(RecordingTerminal())
    session.perform('$name = "A-17"')
    session.perform("STORE cell")
    again = at(RecordingTerminal(), "LOAD cell")
    assert list(again.environment.programs) == list(session.environment.programs)
    assert again.environment.kinds() == session.environment.kinds()
    assert (folder / "cell.v2").exists()


@pytest.mark.parametrize(
    ("line", "file", "sections"),
    [
        ("STOREP f", "f.pg", [".PROGRAM"] * 4),
        ("STOREL f", "f.lc", [".LOCATIONS"]),
        ("STORER f", "f.rv", [".REALS"]),
        ("STORES f", "f.st", [".STRINGS"]),
        ("STORE f.txt = shared", "f.txt", [".PROGRAM", ".REALS"]),
    ],
)
def test_parts_have_their_extension(folder: Path, line: str, file: str, sections: list[str]) -> None:
    session = loaded(RecordingTerminal())
    session.perform('$name = "A-17"')
    session.perform(line)
    words = [text.split()[0] for text in (folder / file).read_text().splitlines() if text.startswith(".")]
    assert [word for word in words if word != ".END"] == sections


def test_a_file_that_is_there_is_overwritten_only_when_agreed(folder: Path) -> None:
    (folder / "cell.v2").write_text("; mine\n")
    session = loaded(Person(sure=False))
    with pytest.raises(FileExists, match=r"cell\.v2"):
        session.perform("STORE cell")
    with pytest.raises(FileExists):
        session.perform("SAVE cell.v2")
    assert (folder / "cell.v2").read_text() == "; mine\n"
    loaded(Person(sure=True)).perform("STORE cell")
    assert ".PROGRAM main" in (folder / "cell.v2").read_text()


def test_load_keeps_programs_and_overwrites_variables(folder: Path) -> None:
    (folder / "new.v2").write_text(".PROGRAM main\nTYPE 1\n.END\n.PROGRAM fresh\n.END\n.REALS\nx 77\n.END\n")
    session = loaded(RecordingTerminal(sure=False))
    kept = session.environment.programs["main"]
    session.perform("LOAD new.v2")
    assert session.environment.programs["main"] is kept
    assert "fresh" in session.environment.programs
    assert dict(session.environment.variables(Kind.REAL))["x"] == 77.0
    texts = [reply.text for reply in session.terminal.replies]  # type: ignore[attr-defined]
    assert texts[0].startswith("*Program already exists* main")
    assert texts[1] == "new.v2 loaded: fresh; main stays as before"


@pytest.mark.parametrize("sure", [True, False])
def test_load_asks_before_it_replaces(folder: Path, sure: bool) -> None:
    (folder / "new.v2").write_text(".PROGRAM main\nTYPE 1\n.END\n.PROGRAM fresh\n.END\n")
    session = loaded(Person(sure=sure))
    session.perform("LOAD new.v2")
    assert (len(session.environment.programs["main"].program.steps) == 1) is sure
    assert session.terminal.asked == ["Program main exists. Replace it (Y/N)?"]  # type: ignore[attr-defined]
    (said,) = [reply.text for reply in session.terminal.replies]  # type: ignore[attr-defined]
    assert said == f"new.v2 loaded: {'main (replaced), fresh' if sure else 'fresh; main stays as before'}"


def test_execute_alone_runs_the_first_program_of_a_file(folder: Path) -> None:
    (folder / "new.v2").write_text(".PROGRAM second\nTYPE 1\n.END\n.PROGRAM another\nTYPE 2\n.END\n")
    session = at(RecordingTerminal(), "LOAD new", "EXECUTE", "EXECUTE another", "EXECUTE")
    assert session.terminal.typed.split() == ["1", "2", "2"]  # type: ignore[attr-defined]


def test_status_shows_what_is_said_for_the_next_motion() -> None:
    def waiting(*lines: str) -> tuple[str, ...]:
        session = at(RecordingTerminal(), "READY", *lines, "STATUS")
        status = session.terminal.replies[-1]  # type: ignore[attr-defined]
        assert isinstance(status, replies.StatusReport)
        return status.next_motion

    assert waiting() == ()
    said = ("LEFTY", "RIGHTY", "FLIP", "DO SPEED 50", "CPOFF", "FINE", "DURATION 2", "OPEN")
    assert waiting(*said) == ("FLIP", "SPEED 50 %", "DURATION 2 s", "FINE", "CPOFF", "OPEN")
    assert waiting(*said, "DRIVE 1, 10") == ("FLIP",)
    assert waiting(*said, "READY") == ()


def test_a_trajectory_is_loaded_as_a_branch() -> None:
    session = at(RecordingTerminal(), "READY", "SAVE 2-demo", "DRIVE 1, 60", "LOAD 2-demo.vrst")
    assert session.branches.present == "t2.demo"
    assert [record.text for record in session.engine.records()] == ["READY"]
    assert session.prompt == "(t2.demo)."


def test_a_file_that_is_read_long_is_seen_to_be() -> None:
    class Watcher(RecordingTerminal):
        def begin_progress(self) -> None:
            self.asked.append("begin")

        def reading(self, path: str, share: float) -> None:
            self.asked.append(f"{path} {share > 0.0}")

        def end_progress(self) -> None:
            self.asked.append("end")

    watcher = Watcher()
    session = at(watcher, "READY", "SAVE demo", "REPLAY demo")
    assert watcher.asked == ["begin", "demo.vrst True", "end"]
    session.perform("LOAD demo.vrst")
    assert watcher.asked[3:] == watcher.asked[:3]


def test_save_and_replay() -> None:
    session = at(
        RecordingTerminal(),
        "DO SPEED 50, 30 ALWAYS",
        "DRIVE 1, 60",
        "DRIVE 2, 10 AT 0.5",
        "UNDO",
        "SAVE demo",
        "REPLAY demo",
    )
    replayed = last(session, replies.Replay)
    assert replayed.timeline == session.engine.timeline
    assert (replayed.path, replayed.changes, replayed.dropped_tail) == (Path("demo.vrst"), 3, False)


# --- programs ------------------------------------------------------------------------------------------------------


def test_execute_tells_how_it_went() -> None:
    session = loaded(Person())
    session.perform("EXECUTE other")
    assert last(session, replies.Message).text == "Program completed"
    session.load_text(".PROGRAM p\nPAUSE\nq = nothing\nHALT\n.END\n")
    endings = []
    for line in ("EXECUTE p", "PROCEED", "PROCEED"):
        session.perform(line)
        stopped = last(session, replies.ProgramStopped)
        endings.append(
            (stopped.what.split("*")[1] if "*" in stopped.what else stopped.what, stopped.step, stopped.tone)
        )
    note, error = replies.Tone.NOTE, replies.Tone.ERROR
    assert endings == [("(PAUSED)", 1, note), ("Undefined value", 2, error), ("(HALTED)", 3, note)]


def test_retry_does_the_failed_step_again() -> None:
    session = at(RecordingTerminal())
    session.load_text(".PROGRAM p\nq = nothing\n.END\n")
    session.perform("EXECUTE p")
    session.perform("nothing = 4")
    session.perform("RETRY")
    assert last(session, replies.Message).text == "Program completed"
    assert dict(session.environment.variables(Kind.REAL))["q"] == 4.0


def test_arguments_go_by_reference() -> None:
    session = at(RecordingTerminal())
    session.load_text(".PROGRAM add(a, b)\na = a + b\n.END\n")
    session.perform("total = 5")
    session.perform("EXECUTE add(total, 2), 3")
    assert dict(session.environment.variables(Kind.REAL))["total"] == 11.0


def test_whoever_watches_sees_progress() -> None:
    person = Person("")
    session = at(person, PART)
    session.load_text(".PROGRAM p\nMOVE part\nREADY\n.END\n")
    session.perform("EXECUTE p")
    assert person.progressed[-1] == session.engine.now
    assert person.running == 0


def test_abort_stops_motion_that_is_scheduled() -> None:
    session = at(RecordingTerminal(), "DRIVE 1, 60 AT 5", "ABORT")
    assert last(session, replies.Message).text == "The motion is stopped"
    assert session.engine.position(100.0).joints[0] == pytest.approx(0.0)
    session.perform("ABORT")
    assert last(session, replies.Message).text == "Nothing is running"


def test_status_follows_the_program() -> None:
    session = at(RecordingTerminal(), "STATUS")
    assert last(session, replies.StatusReport).progress is None
    session.load_text(".PROGRAM p\nTYPE 1\nPAUSE\n.END\n")
    session.perform("EXECUTE p, -1")
    session.perform("STATUS")
    assert last(session, replies.StatusReport).progress == replies.Progress("p", "paused", 2, 0, None)


# --- settings and the rest -----------------------------------------------------------------------------------------


def test_settings_are_shown_by_name_or_all() -> None:
    session = at(RecordingTerminal(), "DIS CP", "SWITCH CP, POW", "SWITCH", "PARAMETER HAND")
    shown, everything, hand = (reply.rows for reply in session.terminal.replies)  # type: ignore[attr-defined]
    assert [(row.name, row.value) for row in shown] == [("CP", "OFF"), ("POWER", "ON")]
    assert len(everything) == len(session.engine.parameters.switches)
    assert [(row.name, row.value) for row in hand] == [("HAND.TIME", "0.05 s")]


def test_undo_takes_the_clock_back() -> None:
    session = at(RecordingTerminal(), "DRIVE 1, 60", "UNDO")
    assert last(session, replies.Message).text == "DRIVE 1, 60 is undone; the clock is at 0.000 s"
    assert session.engine.now == 0.0
    with pytest.raises(UsageError, match="no motion to undo"):
        session.perform("UNDO")


def test_free_counts_what_is_there() -> None:
    session = loaded(RecordingTerminal())
    session.perform("FREE")
    report = last(session, replies.FreeReport)
    assert (report.programs, report.steps, report.variables, report.segments) == (4, 8, 4, 1)


def test_free_memory_is_a_percentage_or_unknown(monkeypatch: pytest.MonkeyPatch) -> None:
    share = free_memory()
    assert share is None or 0.0 <= share <= 100.0

    def unknown(_name: str) -> int:
        raise ValueError("unrecognized configuration name")

    monkeypatch.setattr("os.sysconf", unknown)
    assert free_memory() is None


@pytest.mark.parametrize("word", ["EXIT", "QUIT"])
def test_leaving(word: str) -> None:
    assert last(at(RecordingTerminal(), word), replies.Farewell) == replies.Farewell()


# --- what does not go together -------------------------------------------------------------------------------------


def test_one_time_and_a_stretch_of_time_do_not_go_together() -> None:
    with pytest.raises(UsageError, match="AT and FROM"):
        at(RecordingTerminal(), "WHERE AT 1 FROM 2")


@pytest.mark.parametrize("line", ["PLOT banana", "PLOT 7", "PLOT X, 1"])
def test_a_plot_that_cannot_be_is_refused_also_before_the_first_motion(line: str) -> None:
    with pytest.raises((UsageError, IllegalJoint)):
        at(RecordingTerminal(), line)


# --- TEACH ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("asked", "names"),
    [
        ("part", ["part", "part1", "part2"]),
        ("#via8", ["#via8", "#via9", "#via10"]),
        ("row[2]", ["row[2]", "row[3]", "row[4]"]),
        ("row[1, 9]", ["row[1,9]", "row[1,10]", "row[1,11]"]),
    ],
)
def test_teach_counts_names_up(asked: str, names: list[str]) -> None:
    lines = (line for _ in range(3) for line in ("DRIVE 1, 10", f"TEACH {asked}"))
    session = at(RecordingTerminal(), "READY", *lines)
    taught = {
        name: value for kind in (Kind.LOCATION, Kind.PRECISION) for name, value in session.environment.variables(kind)
    }
    assert set(taught) == set(names)
    assert len(set(map(str, taught.values()))) == 3
    assert not session.terminal.asked  # type: ignore[attr-defined]


def test_teach_says_what_cannot_be_counted_up() -> None:
    session = at(RecordingTerminal(), "TEACH abcdefghijklmno")
    with pytest.raises(InvalidName, match="at most 15 characters"):
        session.perform("TEACH abcdefghijklmno")
    with pytest.raises(IllegalValue, match="TEACH part"):
        session.perform("TEACH part:offset")


def test_a_remark_is_no_change() -> None:
    session = at(Person(",,50 ; higher", " ;nothing"), "POINT part = NULL")
    (part,) = session.environment.variables(Kind.LOCATION)
    assert numbers_of(part.value)[:3] == pytest.approx((0.0, 0.0, 50.0))  # type: ignore[arg-type]
