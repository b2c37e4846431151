"""Test files: line ends, step numbers, sections, and reading on after mistakes."""

from __future__ import annotations

import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrs_cli.language.text import ast
from vrs_cli.language.text.ast import Program, Section
from vrs_cli.language.text.parser import parse_file, program_name
from vrs_cli.language.text.printer import print_file
from vrs_cli.values.diagnostics import Severity

SMALL = ".PROGRAM a()\nMOVE x\n.END\n"


def program(text: str) -> Program:
    file, diagnostics = parse_file(text)
    assert diagnostics == ()
    found = [part for part in file.parts if isinstance(part, Program)]
    assert len(found) == 1
    return found[0]


@pytest.mark.parametrize(
    "text",
    [
        SMALL,
        SMALL.replace("\n", "\r\n"),
        SMALL.replace("\n", "\r"),
        SMALL.rstrip("\n"),
        "\ufeff" + SMALL,
        SMALL + "\x1a\x1a",
        SMALL.lower(),
        " .PROGRAM   a ( )\n\tMOVE\tx  \n  .END ;that is all\n",
    ],
)
def test_texts_of_all_systems(text: str) -> None:
    steps = program(text).steps
    assert len(steps) == 1
    assert isinstance(steps[0].statement, ast.Instruction)


def test_lines_count_from_one() -> None:
    found = program("\r\n;x\r\n.PROGRAM a()\r\n\r\n  MOVE x\r\n.END\r\n")
    assert found.span.line == 3
    assert [step.span.line for step in found.steps] == [4, 5]
    assert found.steps[1].span.column == 3


def test_a_listing_with_step_numbers() -> None:
    found = program(".PROGRAM a()\n 1 x = 1\n 2 10 MOVE p\n 3\n 4 ;four\n 5 GOTO 10\n.END\n")
    assert [step.label for step in found.steps] == [None, 10, None, None, None]
    assert found.steps[3].comment == "four"
    assert isinstance(found.steps[4].statement, ast.Goto)


@pytest.mark.parametrize("mark", [".", ".?", ". ?", "?", " ?"])
def test_step_numbers_as_the_editor_prints_them(mark: str) -> None:
    text = "".join(f" {i}{mark} {step}\n" for i, step in enumerate(("x = 1", "10 MOVE p", "", "GOTO 10"), 1))
    found = program(f".PROGRAM demo.1\n{text}.END\n")
    assert [step.label for step in found.steps] == [None, 10, None, None]
    assert isinstance(found.steps[3].statement, ast.Goto)


@pytest.mark.parametrize(
    "lines", ["1 MOVE p\n2 GOTO 1", "1 MOVE p", "1 MOVE p\n3 MOVE q", "1 MOVE p\nMOVE q", "1 x = 1\n2 IF x EQ 1 THEN 1"]
)
def test_labels_are_not_step_numbers(lines: str) -> None:
    assert program(f".PROGRAM a()\n{lines}\n.END\n").steps[0].label == 1


def test_sections() -> None:
    file, diagnostics = parse_file(
        ".LOCATIONS\np 1 2 3 4 5 6\nq[2] = 1,2,3,-4,.5,6e1\n#r 10 -20 ;two joints\n\n;end\n.END\n"
        '.reals\ncount 12\nrow[1,2] = -3\n.end\n.STRINGS\n$s "a b"\n$t[1] = ""\n.END\n'
    )
    assert diagnostics == ()
    locations, reals, strings = (part for part in file.parts if isinstance(part, Section))
    assert [entry.numbers for entry in locations.entries][1:] == [(1, 2, 3, -4, 0.5, 60), (10, -20)]
    assert locations.entries[2].comment == "two joints"
    assert locations.remarks == ((3, None), (3, "end"))
    assert [entry.variable.key for entry in reals.entries] == ["count", "row"]
    assert [entry.numbers for entry in reals.entries] == [(12,), (-3,)]
    assert [entry.text for entry in strings.entries] == ["a b", ""]


@pytest.mark.parametrize(
    ("section", "line", "code"),
    [
        (".LOCATIONS", "p 1 2 3", -465),
        (".LOCATIONS", "$p 1 2 3 4 5 6", -465),
        (".LOCATIONS", 'p "x"', -465),
        (".LOCATIONS", "#p", -450),
        (".LOCATIONS", "p[i] 1 2 3 4 5 6", -465),
        (".LOCATIONS", "p[] 1 2 3 4 5 6", -465),
        (".REALS", "x 1 2", -465),
        (".REALS", "#x 1", -465),
        (".REALS", "x 1,", -450),
        (".REALS", "x = y", -450),
        (".REALS", "5", -450),
        (".REALS", "x 3y", -456),
        (".STRINGS", 's "x"', -465),
        (".STRINGS", "$s 5", -465),
        (".STRINGS", '$s "x', -460),
    ],
)
def test_mistakes_in_sections(section: str, line: str, code: int) -> None:
    file, diagnostics = parse_file(f"{section}\n{line}\n.END\n")
    assert [(one.code, one.span.line) for one in diagnostics] == [(code, 2)]
    assert isinstance(file.parts[0], Section)
    assert file.parts[0].entries == ()


