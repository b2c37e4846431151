"""DELAY where a reader would take it for a pause of the program: it holds the arm, and the program goes on.

That shows where a step after it types or reads the time, before the arm moves or the program waits.
"""

from __future__ import annotations

from collections.abc import Iterator

from vrs_cli.errors import PauseOfArm
from vrs_cli.language.text import ast
from vrs_cli.language.text.ast import Program, Statement
from vrs_cli.language.text.diagnostics import Diagnostic, warning
from vrs_cli.language.words.instructions import INSTRUCTIONS
from vrs_cli.language.words.word import Route

_TYPES = frozenset({"TYPE", "TYPEI", "PROMPT"})
_CLOCKS = frozenset({"TIME", "TIMER", "$TIME"})
_WAITS = frozenset({"WAIT", "WAIT.EVENT", "CALL", "CALLS", "PAUSE", "RETURN", "STOP", "HALT"})  # or nobody can tell


def delays(program: Program) -> Iterator[Diagnostic]:
    """Warn of the first such DELAY of a program."""
    statements = [step.statement for step in program.steps if step.statement is not None]
    for number, statement in enumerate(statements, 1):
        if isinstance(statement, ast.Instruction) and statement.word == "DELAY":
            telling = (one for one in statements[number:] if _shows_time(one) or not _at_once(one))
            if (first := next(telling, None)) is not None and _shows_time(first):  # that no time has passed
                detail = "DELAY holds the arm, and the program goes on at once"
                yield warning(PauseOfArm, statement.span, detail, "TIMER 1 = 0 and WAIT TIMER(1) > 2 pause a program")
                return


def _shows_time(statement: Statement) -> bool:
    if isinstance(statement, ast.Instruction) and statement.word in _TYPES:
        return True
    calls = (node.name for node in ast.nodes(statement) if isinstance(node, ast.Call))
    return _at_once(statement) and not _CLOCKS.isdisjoint(calls)


def _at_once(statement: Statement) -> bool:
    """Whether a step surely neither moves the arm, nor waits, nor leads elsewhere."""
    if isinstance(statement, ast.Assignment):
        return True
    if not isinstance(statement, ast.Instruction) or statement.word in _WAITS:
        return False
    row = INSTRUCTIONS[statement.word]
    return statement.word == "DELAY" or not (row.route is Route.MOTION or row.breaks)
