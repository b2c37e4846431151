from __future__ import annotations

import pytest

from vrs_cli.kinematics.model import load_robot
from vrs_cli.lsp.document import Document, SymbolKind

PUMA = load_robot("puma560")
TEXT = """\
.PROGRAM main ;the whole day
    count = 0
    HERE start
10  TYPE "count GOTO 10", count ; count
    CALL count(part, count)
    IF count > 3 GOTO 10
    GOTO 10
    MOVE start
.END
.PROGRAM count(a, n)
    n = n+1
    SET place = a
    $line = "x"

.END
.LOCATIONS
part 400 150 200 90 -90 0
row[1] 400 150 200 90 -90 0
.END
"""
LINES = TEXT.split("\n")
DOCUMENT = Document(TEXT, PUMA)


def column(line: int, word: str, nth: int = 1) -> int:
    at = -1
    for _ in range(nth):
        at = LINES[line - 1].index(word, at + 1)
    return at + 1


def target(line: int, word: str, nth: int = 1) -> str:
    """What go to definition on a word leads to, as `line:word`."""
    span = DOCUMENT.definition(line, column(line, word, nth))
    return "" if span is None else f"{span.line}:{LINES[span.line - 1][span.column - 1 : span.end - 1]}"


@pytest.mark.parametrize(
    ("line", "word", "nth", "expected"),
    [
        (4, "count", 2, "2:count"),
        (5, "count", 1, "10:count"),  # the program that is called, not the variable of that name
        (5, "count", 2, "2:count"),
        (5, "part", 1, "17:part"),
        (6, "10", 1, "4:10"),
        (7, "10", 1, "4:10"),
        (8, "start", 1, "3:start"),
        (11, "n", 2, "10:n"),
        (12, "place", 1, "12:place"),
        (4, "count", 1, ""),  # inside a text
        (4, "count", 3, ""),  # in a comment
        (6, "3", 1, ""),  # a number that is no label
    ],
)
def test_definition(line: int, word: str, nth: int, expected: str) -> None:
    assert target(line, word, nth) == expected


def test_definition_of_what_is_read() -> None:
    document = Document(".PROGRAM main()\nATTACH (lun, 4)\nREAD (lun) x, y\nTYPE y, lun\n.END\n", PUMA)
    spans = [document.definition(4, place) for place in (6, 9)]
    assert [(span.line, span.column) for span in spans if span is not None] == [(3, 15), (2, 9)]


def test_symbols() -> None:
    main, count, section = DOCUMENT.symbols
    assert (main.name, main.kind, main.span.line, main.last) == ("main", SymbolKind.PROGRAM, 1, 9)
    assert [(child.name, child.kind, child.span.line) for child in main.children] == [("10", SymbolKind.LABEL, 4)]
    assert count.detail == "count(a, n)"
    assert [child.name for child in section.children] == ["part", "row[1]"]


def test_a_program_without_end_reaches_to_the_next() -> None:
    document = Document(".PROGRAM a\nx = 1\n.PROGRAM b\nx = 2\n", PUMA)
    assert [(one.name, one.span.line, one.last) for one in document.symbols] == [("a", 1, 2), ("b", 3, 4)]


def offered(text: str) -> list[str]:
    """What is offered at the `|` of a line in the program count."""
    lines = [*LINES[:13], text.replace("|", ""), *LINES[14:]]
    found = Document("\n".join(lines), PUMA).completions(14, text.index("|") + 1)
    return [one.text for one in found]


def test_words_come_with_form_and_summary() -> None:
    found = DOCUMENT.completions(14, 1)
    assert any(one.meta == "MOVE location [AT t | IN dt]: joint-interpolated motion to a location" for one in found)


def test_completion_by_what_is_wanted() -> None:
    assert offered("    CALL |")[:2] == ["main", "count"]
    assert {"part", "place", "start"} <= set(offered("    MOVE |"))
    assert "count" not in offered("    MOVE |")
    assert "WHERE" not in offered("    W|")  # a monitor command
    assert "WAIT" in offered("    W|")
    assert offered('    TYPE "W|') == []


def test_labels_after_goto() -> None:
    assert [one.text for one in DOCUMENT.completions(7, len("    GOTO ") + 1)] == ["10"]
    assert offered("    GOTO |") == []  # the labels of another program are none of ours


def test_outside_of_programs_only_headings() -> None:
    found = Document("\n.pr", PUMA).completions(2, 4)
    assert [(one.text, one.length) for one in found] == [(".PROGRAM", 3)]


@pytest.mark.parametrize(
    ("line", "word", "expected"),
    [
        (8, "MOVE", "MOVE location [AT t | IN dt]"),
        (8, "start", "line 3"),
        (6, "GOTO", "label"),
        (6, "count", "count = 0"),
        (1, "main", "the whole day"),
    ],
)
def test_hover(line: int, word: str, expected: str) -> None:
    found = DOCUMENT.hover(line, column(line, word))
    assert found is not None
    assert expected in found.text
    assert LINES[line - 1][found.span.column - 1 : found.span.end - 1] == word


def test_no_hover_in_texts_and_comments() -> None:
    assert DOCUMENT.hover(4, column(4, "GOTO")) is None
    assert DOCUMENT.hover(4, len(LINES[3]) - 1) is None
    assert DOCUMENT.hover(400, 1) is None


def test_formatting_keeps_what_it_cannot_read() -> None:
    assert Document(".program p\nmove a\n.end\n", PUMA).formatted() == ".PROGRAM p()\n    MOVE a\n.END\n"
    assert Document(".PROGRAM p\nMOVEE a\n.END\n", PUMA).formatted() is None


def test_diagnostics_are_those_of_check() -> None:
    assert [(one.code, one.span.line) for one in DOCUMENT.diagnostics] == [(57, 8)]