def test_everything_that_is_wrong_is_told_at_once() -> None:
    text = "stray\nlines\n\nMOVE x\n.PROGRAM a()\nMOVEE x\nx = (1\n.PROGRAM a()\n.END\n.END\n.FOO\n.PROGRAM 3d\nx = )\n"
    file, diagnostics = parse_file(text)
    found = [(one.span.line, one.code) for one in diagnostics]
    assert found == [
        (1, -450),
        (4, -450),
        (5, -473),
        (6, -452),
        (7, -457),
        (8, -309),
        (10, -473),
        (11, -450),
        (12, -473),
        (12, -455),
        (13, -458),
    ]
    assert [one.severity for one in diagnostics].count(Severity.WARNING) == 2
    assert isinstance(file.parts[4], Program)
    assert [type(step.statement) for step in file.parts[4].steps] == [ast.BadLine, ast.BadLine]
    assert print_file(file).splitlines()[0] == "stray"


@pytest.mark.parametrize("text", ["; a\nb\x00c", "\x01\x02", "PK\x03\x04rest\n; b\n\x00\n\x00"])
def test_what_is_no_text_is_told_once(text: str) -> None:
    file, diagnostics = parse_file(text)
    assert not any(isinstance(part, Program | Section) for part in file.parts)
    assert [one.code for one in diagnostics] == [-503]


def test_a_control_character_hides_no_other_mistake() -> None:
    file, diagnostics = parse_file('.PROGRAM a()\nTYPE "\x00"\nMOVEE b\n.END\n.REALS\nx \x01\ny 2\n.END\n')
    assert [(one.span.line, one.span.column, one.code) for one in diagnostics] == [
        (2, 7, -503),
        (3, 1, -452),
        (6, 3, -503),
    ]
    assert isinstance(file.parts[1], Section)
    assert not file.parts[1].whole


def test_other_letters_are_fine_in_comments_and_texts() -> None:
    found = program('.PROGRAM a() ;größer\nTYPE "Öl" ;é\n.END\n')
    assert found.comment == "größer"
    assert found.steps[0].comment == "é"


@pytest.mark.parametrize(
    ("line", "hint"), [("# by C.", "a comment begins with ;"), ("#p 0 0", "a program begins with")]
)
def test_a_comment_of_another_language_outside_of_programs(line: str, hint: str) -> None:
    _, (wrong,) = parse_file(f"{line}\n{SMALL}")
    assert wrong.hint.startswith(hint)


def test_an_empty_file() -> None:
    assert parse_file("") == (ast.File(()), ())


WIDE = {
    "semicolons": ";" * 900_000,
    "brackets": "x = " + "(" * 900_000,
    "marks": "; vrs:" + " V123" * 180_000,
    "words": "GRASP " * 150_000,
}


@pytest.mark.parametrize("text", WIDE.values(), ids=WIDE)
@pytest.mark.parametrize("section", [".PROGRAM wide", ".LOCATIONS"])
def test_a_line_that_takes_long_to_be_read_is_refused_and_not_read(section: str, text: str) -> None:
    began = time.process_time()
    _, found = parse_file(f"{section}\n1 {text}\n2 {text}\n.END\n")
    assert [one.span.line for one in found] == [2, 3]
    assert all(f"a line of {len(text) + 2} characters" in one.message for one in found)
    assert time.process_time() - began < 10.0, "a search that takes the square of the length takes minutes"


# --- steps without a heading ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("end", ["", ".END\n", ".END\n.REALS\nn 3\n.END\n", ".REALS\nn 3\n.END\n"])
def test_steps_without_a_heading_are_the_program_of_the_file(end: str) -> None:
    file, found = parse_file(f'; what it does\n  TYPE "a"\n  SPEED 50\n\n{end}', name="pick")
    program, *others = [part for part in file.parts if isinstance(part, Program | Section)]
    assert isinstance(program, Program)
    assert (program.name, [step.span.line for step in program.steps]) == ("pick", [1, 2, 3])
    assert len(others) == (".REALS" in end)
    assert [(one.severity.name, one.span.line) for one in found] == [("WARNING", 1)]


@pytest.mark.parametrize(
    ("text", "name"),
    [
        (".PROGRAM a()\n TYPE 1\n.END\n", "pick"),
        ("Dear Sir,\nthis is a letter of mine.\n", "pick"),
        (".REALS\nn 3\n.END\n", "pick"),
        ("; nothing\n\n", "pick"),
        ("", "pick"),
        (" TYPE 1\n", ""),
    ],
)
def test_what_is_no_body_of_a_program(text: str, name: str) -> None:
    assert parse_file(text, name=name) == parse_file(text)


@pytest.mark.parametrize(
    ("file", "name"),
    [("pick", "pick"), ("my pick-1", "my.pick.1"), ("7up", "p.7up"), ("a" * 40, "a" * 15), ("", "p"), ("é", "p")],
)
def test_a_program_name_of_a_file(file: str, name: str) -> None:
    assert program_name(file) == name


@given(st.lists(st.sampled_from(["TYPE 1", "MOVE a", "garbage in", "; c", "", ".END", ".REALS", "n 3", "10 GOTO 10"])))
def test_no_line_of_a_body_is_lost(lines: list[str]) -> None:
    file, _ = parse_file("\n".join(lines), name="a")
    parts = file.parts
    if parts and isinstance(parts[0], Program):
        body = next((i for i, line in enumerate(lines) if line in (".END", ".REALS")), len(lines))
        kept = [step.span.line for step in parts[0].steps]
        assert kept == list(range(1, len(kept) + 1))
        assert not any(line for line in lines[len(kept) : body])
