"""Wrong lines and programs, each with the code and column of every diagnostic (the .v2err files beside this one)."""

from __future__ import annotations

import re
from collections import defaultdict
from pathlib import Path

from vrs_cli.language.analysis.analyzer import analyze, check_line
from vrs_cli.language.text import ast
from vrs_cli.language.text.parser import parse_file, parse_prompt, parse_step
from vrs_cli.values.diagnostics import Diagnostic, LineRefused, show

HERE = Path(__file__).parent
MARK = re.compile(r" ;! (fine|-?\d+ \d+(?:, -?\d+ \d+)*)$")

Found = list[tuple[int, int]]  # codes and columns


def expected(mark: str) -> Found:
    if mark == "fine":
        return []
    return [(int(code), int(column)) for code, column in (one.split() for one in mark.split(", "))]


def marked_lines() -> list[tuple[str, str]]:
    lines = (HERE / "lines.v2err").read_text(encoding="utf-8").splitlines()
    return [(MARK.sub("", line), match[1]) for line in lines if (match := MARK.search(line))]


def diagnose(line: str) -> tuple[Diagnostic, ...]:
    at_prompt = line.startswith("> ")
    try:
        parsed = parse_prompt(line[2:]) if at_prompt else parse_step(line).statement
    except LineRefused as refused:
        return (refused.diagnostic,)
    return check_line(parsed, in_program=not at_prompt) if parsed is not None else ()


def test_lines() -> None:
    found = {line: [(one.code, one.span.column) for one in diagnose(line)] for line, _ in marked_lines()}
    assert found == {line: expected(mark) for line, mark in marked_lines()}


def test_what_is_shown_of_a_line() -> None:
    for typed, diagnostic in [(line, one) for line, _ in marked_lines() for one in diagnose(line)]:
        text = typed.removeprefix("> ")
        assert 1 <= diagnostic.span.column < diagnostic.span.end <= len(text) + 2
        assert diagnostic.detail, "a message says what is wrong"
        message, source, pointer = show(diagnostic, text, "cell.v2").split("\n")
        assert message.startswith("cell.v2:1:")
        assert source == text.rstrip()
        assert pointer.index("^") == diagnostic.span.column - 1


def test_there_are_enough_lines() -> None:
    assert sum(mark != "fine" for _, mark in marked_lines()) >= 500


def test_programs() -> None:
    text = (HERE / "programs.v2err").read_text(encoding="utf-8")
    lines = text.splitlines()
    wanted = {number: expected(match[1]) for number, line in enumerate(lines, 1) if (match := MARK.search(line))}
    file, diagnostics = parse_file("\n".join(MARK.sub("", line) for line in lines))
    programs = {part.key: part for part in file.parts if isinstance(part, ast.Program)}
    everything = [*diagnostics]
    for program in programs.values():
        everything += analyze(program, {}, programs).diagnostics
    found: dict[int, Found] = defaultdict(list)
    for diagnostic in everything:
        if not diagnostic.detail.endswith("has no .END"):
            found[diagnostic.span.line].append((diagnostic.code, diagnostic.span.column))
    assert {number: sorted(one, key=lambda pair: pair[1]) for number, one in found.items()} == wanted
    assert sum(one.detail.endswith("has no .END") for one in everything) == 1
