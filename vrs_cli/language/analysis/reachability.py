"""Which steps of a program nothing leads to: what stands after GOTO, RETURN, STOP, HALT and has no label."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from msgspec import Struct

from vrs_cli.errors import UnreachableCode
from vrs_cli.language.analysis.structure import Block, BlockKind, label_of
from vrs_cli.language.text import ast
from vrs_cli.language.text.ast import Program, Statement
from vrs_cli.language.text.diagnostics import Diagnostic, warning

LEAVING = frozenset({"RETURN", "STOP", "HALT", "RETURNE"})  # instructions that the next step never follows
LOOP_WORDS = frozenset({"EXIT", "NEXT"})  # they may lead to the end of any loop round them


def unreachable(program: Program, blocks: Sequence[Block], labels: Mapping[int, int]) -> tuple[Diagnostic, ...]:
    """A warning at the first step of each run that cannot be carried out, naming what ends the way to it.

    Conditions are not looked into: WHILE TRUE can end. The blocks and labels must fit (no errors).
    """
    reached = _reached(_Flow(program, blocks, labels))
    found: list[Diagnostic] = []
    before_reached = True
    for index, step in enumerate(program.steps):
        if step.statement is None or isinstance(step.statement, _CLOSERS):
            continue
        if index not in reached and before_reached:
            found.append(
                warning(
                    UnreachableCode, step.statement.span, _why(program, index), "a label before it would lead to it"
                )
            )
        before_reached = index in reached
    return tuple(found)


_CLOSERS = (ast.End, ast.Until, ast.Else, ast.Any, ast.Value)


def _why(program: Program, index: int) -> str:
    """Return the step before, which never goes on."""
    for before in range(index - 1, -1, -1):
        statement = program.steps[before].statement
        if _leaves(statement):
            word = statement.word if isinstance(statement, ast.Instruction) else "GOTO"
            return f"this is never carried out, after {word} at step {before + 1}"
    return "this is never carried out"


def _leaves(statement: Statement | None) -> bool:
    if isinstance(statement, ast.Goto):
        return True
    return isinstance(statement, ast.Instruction) and statement.word in LEAVING


class _Flow(Struct, frozen=True):
    """A program as steps and the steps that may come next."""

    program: Program
    blocks: Sequence[Block]
    labels: Mapping[int, int]

    def jumps(self) -> dict[int, tuple[int, ...]]:
        """For the steps of blocks: where they may go, beside or instead of the next step."""
        found: dict[int, tuple[int, ...]] = {}
        for block in self.blocks:
            found |= _JUMPS[block.kind](block)
        return found


def _if(block: Block) -> dict[int, tuple[int, ...]]:
    otherwise = block.middles[0] + 1 if block.middles else block.closer + 1
    return {block.opener: (block.opener + 1, otherwise)} | dict.fromkeys(block.middles, (block.closer + 1,))


def _loop(block: Block) -> dict[int, tuple[int, ...]]:
    return {
        block.opener: (block.opener + 1, block.closer + 1),
        block.closer: (block.opener, block.closer + 1),
    }


def _do(block: Block) -> dict[int, tuple[int, ...]]:
    return {block.closer: (block.opener, block.closer + 1)}


def _case(block: Block) -> dict[int, tuple[int, ...]]:
    """CASE goes to any VALUE. A VALUE that is reached from above ends the steps of the one before."""
    inside = tuple(middle + 1 for middle in block.middles)
    return {block.opener: (*inside, block.closer + 1)} | dict.fromkeys(block.middles, (block.closer + 1,))


_JUMPS = {BlockKind.IF: _if, BlockKind.WHILE: _loop, BlockKind.FOR: _loop, BlockKind.DO: _do, BlockKind.CASE: _case}


def _reached(flow: _Flow) -> set[int]:
    """Return the indexes of all steps that can be reached from the first one."""
    jumps, count = flow.jumps(), len(flow.program.steps)
    reached: set[int] = set()
    waiting = [0]
    while waiting:
        index = waiting.pop()
        if index < count and index not in reached:
            reached.add(index)
            waiting += _next(flow, jumps, index)
    return reached


def _next(flow: _Flow, jumps: Mapping[int, tuple[int, ...]], index: int) -> Iterator[int]:
    statement = flow.program.steps[index].statement
    label = None if statement is None else label_of(statement)
    if label is not None:
        yield flow.labels[label]
    if index in jumps:
        yield from jumps[index]
    elif not _leaves(statement):
        yield index + 1
    if isinstance(statement, ast.Instruction) and statement.word in LOOP_WORDS:
        yield from (block.closer + 1 for block in flow.blocks if block.opener < index < block.closer)
