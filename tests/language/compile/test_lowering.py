"""Blocks as jumps: where each step is entered, and that no jump leads out of the program."""

from __future__ import annotations

from hypothesis import given

from tests.examples import examples
from tests.language.running import environment_with, program
from tests.language.spaghetti import spaghetti
from vrs_cli.language.compile.lowering import (
    MAX_BRANCH_DEPTH,
    Branch,
    CaseBegin,
    CaseTest,
    Finish,
    Jump,
    Lowered,
    Mark,
    Perform,
    leaders_of,
    lower,
)


def lowered(*lines: str) -> Lowered:
    return lower(environment_with(program(*lines)).program("main").analysis)


@given(spaghetti())
@examples(100)
def test_every_step_has_an_entry_and_every_jump_a_target(lines: list[str]) -> None:
    result = lowered(*lines)
    assert len(result.entries) == len(lines) + 1
    assert list(result.entries) == sorted(set(result.entries))
    assert [result.ops[op].step for op in result.entries[:-1]] == list(range(len(lines)))
    assert isinstance(result.ops[-1], Finish)
    for op in result.ops:
        assert isinstance(op, Perform | Mark | Finish) or 0 <= op.target < len(result.ops)


def test_the_parts_of_a_case_end_it_when_they_are_reached_from_above() -> None:
    result = lowered("x = 1", "CASE x OF", "VALUE 1:", "x = 2", "ANY", "x = 3", "END")
    end = result.entries[6]
    begin = result.ops[result.entries[1]]
    assert isinstance(begin, CaseBegin)
    test = result.ops[begin.target]
    assert isinstance(test, CaseTest)
    assert (test.step, result.ops[test.target].step) == (2, 4)
    assert [result.ops[result.entries[step]] for step in (2, 4)] == [
        Jump(2, end, counted=False),
        Jump(4, end, counted=False),
    ]


def test_an_empty_program_is_its_end() -> None:
    assert lowered() == Lowered((Finish(0),), (0,), 0)


def test_marks_and_blank_lines_do_nothing() -> None:
    kinds = [type(op) for op in lowered("", "; only words", "DO", "UNTIL 1 == 1").ops]
    assert kinds[:3] == [Mark, Mark, Mark]


def branched(*lines: str) -> tuple[list[int], dict[int, Branch]]:
    return leaders_of(lowered(*lines).ops, ())


def test_an_if_becomes_a_branch_unless_something_jumps_into_it() -> None:
    lines = ["IF x > 0 THEN", "x = 1", "ELSE", "IF x < 0 GOTO 10", "x = 2", "10", "END", "y = 1"]
    assert branched(*lines) == ([0], {0: Branch(range(1, 2), range(3, 6)), 3: Branch(range(4, 5), range(5, 5))})
    assert branched(*lines, "GOTO 10") == ([0, 3, 5, 6], {3: Branch(range(4, 5), range(5, 5))})


def test_an_if_with_a_loop_is_no_branch() -> None:
    lines = ["IF x > 0 THEN", "WHILE y > 0 DO", "y = y-1", "END", "END"]
    assert branched(*lines) == ([0, 1, 4], {1: Branch(range(2, 4), range(4, 4))})


def test_branches_that_are_nested_too_deeply_are_blocks() -> None:
    for depth, number in ((MAX_BRANCH_DEPTH, MAX_BRANCH_DEPTH), (MAX_BRANCH_DEPTH + 1, 0)):
        leaders, branches = branched(*["IF x > 0 THEN"] * depth, *["END"] * depth)
        assert len(branches) == number
        assert len(leaders) == 1 + depth - number
