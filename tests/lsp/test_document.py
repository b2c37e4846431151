from __future__ import annotations

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.examples import examples
from tests.interfaces.terminals import RecordingTerminal
from tests.laws.test_name_laws import WORDS
from vrs_cli.errors import UsageError, VrsError
from vrs_cli.interfaces.inspection import Inspector
from vrs_cli.interfaces.session.session import Session
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.language.text.ast import FUNCTION_NAMES
from vrs_cli.language.words.instructions import RESERVED
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
    """Return where go to definition on a word leads, as `line:word`."""
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
    """Return the suggestions at the `|` of a line in the program count."""
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
    assert expected in found[0]
    assert LINES[line - 1][found[1].column - 1 : found[1].end - 1] == word


def test_no_hover_in_texts_and_comments() -> None:
    assert DOCUMENT.hover(4, column(4, "GOTO")) is None
    assert DOCUMENT.hover(4, len(LINES[3]) - 1) is None
    assert DOCUMENT.hover(400, 1) is None


def test_formatting_keeps_what_it_cannot_read() -> None:
    assert Document(".program p\nmove a\n.end\n", PUMA).canonical() == ".PROGRAM p()\n    MOVE a\n.END\n"
    assert Document(".PROGRAM p\nMOVEE a\n.END\n", PUMA).canonical() is None
    assert Document(".PROGRAM p\nIF TRUE THEN\n.END\n", PUMA).canonical() is None


def test_diagnostics_are_those_of_check() -> None:
    assert [(one.code, one.span.line) for one in DOCUMENT.diagnostics] == [(57, 8)]


# --- names everywhere ----------------------------------------------------------------------------------------------

CELL = """\
; a cell
.PROGRAM main
10  n = 1 ; n
    CALL pick(part, n)
    TYPE "n", n, (n), row[n], N
    IF n > 2 THEN
        MOVE part:row[n]
    ELSE

        GOTO 10
    END
    GOTO 10
.END
.PROGRAM pick(a, n)
10  n = n+1
    MOVE a
    GOTO 10
.END
.LOCATIONS
part 400 150 200 90 -90 0
row[1] 400 150 200 90 -90 0
.END
"""
CELL_LINES = CELL.split("\n")


def places(line: int, word: str, nth: int = 1) -> list[str]:
    """Return the references of a word as `line:column`."""
    at = -1
    for _ in range(nth):
        at = CELL_LINES[line - 1].index(word, at + 1)
    return [f"{one.line}:{one.column}" for one in Document(CELL, PUMA).references(line, at + 1)]


@pytest.mark.parametrize(
    ("line", "word", "nth", "expected"),
    [
        (3, "n", 1, ["3:5", "4:21", "5:15", "5:19", "5:27", "5:31", "6:8", "7:23"]),
        (15, "n", 2, ["14:18", "15:5", "15:9"]),  # a parameter is its program's own
        (3, "10", 1, ["3:1", "10:14", "12:10"]),
        (17, "10", 1, ["15:1", "17:10"]),
        (4, "pick", 1, ["4:10", "14:10"]),
        (20, "part", 1, ["4:15", "7:14", "20:1"]),
        (7, "row", 1, ["5:23", "7:19", "21:1"]),
        (3, "n", 2, []),  # in a comment
        (6, "IF", 1, []),
    ],
)
def test_references(line: int, word: str, nth: int, expected: list[str]) -> None:
    assert places(line, word, nth) == expected


def rename(line: int, word: str, new: str) -> str:
    """Return the whole text after a rename."""
    name, spans = Document(CELL, PUMA).rename(line, CELL_LINES[line - 1].index(word) + 1, new)
    lines = list(CELL_LINES)
    for span in sorted(spans, key=lambda one: -one.column):
        text = lines[span.line - 1]
        lines[span.line - 1] = text[: span.column - 1] + name + text[span.end - 1 :]
    return "\n".join(lines)


@pytest.mark.parametrize(
    ("line", "word", "new"), [(3, "n", "count"), (14, "n", "count"), (3, "10", "200"), (14, "pick", "fetch")]
)
def test_a_rename_changes_what_a_program_is_called_and_nothing_that_it_does(line: int, word: str, new: str) -> None:
    text = rename(line, word, new)
    assert new in text
    assert [(one.code, one.span.line) for one in Document(text, PUMA).diagnostics] == [
        (one.code, one.span.line) for one in Document(CELL, PUMA).diagnostics
    ]
    position = CELL_LINES[line - 1].index(word) + 1
    count = len(Document(CELL, PUMA).references(line, position))
    assert len(Document(text, PUMA).references(line, position)) == count


@pytest.mark.parametrize(
    ("line", "word", "new", "told"),
    [
        (3, "n", "part", "there already"),
        (3, "n", "to", "TO is a word of the language"),
        (3, "n", "2nd", "a letter, then"),
        (3, "n", "abcdefghijklmnop", "at most 15"),
        (3, "10", "x", "a label is a number"),
        (3, "10", "70000", "a label is a number"),
        (14, "pick", "main", "there already"),
        (6, "IF", "x", "nothing to rename"),
    ],
)
def test_a_rename_that_cannot_be(line: int, word: str, new: str, told: str) -> None:
    with pytest.raises(VrsError, match=told):
        rename(line, word, new)


def test_folds() -> None:
    assert Document(CELL, PUMA).folds == ((2, 12), (6, 7), (8, 10), (14, 17), (19, 21))


