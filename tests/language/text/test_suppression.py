"""Test comments that suppress the warnings of their line or of the whole file."""

from __future__ import annotations

from collections.abc import Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrs_cli.language.text.parser import drop_suppressed
from vrs_cli.values.diagnostics import Diagnostic, Severity, Span

LINES = 6
CODES = st.lists(st.sampled_from([56, 401, 452]), min_size=1, max_size=2, unique=True)


def found(line: int, code: int, severity: Severity = Severity.WARNING) -> Diagnostic:
    return Diagnostic(severity, code, "text", "detail", "", Span(line, 1, 2))


EVERYTHING = [found(line, code) for line in range(1, LINES + 1) for code in (56, 401)]


def commented(line: int, word: str, codes: Sequence[int] = ()) -> list[str]:
    """Return a file with one comment at the end of a line, counted from 1."""
    lines = ["MOVE a"] * LINES
    lines[line - 1] += f" ; vrs: {word} " + ", ".join(f"V{code:03d}" for code in codes)
    return lines


@given(st.integers(1, LINES), CODES)
def test_a_comment_for_the_file_stands_on_any_line(line: int, codes: list[int]) -> None:
    left = drop_suppressed(commented(line, "ignore-file", codes), EVERYTHING)
    assert list(left) == [one for one in EVERYTHING if one.code not in codes]


@given(st.integers(1, LINES), CODES)
def test_a_comment_for_a_line_counts_there_alone(line: int, codes: list[int]) -> None:
    left = drop_suppressed(commented(line, "ignore", codes), EVERYTHING)
    assert list(left) == [one for one in EVERYTHING if one.code not in codes or one.span.line != line]


@pytest.mark.parametrize(("word", "left"), [("ignore-file", 0), ("ignore", len(EVERYTHING) - 2), ("keep", None)])
def test_without_codes_all_are_meant(word: str, left: int | None) -> None:
    assert len(drop_suppressed(commented(2, word), EVERYTHING)) == (len(EVERYTHING) if left is None else left)


def test_errors_stay() -> None:
    errors = [found(line, 401, Severity.ERROR) for line in range(1, LINES + 1)]
    assert list(drop_suppressed(commented(1, "ignore-file"), errors)) == errors
