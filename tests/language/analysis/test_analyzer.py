"""Test the analyzer: kinds of names, and findings that need a whole program or the prompt. Wrong lines:
tests/errors.
"""

from __future__ import annotations

import gc
from time import process_time

import pytest

from vrs_cli.language.analysis.analyzer import analyze, check_line
from vrs_cli.language.analysis.names import Analysis
from vrs_cli.language.text import ast
from vrs_cli.language.text.ast import Program
from vrs_cli.language.text.parser import parse_file, parse_prompt, parse_step
from vrs_cli.language.words.instructions import INSTRUCTIONS
from vrs_cli.language.words.values import Kind
from vrs_cli.values.diagnostics import LineRefused, Severity


def programs_of(text: str) -> dict[str, Program]:
    file, _ = parse_file(text)
    return {part.key: part for part in file.parts if isinstance(part, Program)}


def analysed(steps: str, parameters: str = "", known: dict[str, Kind] | None = None) -> Analysis:
    return analyze(programs_of(f".PROGRAM p({parameters})\n{steps}\n.END\n")["p"], known)


def test_uses_decide_kinds() -> None:
    found = analysed(
        "MOVE a:b\nx = y*2\nSET c = d\nFOR i = 1 TO n\nEND\nDECOMPOSE e[1] = f\nTYPE g, DX(h)\nCALL q(k, (l), m[0])\n"
        "PROMPT o\nIF r == s THEN\nEND\n$s = $t+$u",
        "y, z",
    )
    reals = {key for key, kind in found.kinds.items() if kind is Kind.REAL}
    locations = {key for key, kind in found.kinds.items() if kind is Kind.LOCATION}
    assert reals == {"x", "y", "i", "n", "e", "o", "r", "s"}
    assert locations == {"a", "b", "c", "d", "f", "h"}
    assert not {"z", "g", "k", "l", "m", "$s"} & found.kinds.keys()


def test_a_reading_that_may_be_either_decides_nothing() -> None:
    found = analysed("TYPE a\nMOVE a\nTYPE a")
    assert found.kinds == {"a": Kind.LOCATION}
    assert found.executable


def test_names_count_fifteen_characters_and_no_case() -> None:
    found = analysed("The.Longest.Name = 1\nx = the.longest.name + 1")
    assert set(found.kinds) == {"the.longest.nam", "x"}
    assert found.diagnostics == ()


def test_a_program_runs_though_a_value_is_of_the_other_kind_now() -> None:
    found = analysed("a = 5", known={"a": Kind.LOCATION})
    assert found.executable
    assert [one.severity for one in found.diagnostics] == [Severity.WARNING]
    assert found.kinds == {"a": Kind.REAL}
    assert analysed("a = 5", "a", known={"a": Kind.LOCATION}).diagnostics == ()


def test_at_the_prompt_values_decide() -> None:
    line = parse_prompt("a = b")
    assert isinstance(line, ast.DoInstruction)
    assert check_line(line) == ()
    known = {"a": Kind.LOCATION, "b": Kind.LOCATION}
    assert [one.code for one in check_line(line, known)] == [-403]
    assert [one.code for one in check_line(line, {"b": Kind.LOCATION})] == [-403]
    assert [one.code for one in check_line(line, {"a": Kind.LOCATION})] == [-465]


def test_warnings_of_values_know_what_other_programs_give() -> None:
    programs = programs_of(
        ".PROGRAM p()\nx = a+b+c+d+e[1]+tyme+f\nMOVE there\nCALL q(f)\n.END\n"
        ".PROGRAM q(x)\na = 1\nHERE there\nFOR b = 1 TO 2\nEND\n"
        "DECOMPOSE e[1] = HERE\nPROMPT c\nCALL r(d)\ntime.left = 1\n.END\n"
    )
    found = analyze(programs["p"], {"tym": Kind.REAL}, programs)
    messages = [one.message for one in found.diagnostics]
    assert messages == ["*Undefined value* tyme is given a value nowhere (did you mean tym?)"]
    assert found.executable


def test_bad_lines_keep_a_program_from_running() -> None:
    found = analysed("MOVEE x")
    assert found.diagnostics == ()
    assert not found.executable


@pytest.mark.parametrize(
    "line",
    [
        "clear = 1",
        "plot = at+in",
        "MOVE at AT in",
        "draw = go",
        "$move = $to",
        "MOVE #to",
        "dx = stop",
        "delay[2] = len",
    ],
)
def test_words_that_are_names_in_their_place(line: str) -> None:
    statement = parse_step(line).statement
    assert statement is not None
    assert check_line(statement, in_program=True) == ()


def test_the_time_grows_with_the_lines_and_not_with_their_square() -> None:
    assert any(cost_of(60) < 8.0 * cost_of(15) for _ in range(5)), "four times as many; the machine may be busy once"


def cost_of(count: int) -> float:
    """Return the cost of so many programs of 100 lines [s of CPU]."""
    part = "".join(f"x{n} = unknown{n}+SQRT(x{n}**2)\nMOVE a[{n}]\n" for n in range(50))
    programs = programs_of("".join(f".PROGRAM p{n}()\n{part}.END\n" for n in range(count)))
    began = process_time()
    for program in programs.values():
        analyze(program, {}, programs)
    return process_time() - began


def test_an_analysis_leaves_no_cycle_that_keeps_its_program() -> None:
    gc.collect()
    gc.disable()
    try:
        file, _ = parse_file(".PROGRAM p\nAUTO a\nx = a\n.END\n", remembered=False)
        (program,) = file.parts
        assert isinstance(program, Program)
        analyze(program)
        del file, program
        gc.set_debug(gc.DEBUG_SAVEALL)
        gc.collect()
        assert not any(isinstance(one, Program) for one in gc.garbage)
    finally:
        gc.set_debug(0)
        gc.garbage.clear()
        gc.enable()


@pytest.mark.parametrize("word", sorted(INSTRUCTIONS))
def test_a_bare_word_is_a_line_or_a_mistake(word: str) -> None:
    """A word without its required arguments is reported."""
    try:
        statement = parse_prompt(word, ())
    except LineRefused:
        return
    if statement is not None and not isinstance(statement, ast.ProgramHeader):
        check_line(statement, {})
