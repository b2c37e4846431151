"""Test that the tables of instructions and monitor commands are complete, and fit what the language reads."""

from __future__ import annotations

import re

import pytest

from vrs_cli.language.analysis.analyzer import check_line
from vrs_cli.language.analysis.structure import IN_VAL2
from vrs_cli.language.run.environment import HANDLERS
from vrs_cli.language.text import ast
from vrs_cli.language.text.parser import parse_prompt, parse_step
from vrs_cli.language.words.functions import FUNCTIONS, LINKS, OPERATORS
from vrs_cli.language.words.instructions import CONTROL, DECLARATIONS, INSTRUCTIONS
from vrs_cli.language.words.monitor import COMMANDS
from vrs_cli.language.words.word import GROUPED, RAW_SHAPES, Shape, State, Word
from vrs_cli.values.diagnostics import LineRefused, Severity

ELSEWHERE = {
    "CALL",
    "CALLS",
    "GOSUB",
    "WAIT",
    "EXIT",
    "NEXT",
    "IFSIG",
    *DECLARATIONS,
    "REMARK",
}  # the last is a comment

ROWS = [*INSTRUCTIONS.values(), *COMMANDS.values(), *CONTROL.values()]


def errors_of(statement: ast.Statement, in_program: bool) -> list[str]:
    found = check_line(statement, in_program=in_program)
    return [one.message for one in found if one.severity is Severity.ERROR]


def check_example(row: Word, statement: object, in_program: bool) -> None:
    assert isinstance(statement, ast.Instruction | ast.DoInstruction | ast.ExplainCommand)
    assert not isinstance(statement, ast.Instruction) or statement.word == row.name
    refused = [] if row.state is State.SUPPORTED else [f"*Not available* {row.name}"]
    assert [error[: len(f"*Not available* {row.name}")] for error in errors_of(statement, in_program)] == refused


def test_the_example_of_every_instruction() -> None:
    assert parse_step(INSTRUCTIONS["REMARK"].example).statement is None
    for row in INSTRUCTIONS.values():
        if row.name != "REMARK":
            check_example(row, parse_step(row.example).statement, in_program=True)


def test_the_example_of_every_command() -> None:
    for row in COMMANDS.values():
        check_example(row, parse_prompt(row.example), in_program=False)


def test_the_example_of_every_control_word() -> None:
    for row in CONTROL.values():
        statement = parse_step(row.example).statement
        assert statement is not None
        assert errors_of(statement, in_program=True) == []


def test_every_row_is_whole() -> None:
    for row in ROWS:
        check_whole(row)


def check_whole(row: Word) -> None:
    assert re.fullmatch(r"[A-Z][A-Z.]*", row.name)
    assert row.summary
    assert not row.summary.endswith(".")
    assert set(row.where) <= set("12+ ")
    assert row.modifiers <= {"AT", "ALWAYS", "UNIT", "SORT"}
    grouped = [argument.optional for argument in row.arguments if argument.shape in GROUPED]
    others = [argument.optional for argument in row.arguments if not (argument.lead or argument.shape in GROUPED)]
    assert all(part == sorted(part) for part in (grouped, others)), "what can be left out comes last"
    assert not any(argument.repeated for argument in row.arguments[:-1])
    raw = [argument.shape in RAW_SHAPES for argument in row.arguments]
    assert not any(raw[1:])
    assert row.state is not State.REFUSED or row.note or row.name == "REMARK", "a refused word says what to use"


def test_what_is_supported_is_carried_out() -> None:
    supported = {name for name, row in INSTRUCTIONS.items() if row.state is State.SUPPORTED}
    assert supported - ELSEWHERE <= set(HANDLERS)
    assert set(HANDLERS) <= supported


@pytest.mark.parametrize("shape", Shape)
def test_every_shape_of_a_function_can_be_checked(shape: Shape) -> None:
    from vrs_cli.language.analysis.expressions import SHAPES

    used = {argument.shape for row in FUNCTIONS.values() for argument in row.arguments}
    used |= {argument.shape for row in INSTRUCTIONS.values() for argument in row.arguments}
    assert shape not in used or shape in {*SHAPES, Shape.PROGRAM, Shape.PROGRAM_TEXT}


