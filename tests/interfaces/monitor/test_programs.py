"""Programs in memory."""

from __future__ import annotations

from itertools import product
from string import ascii_lowercase

import pytest

from tests.interfaces.monitor.people import at, last, loaded
from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.errors import ProgramExists, UndefinedName, UndefinedValue, VrsError
from vrs_cli.interfaces.session.session import Session
from vrs_cli.language.words.instructions import PROGRAM_WORDS, RESERVED
from vrs_cli.language.words.monitor import COMMANDS
from vrs_cli.language.words.values import Kind
from vrs_cli.values import replies, results
from vrs_cli.values.diagnostics import LineRefused


def test_delete_takes_what_nobody_else_uses() -> None:
    session = loaded(RecordingTerminal())
    session.perform("DELETE main")
    assert list(session.environment.programs) == ["shared", "other"]
    assert sorted(session.environment.kinds) == ["x", "z"]


def test_delete_of_a_called_program_leaves_what_others_need() -> None:
    session = loaded(RecordingTerminal())
    session.perform("DELETE shared")
    assert list(session.environment.programs) == ["main", "helper", "other"]
    assert sorted(session.environment.kinds) == ["only.here", "x", "y", "z"]


def test_deletep_takes_the_program_alone() -> None:
    session = loaded(RecordingTerminal())
    session.perform("DELETEP main, other")
    assert list(session.environment.programs) == ["helper", "shared"]
    assert len(session.environment.kinds) == 4


def test_listp_marks_every_step_that_has_a_mistake() -> None:
    session = at(RecordingTerminal())
    lines = ("MOVEE a", "MOVE", "NEXT", "ELSEIF x THEN", "x = 1", "x = dx", 'y = "a"', "TYPE 1,", "IF x THEN")
    session.load_text("\n".join((".PROGRAM p", *lines, ".END", "")))
    session.perform("LISTP p")
    steps = last(session, replies.ProgramText).steps
    assert [step.text.strip() for step in steps if not step.bad] == ["x = 1", "x = dx"]


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


def test_directory_by_pattern() -> None:
    session = loaded(RecordingTerminal())
    session.perform("DIRECTORY *HE*")
    assert [row.name for row in last(session, replies.ProgramNames).rows] == ["helper", "other"]


def test_elements_and_whole_arrays() -> None:
    session = at(RecordingTerminal(), "a[1] = 1", "a[2] = 2", "b[1,2] = 3", "i = 1")
    session.perform("DELETER a[i+1], b")
    assert [variable.name for variable in session.environment.variables(Kind.REAL)] == ["a[1]", "i"]


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


# --- a name alone --------------------------------------------------------------------------------------------------

SHORT = tuple(
    name
    for name in (*ascii_lowercase, *map("".join, product(ascii_lowercase, repeat=2)))
    if name.upper() not in {*COMMANDS, *PROGRAM_WORDS, *RESERVED}
)


def shown(session: Session, line: str) -> list[replies.Reply]:
    assert isinstance(session.terminal, RecordingTerminal)
    before = len(session.terminal.replies)
    session.perform(line)
    return session.terminal.replies[before:]


@pytest.mark.parametrize(
    "line", ["a", "a*2", "a+row[1]", "row", "$s", '$s+"x"', "part", "part:part", "#p", "2*PI", "(3+4)"]
)
def test_an_expression_alone_shows_what_a_listing_shows(line: str) -> None:
    session = at(RecordingTerminal(), "a = 5", "row[1] = 2", '$s = "x"', "SET part = TRANS(1,2,3)", "HERE #p")
    word = {"$": "LISTS", "p": "LISTL", "#": "LISTL"}.get(line[0], "LISTR")
    assert shown(session, line) == shown(session, f"{word} {line}")


def test_every_short_name_that_is_defined_shows_its_value_and_does_nothing_else() -> None:
    session = at(RecordingTerminal(), "DRIVE 1, 30", "BASE 10", *(f"{name} = {len(name)}" for name in SHORT))
    engine = session.engine
    before = engine.timeline, engine.now, engine.position()
    for name in SHORT:
        assert shown(session, name) == [replies.RealTable(((name, float(len(name))),))]
    assert (engine.timeline, engine.now, engine.position()) == before
    assert len(session.environment.kinds) == len(SHORT)


def test_a_letter_without_a_value_is_refused() -> None:
    session = at(RecordingTerminal())
    for letter in ascii_lowercase:
        with pytest.raises(LineRefused):
            session.perform(letter)


@pytest.mark.parametrize("word", ["STATUS", "TIME", "WHERE"])
def test_a_full_word_comes_before_a_name(word: str) -> None:
    session = at(RecordingTerminal())
    session.environment.reference(word.lower()).assign(5.0)
    assert not any(isinstance(reply, replies.RealTable) for reply in shown(session, word.lower()))


def test_a_comparison_says_what_would_assign() -> None:
    note, table = shown(at(RecordingTerminal(), "a = 5"), "a == 4")
    assert note == results.Message("== compares; a = 4 assigns")
    assert table == replies.RealTable((("a == 4", 0.0),), truths=True)


@pytest.mark.parametrize("line", ["a := 5", "sp := 5", "row[1] := 5"])
def test_what_assigns_elsewhere_is_told_what_assigns_here(line: str) -> None:
    with pytest.raises(LineRefused, match="= 5 assigns"):
        at(RecordingTerminal(), "a = 1", "row[1] = 1").perform(line)
