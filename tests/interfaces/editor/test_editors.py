"""EDIT as a state machine: lines in, the next draft out."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.examples import examples
from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.errors import UsageError, VrsError
from vrs_cli.interfaces.editor import editors as editor
from vrs_cli.interfaces.editor.buffer import ProgramBuffer, rebuild
from vrs_cli.interfaces.editor.editors import edit_line, subcommand
from vrs_cli.interfaces.session.session import Session
from vrs_cli.language.run.memory import Memory
from vrs_cli.language.text.ast import Program
from vrs_cli.language.text.parser import parse_file
from vrs_cli.language.text.printer import print_program, step_texts
from vrs_cli.values import replies
from vrs_cli.values.diagnostics import LineRefused


def draft(*lines: str) -> ProgramBuffer:
    """Return a buffer into which the lines were typed one after the other."""
    present = ProgramBuffer(".PROGRAM p()")
    for line in lines:
        edit_line(present, line, Memory())
    return present


def program_of(present: ProgramBuffer) -> Program:
    """Return the program of a buffer, whose heading can be read."""
    program = present.read().program
    assert program is not None
    return program


def texts(present: ProgramBuffer) -> list[str]:
    return [text.strip() for text in step_texts(program_of(present))]


@pytest.mark.parametrize(
    ("line", "asked"),
    [
        ("E", ("E", "")),
        ("  d 3", ("D", "3")),
        ("f part 5 ", ("F", "part 5")),
        ("TS", ("TS", "")),
        ("d = 3", None),
        ("D=3", None),
        ("s[1] = 2", None),
        ("r [2] = 2", None),
        ("MOVE a", None),
        ("TYPE", None),
        ("10 MOVE a", None),
        ("", None),
        ("END", None),
    ],
)
def test_a_letter_is_a_subcommand_unless_it_is_assigned(line: str, asked: tuple[str, str] | None) -> None:
    assert subcommand(line) == asked


def test_lines_are_steps_and_the_editor_stands_behind_them() -> None:
    present = draft("move a", "moves b")
    assert texts(present) == ["MOVE a", "MOVES b"]
    assert (present.at, present.prompt) == (2, "    3.? ")


def test_a_line_takes_the_place_of_the_present_step() -> None:
    assert texts(draft("MOVE a", "MOVE b", "S 1", "MOVE c")) == ["MOVE c", "MOVE b"]


def test_inserting_ends_with_an_empty_line_and_stays_at_its_step() -> None:
    present = draft("MOVE a", "MOVE b", "S 2", "I", "MOVE c", "MOVE d", "")
    assert texts(present) == ["MOVE a", "MOVE c", "MOVE d", "MOVE b"]
    assert not present.inserting
    assert present.at == 3


def test_a_refused_line_leaves_the_draft() -> None:
    before = draft("MOVE a")
    with pytest.raises(LineRefused, match="MOVEE"):
        edit_line(before, "MOVEE b", Memory())
    assert texts(before) == ["MOVE a"]


def test_find_goes_round() -> None:
    present = draft("MOVE a", "MOVE b", "MOVE a", "S 1")
    found = [present.at]
    for _ in range(2):
        edit_line(present, "F move A", Memory())
        found.append(present.at)
    assert found == [0, 2, 0]


def test_characters_are_replaced_where_they_stand() -> None:
    present = draft("MOVE part", "S 1", "R        pole:grip")
    assert texts(present) == ["MOVE pole:grip"]
    assert present.at == 0


def test_what_replacing_makes_unreadable_is_refused() -> None:
    with pytest.raises(LineRefused):
        edit_line(draft("MOVE part", "S 1"), "R   ((", Memory())


def test_parameters_are_not_the_variables_of_the_memory() -> None:
    session = Session(RecordingTerminal())
    session.perform("part = 5")
    session.perform("EDIT p(part)")
    session.perform("MOVE part")
    session.perform("E")
    assert session.user_state.editor is None
    assert session.environment.program("p").analysis.executable


def test_nothing_in_memory_changes_before_the_editor_is_left() -> None:
    session = Session(RecordingTerminal())
    session.load_text(".PROGRAM p\nMOVE a\n.END\n")
    before = session.environment.program("p")
    session.perform("EDIT p")
    session.perform("MOVE b")
    assert session.environment.program("p") is before
    session.perform("E")
    assert session.environment.program("p").source(0) == "MOVE b"


def test_a_program_that_runs_is_not_edited(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal = RecordingTerminal(["x"])
    session = Session(terminal)
    session.load_text('.PROGRAM p\nPROMPT "?", $s\n.END\n.PROGRAM q\nMOVE a\n.END\n')
    tried: list[str] = []

    def ask(_question: object) -> str:
        session.perform("EDIT q")
        session.user_state.editor = None
        with pytest.raises(UsageError, match="p is running"):
            session.perform("EDIT p")
        tried.append("p")
        return "x"

    monkeypatch.setattr(terminal, "ask", ask)
    session.perform("EXECUTE p")
    assert tried == ["p"]


def test_the_first_fault_has_the_step_and_its_line() -> None:
    terminal = RecordingTerminal()
    session = Session(terminal)
    for line in ("EDIT p", "TYPE 1", "IF TRUE THEN", "GOTO 7", "E"):
        session.perform(line)
    report = next(reply for reply in terminal.replies if isinstance(reply, replies.DiagnosticsReport))
    assert [(item.diagnostic.span.line, item.source_line.strip()) for item in report.items] == [(3, "IF TRUE THEN")]
    assert not session.environment.program("p").analysis.executable


def test_labels_that_count_like_step_numbers_stay_labels() -> None:
    session = Session(RecordingTerminal())
    for line in ("EDIT p", "1 TYPE 1", "2 TYPE 2", "E"):
        session.perform(line)
    assert [step.label for step in session.environment.program("p").program.steps] == [1, 2]


STEPS = ["MOVE a", "IF x THEN", "END", "10 TYPE 1 ; one", "; only this", "d = 4", "movee"]
LETTERS = ["", "I", "L", "L 3", "S", "S 2", "D", "D 2", "P 2", "F e", "R   TYPE 2"]
LINES = st.sampled_from([*STEPS, *LETTERS])


@examples(200)
@given(st.lists(LINES, max_size=25))
def test_law_whatever_is_typed_the_program_is_its_text(lines: list[str]) -> None:
    present = ProgramBuffer(".PROGRAM p(a)")
    for line in lines:
        try:
            edit_line(present, line, Memory())
        except VrsError:
            continue
        assert 0 <= present.at <= len(present.lines)
    program, source = rebuild(program_of(present))
    assert print_program(program) == source
    shown = source.split("\n")
    for step in program.steps:
        if step.statement is not None:
            assert shown[step.span.line - 1].strip()
    if not any(step.label for step in program.steps):
        read, _ = parse_file(source)
        assert [print_program(part) for part in read.parts] == [_without_last_blanks(source)]  # type: ignore[arg-type]


def _without_last_blanks(source: str) -> str:
    lines = source.split("\n")[:-2]
    while len(lines) > 1 and not lines[-1].strip():
        lines.pop()
    return "\n".join([*lines, ".END", ""])


def test_every_subcommand_says_what_it_is() -> None:
    for letter, row in editor.SUBCOMMANDS.items():
        assert row.form.startswith(letter)
        assert row.summary


def test_a_step_with_a_mistake_is_marked_as_listp_marks_it() -> None:
    session = Session(RecordingTerminal())
    session.load_text(".PROGRAM p\nGOTO 99\nTYPE 1\nMOVEE x\n.END\n")
    for line in ("LISTP p", "EDIT p", "P 3"):
        session.perform(line)
    listing, entered, printed = session.terminal.replies[0], *session.terminal.replies[1:3]  # type: ignore[attr-defined]
    assert [step.bad for step in listing.steps] == [True, False, True]
    assert entered.steps == listing.steps[:1]
    assert printed.steps == listing.steps