WORDS_OF_THE_REFERENCE = """
    MOVE MOVES MOVET MOVEST APPRO APPROS DEPART DEPARTS DRIVE READY NEST ALIGN DELAY DRAW GO BREAK BRAKE SPEED
    DURATION ACCEL COARSE FINE NULL NONULL CPON CPOFF INTON INTOFF ALTER ALTON ALTOFF NOALTER RIGHTY LEFTY
    ABOVE BELOW FLIP NOFLIP SINGLE MULTIPLE OVERLAP NOOVERLAP OPEN CLOSE OPENI CLOSEI RELAX RELAXI GRASP EXIT
    NEXT CALL CALLS RETURN RETURNE STOP HALT PAUSE EXECUTE PCEXECUTE ATTACH DETACH SELECT ABORT KILL CYCLE.END
    PROCEED RETRY MC PARAMETER ENABLE DISABLE SWITCH GOSUB IFSIG SETI TYPEI REMARK IGNORE REACT REACTI REACTE
    LOCK SET HERE POINT DECOMPOSE TOOL BASE CALIBRATE SIGNAL RESET BITS RUNSIG WAIT WAIT.EVENT TIMER TYPE
    PROMPT READ WRITE FCLOSE FOPENR FOPENW FOPENA DEFBELT SETBELT WINDOW AUTO LOCAL GLOBAL SHIFT INVERSE FRAME
"""

COMMANDS_OF_THE_REFERENCE = """
    WHERE HERE POINT DPOINT TEACH TOOL BASE LISTL LISTR LISTS STATUS IO FREE TIME ID HELP WATCH STACK EDIT SEE
    DIRECTORY LISTP COPY RENAME DELETE DELETEP DELETEL DELETER DELETES ZERO MODULE MDIRECTORY STOREM DELETEM
    STORE STOREP STOREL STORER STORES LOAD LOADP LOADL LISTF ERASE COMPRESS INIT
    FLIST FDIRECTORY FDELETE FRENAME FCOPY FORMAT COMMANDS CD DEFAULT
    EXECUTE PRIME PCEXECUTE PCABORT PCEND PCPROCEED PCRETRY PCSTATUS DO ABORT ESTOP PANIC PROCEED RETRY NEXT
    SSTEP XSTEP BPT DEBUG KILL CYCLE.END SPEED SIGNAL RESET CALIBRATE ENABLE DISABLE SWITCH PARAMETER SELECT
    SRV.RESET JOG PASSTHRU NET PING INSTALL TESTP UNDO TIMELINE PLOT SAVE REPLAY EXIT QUIT
"""


CONTROL_OF_THE_REFERENCE = "IF ELSE END WHILE DO UNTIL FOR CASE VALUE ANY GOTO"
OPERATORS_OF_THE_REFERENCE = "+ - * / MOD ** == <> < > <= >= NOT AND OR XOR COM BAND BOR BXOR : EQ NE LT GT LE GE"


def test_no_word_is_missing() -> None:
    assert set(WORDS_OF_THE_REFERENCE.split()) <= set(INSTRUCTIONS)
    assert set(COMMANDS_OF_THE_REFERENCE.split()) <= set(COMMANDS)
    assert set(CONTROL_OF_THE_REFERENCE.split()) == set(CONTROL)
    assert set(OPERATORS_OF_THE_REFERENCE.split()) == set(OPERATORS)


@pytest.mark.parametrize(
    ("typed", "word"),
    [("EX", "EXECUTE"), ("EXEC", "EXECUTE"), ("CALI", "CALIBRATE"), ("EN PO", "ENABLE"), ("DIR", "DIRECTORY")],
)
def test_words_are_cut_short_as_in_the_books(typed: str, word: str) -> None:
    statement = parse_prompt(typed)
    assert isinstance(statement, ast.Instruction)
    assert statement.word == word


def test_what_is_said_of_val2_is_of_words_that_it_has_not() -> None:
    rows = {**COMMANDS, **INSTRUCTIONS, **FUNCTIONS, **OPERATORS, **LINKS}
    for name in IN_VAL2:
        tables = [table[name] for table in (COMMANDS, INSTRUCTIONS, FUNCTIONS, OPERATORS, LINKS) if name in table]
        assert any(row.where == "+" for row in tables), name
    assert set(IN_VAL2) <= set(rows)


@pytest.mark.parametrize(("typed", "near"), [("DRAWW 1", "DRAW"), ("VPICTUR1", ""), ("ELSIF x", "")])
def test_a_hint_proposes_only_what_can_be_used(typed: str, near: str) -> None:
    with pytest.raises(LineRefused) as refused:
        parse_step(typed)
    hint = refused.value.diagnostic.hint
    assert near in hint
    assert "VPICTURE" not in hint
    assert "ELSEIF" not in hint
