"""How a diagnostic is shown."""

from __future__ import annotations

from vrs_cli.errors import IllegalExpression, UnknownInstruction, did_you_mean
from vrs_cli.values.diagnostics import MAX_LINE_CHARS, LineRefused, Span, error, show, warning


def test_message() -> None:
    assert error(UnknownInstruction, Span(1, 1, 6), "MOVEE", "did you mean MOVE?").message == (
        "*Unknown instruction* MOVEE (did you mean MOVE?)"
    )
    assert error(UnknownInstruction, Span(1, 1, 6)).message == "*Unknown instruction*"
    assert error(UnknownInstruction, Span(1, 1, 6)).code == -452


def test_shown_with_its_line() -> None:
    found = error(UnknownInstruction, Span(12, 5, 10), "MOVEE")
    assert show(found, "    MOVEE a", "cell.v2") == (
        "cell.v2:12:5: V452 *Unknown instruction* MOVEE\n    MOVEE a\n    ^^^^^"
    )
    assert show(found, "    MOVEE a").startswith("*Unknown")
    assert show(found, "") == "*Unknown instruction* MOVEE"


def test_a_warning_says_so() -> None:
    assert show(warning(IllegalExpression, Span(1, 1, 2), "x"), "x", "a").startswith("a:1:1: V458 warning: *Illegal")


def test_the_pointer_follows_tabs_and_stays_in_the_line() -> None:
    assert show(error(UnknownInstruction, Span(1, 3, 4)), "\t\tx y").endswith("\n\t\tx y\n\t\t^")
    assert show(error(UnknownInstruction, Span(1, 6, 7)), "MOVE ").endswith("\nMOVE\n     ^")
    assert show(error(UnknownInstruction, Span(1, 1, 90)), "MOVE").endswith("\nMOVE\n^^^^")


def test_nothing_moves_the_cursor() -> None:
    assert "\x1b" not in show(error(UnknownInstruction, Span(1, 1, 2)), "a\x1b[2Jb")


def test_a_refused_line_is_its_diagnostic() -> None:
    found = error(UnknownInstruction, Span(1, 1, 2), "X")
    assert str(LineRefused(found)) == found.message


def test_near_words() -> None:
    assert did_you_mean("movs", ["MOVE", "MOVES", "STOP"]) == "did you mean MOVES?"
    assert did_you_mean("xyzzy", ["MOVE"]) == ""
    assert did_you_mean("Part.1", ["part.2"]) == "did you mean part.2?"


def test_of_a_long_line_the_place_is_shown() -> None:
    text = "x = " + "1+" * 5000 + "@" + "+1" * 5000
    _, line, pointer = show(error(UnknownInstruction, Span(1, 10005, 10006)), text).split("\n")
    assert max(len(line), len(pointer)) < 200
    assert line.startswith("...")
    assert line.endswith("...")
    assert line[pointer.index("^")] == "@"
    assert pointer.count("^") == 1


def test_a_long_line_is_shown_from_its_beginning_where_the_mistake_is_there() -> None:
    _, line, pointer = show(error(UnknownInstruction, Span(1, 1, 9000)), "y" * 9000).split("\n")
    assert line.startswith("yyy")
    assert len(pointer) <= len(line) < 200


def test_a_long_word_is_shortened_in_the_message() -> None:
    message = error(UnknownInstruction, Span(1, 1, 2), "9" * 100_000, "too long").message
    assert len(message) < 500
    assert message.endswith("... (too long)")


def test_dots_stand_where_a_long_line_is_cut() -> None:
    line = "x" * MAX_LINE_CHARS + "y" * MAX_LINE_CHARS
    for column, first, last in ((1, "x", "..."), (MAX_LINE_CHARS, "...", "..."), (2 * MAX_LINE_CHARS, "...", "y")):
        _, stretch, pointer = show(error(UnknownInstruction, Span(1, column, column + 1)), line).splitlines()
        assert stretch.startswith(first)
        assert stretch.endswith(last)
        assert stretch.strip(".")[0:MAX_LINE_CHARS] in line
        assert stretch[len(pointer) - 1] == line[column - 1]
