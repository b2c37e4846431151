"""Test rows of the tables: their forms, and abbreviated words."""

from __future__ import annotations

from string import ascii_letters, ascii_uppercase

import pytest

from vrs_cli.language.words.instructions import CONTROL, INSTRUCTIONS, PROGRAM_WORDS
from vrs_cli.language.words.monitor import COMMANDS
from vrs_cli.language.words.word import Role, rows_for


@pytest.mark.parametrize(
    ("name", "form"),
    [
        ("APPRO", "APPRO location, distance [AT t | IN dt]"),
        ("DRIVE", "DRIVE joint, change[, speed] [AT t | IN dt]"),
        ("SPEED", "SPEED speed[, rotation] [MMPS | IPS | MONITOR] [ALWAYS]"),
        ("SET", "SET location = value"),
        ("SIGNAL", "SIGNAL signal, ... [AT t | IN dt]"),
        ("READY", "READY [AT t | IN dt]"),
        ("COARSE", "COARSE [tolerance] [ALWAYS]"),
        ("READ", "READ (unit[, handle[, mode]]) variable, ..."),
        ("DETACH", "DETACH [(unit)]"),
        ("PROMPT", "PROMPT [$text][, variable, ...]"),
    ],
)
def test_form(name: str, form: str) -> None:
    assert INSTRUCTIONS[name].form == form


@pytest.mark.parametrize(
    ("name", "form"),
    [
        ("FOR", "FOR variable = first TO last [STEP step]"),
        ("WHILE", "WHILE condition DO"),
        ("VALUE", "VALUE number, ...:"),
        ("END", "END"),
    ],
)
def test_form_of_control_words(name: str, form: str) -> None:
    assert CONTROL[name].form == form


@pytest.mark.parametrize(
    ("name", "form"),
    [
        ("WHERE", "WHERE [part] [FROM t1] [TO t2] [STEP dt] [AT t | IN dt]"),
        ("STORE", "STORE file [= program, ...]"),
        ("POINT", "POINT location [= value]"),
        ("EXECUTE", "EXECUTE [task] [program][, cycles][, step]"),
    ],
)
def test_form_of_commands(name: str, form: str) -> None:
    assert COMMANDS[name].form == form


@pytest.mark.parametrize(
    ("typed", "meant"),
    [
        ("EX", "EXECUTE"),  # EXIT is not VAL-II's
        ("exec", "EXECUTE"),
        ("CALI", "CALIBRATE"),
        ("EN", "ENABLE"),
        ("DIR", "DIRECTORY"),
        ("WH", "WHERE"),
        ("store", "STORE"),  # a full name, though others begin with it
        ("ABO", "ABORT"),  # commands come before instructions
        ("ALI", "ALIGN"),
        ("TIMEL", "TIMELINE"),
        ("PL", "PLOT"),
        ("MO", "MOVE"),  # MODULE is not available
        ("MODU", "MODULE"),  # nothing else can be meant
    ],
)
def test_abbreviations_at_the_prompt(typed: str, meant: str) -> None:
    assert [word.name for word in rows_for(typed, COMMANDS, PROGRAM_WORDS)] == [meant]


@pytest.mark.parametrize(
    ("typed", "meant"),
    [
        ("WAI", ["WAIT"]),
        ("MOVE", ["MOVE"]),
        ("MOV", ["MOVE"]),  # all others begin with it
        ("DEP", ["DEPART"]),
        ("DEPARTX", []),
        ("BRA", ["BRAKE"]),
    ],
)
def test_abbreviations_in_programs(typed: str, meant: list[str]) -> None:
    assert [word.name for word in rows_for(typed, PROGRAM_WORDS)] == meant


def test_no_letter_alone_is_short_for_a_word() -> None:
    assert [letter for letter in ascii_letters if rows_for(letter, COMMANDS, PROGRAM_WORDS)] == []


def test_two_letters_are_not_short_for_what_deletes_stops_steps_or_takes_back() -> None:
    pairs = [one + two for one in ascii_uppercase for two in ascii_uppercase]
    meant = [rows_for(pair, COMMANDS, PROGRAM_WORDS) for pair in pairs if pair not in COMMANDS]
    assert [rows[0].name for rows in meant if len(rows) == 1 and rows[0].drastic] == []
    for name in ("ABORT", "KILL", "ZERO", "DELETE", "RESET", "NEXT", "SSTEP", "XSTEP", "UNDO", "BASE", "TOOL"):
        assert COMMANDS[name].drastic


@pytest.mark.parametrize(("typed", "meant"), [("ABO", "ABORT"), ("ZER", "ZERO"), ("XST", "XSTEP"), ("NEX", "NEXT")])
def test_three_letters_are(typed: str, meant: str) -> None:
    assert [word.name for word in rows_for(typed, COMMANDS, PROGRAM_WORDS)] == [meant]


def test_nothing_changes_a_row() -> None:
    with pytest.raises(AttributeError):
        COMMANDS["WHERE"].name = "HERE"  # type: ignore[misc]


def test_a_role_is_called_by_the_most_that_it_may() -> None:
    roles = (Role.OBSERVER, Role.DESIGNER, Role.DESIGNER | Role.OBSERVER, Role.SUPERVISOR)
    assert [role.title_with_article for role in roles] == ["an observer", "a designer", "a designer", "a supervisor"]