def test_a_case_folds_as_a_whole_and_by_its_values() -> None:
    lines = [
        ".PROGRAM p",
        "CASE n OF",
        "VALUE 1:",
        "x = 1",
        "VALUE 2:",
        "x = 2",
        "ANY",
        "x = 3",
        "END",
        "y = 1",
        ".END",
    ]
    assert Document("\n".join(lines), PUMA).folds == ((1, 10), (2, 8), (3, 4), (5, 6), (7, 8))
    empty = [".PROGRAM p", "CASE n OF", "END", "y = 1", ".END"]
    assert Document("\n".join(empty), PUMA).folds == ((1, 4),)


@pytest.mark.parametrize(
    ("typed", "form", "active"),
    [
        ("    APPRO ", "APPRO location, distance", 0),
        ("10  APPRO part, ", "APPRO location, distance", 1),
        ("    MOVE SHIFT(part BY 1, ", "SHIFT(location", 2),
        ("    CALL pick(part, ", "pick(a, n)", 1),
        ("    x = ATAN2(SIN(1), ", "ATAN2(", 1),
        ("    x = ATAN2(SIN(", "SIN(", 0),
        ('    TYPE "a, b", ', "TYPE", 0),
    ],
)
def test_signatures(typed: str, form: str, active: int) -> None:
    lines = [*CELL_LINES[:2], typed, *CELL_LINES[3:]]
    found = Document("\n".join(lines), PUMA).signature(3, len(typed) + 1)
    assert found is not None
    assert found.form.startswith(form)
    assert found.active == active
    assert all(found.form[begin:end] for begin, end in found.arguments)


def test_no_signature_where_nothing_is_called() -> None:
    assert Document(CELL, PUMA).signature(3, 6) is None
    assert Document(CELL, PUMA).signature(1, 2) is None


# --- one version after the other -----------------------------------------------------------------------------------

LINES_TO_TYPE = st.sampled_from(
    [
        *TEXT.splitlines(),
        *CELL_LINES,
        "",
        "MOVEE part",
        "CALL pick(1, 2, 3)",
        "CALL nowhere",
        "IF n THEN",
        "TOOL part",
        ".PROGRAM pick",
        ".PROGRAM 5",
        ".REALS",
        "x 5",
        "x = y",
        "MOVE far",
        "far 9000 0 0 0 0 0",
        "STOP",
        "\x01",
    ]
)
CHANGES = st.lists(st.tuples(st.integers(0, 40), st.booleans(), LINES_TO_TYPE), max_size=8)


@examples(60)
@given(CHANGES)
def test_law_what_is_known_of_the_version_before_changes_no_finding(changes: list[tuple[int, bool, str]]) -> None:
    lines = CELL.splitlines()
    inspector = Inspector(PUMA)
    for at, insert, text in changes:
        lines[at : at + (not insert)] = [text]
        version = "\n".join(lines)
        found = Document(version, PUMA, inspector).diagnostics
        assert found == Document(version, PUMA).diagnostics
        session = Session(RecordingTerminal(), PUMA)
        assert set(session.load_text(version)) <= set(found)


# --- words as names ------------------------------------------------------------------------------------------------

NAMED = """\
.PROGRAM main(a, $zz)
    zz = LEN($zz)
    zz[1] = zz
    FOR i = zz TO 5 STEP zz
        TYPE zz, (zz), HERE()
    END
    #zz = a
    CALL zz(zz)
    STOP
.END
.PROGRAM zz(x)
    GLOBAL zz
    x = zz
.END
.REALS
zz 5
.END
"""


def named(word: str) -> str:
    """Return the text with a word as its variable, but not as its program, string or precision point."""
    return re.sub(r"(?<![$#])\bzz\b(?!\()", word, NAMED)


@pytest.mark.parametrize("word", [*FUNCTION_NAMES, *(word.lower() for word in WORDS[::9] if word not in RESERVED)])
def test_any_word_can_be_the_new_name_of_a_variable_and_the_old_one(word: str) -> None:
    if word[0] in "#$":
        return
    assert after_rename(NAMED, "zz", word) == named(word)
    assert after_rename(named(word), word, "zz") == NAMED
    assert {one.text for one in Document(named(word), PUMA).completions(4, 13)} >= {word}


def after_rename(text: str, old: str, new: str) -> str:
    lines = text.split("\n")
    name, spans = Document(text, PUMA).rename(2, lines[1].index(old) + 1, new)
    for span in sorted(spans, key=lambda one: -one.column):
        line = lines[span.line - 1]
        lines[span.line - 1] = line[: span.column - 1] + name + line[span.end - 1 :]
    return "\n".join(lines)


def test_a_rename_that_would_take_a_function_for_the_variable() -> None:
    text = ".PROGRAM a()\n    x = 1\n    TYPE x, HAND\n.END\n.PROGRAM b()\n    TYPE x\n.END\n"
    with pytest.raises(UsageError, match="the function in some places"):
        Document(text, PUMA).rename(2, 5, "hand")
    assert after_rename(text, "x", "stop").count("stop") == 3


def test_hover_tells_an_instruction_from_a_variable_of_its_name() -> None:
    document = Document(".PROGRAM a()\n    stop = 1\n    STOP\n    TYPE stop\n.END\n", PUMA)
    texts = [document.hover(line, 6 + 5 * (line == 4)) for line in (2, 3, 4)]
    assert ["first given a value" in one[0] for one in texts if one is not None] == [True, False, True]
