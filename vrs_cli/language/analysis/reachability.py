"""Which steps of a program nothing leads to: what stands after GOTO, RETURN, STOP, HALT and has no label."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from vrs_cli.errors import UnreachableCode
from vrs_cli.language.analysis.structure import Block, BlockKind, label_of
from vrs_cli.language.text import ast
from vrs_cli.language.text.ast import Program, Statement
from vrs_cli.language.text.diagnostics import Diagnostic, warning
from vrs_cli.language.words.instructions import LOOP_JUMPS

LEAVING = frozenset({"RETURN", "STOP", "HALT", "RETURNE"})  # instructions that the next step never follows
_CLOSERS = (ast.End, ast.Until, ast.Else, ast.Any, ast.Value)


def unreachable(program: Program, blocks: Sequence[Block], labels: Mapping[int, int]) -> Iterator[Diagnostic]:
    """A warning at the first step of each run that cannot be carried out, naming what ends the way to it.

    Conditions are not looked into: WHILE TRUE can end. The blocks and labels must fit (no errors).
    """
    reached = _reached(program, blocks, labels)
    leaving, before_reached = "", True
    for index, step in enumerate(program.steps):
        if step.statement is not None and not isinstance(step.statement, _CLOSERS):
            if index not in reached and before_reached:
                detail = f"this is never carried out{leaving}"
                yield warning(UnreachableCode, step.statement.span, detail, "a label before it would lead to it")
            before_reached = index in reached
        if _leaves(step.statement):
            word = step.statement.word if isinstance(step.statement, ast.Instruction) else "GOTO"
            leaving = f", after {word} at step {index + 1}"


def _leaves(statement: Statement | None) -> bool:
    """Whether the next step never follows."""
    return isinstance(statement, ast.Goto) or (isinstance(statement, ast.Instruction) and statement.word in LEAVING)


def _reached(program: Program, blocks: Sequence[Block], labels: Mapping[int, int]) -> set[int]:
    """The indexes of all steps that can be reached from the first one."""
    jumps = {index: targets for block in blocks for index, targets in _jumps(block).items()}
    reached: set[int] = set()
    waiting = [0]
    while waiting:
        index = waiting.pop()
        if index >= len(program.steps) or index in reached:
            continue
        reached.add(index)
        statement = program.steps[index].statement
        label = None if statement is None else label_of(statement)
        if label is not None:
            waiting.append(labels[label])
        waiting += jumps.get(index, () if _leaves(statement) else (index + 1,))
        if isinstance(statement, ast.Instruction) and statement.word in LOOP_JUMPS:  # to the end of any loop round it
            waiting += (block.closer + 1 for block in blocks if block.opener < index < block.closer)
    return reached


def _jumps(block: Block) -> dict[int, tuple[int, ...]]:
    """For the steps of a block: where they may go, beside or instead of the next step.

    CASE goes to any VALUE. A VALUE or an ELSE that is reached from above ends the steps of the one before.
    """
    after, inside = block.closer + 1, [middle + 1 for middle in block.middles]
    if block.kind is BlockKind.IF:
        return {block.opener: (block.opener + 1, *(inside or [after])), **dict.fromkeys(block.middles, (after,))}
    if block.kind is BlockKind.CASE:
        return {block.opener: (*inside, after), **dict.fromkeys(block.middles, (after,))}
    again: dict[int, tuple[int, ...]] = {block.closer: (block.opener, after)}
    return again if block.kind is BlockKind.DO else {block.opener: (block.opener + 1, after), **again}
