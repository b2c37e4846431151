"""Names that a reader could take for something else: a variable that is called as a function or an instruction is.

One warning a name. A function that needs arguments is no such case: `dx` and `DX(part)` are told apart at a glance.
"""

from __future__ import annotations

from collections.abc import Iterator

from vrs_cli.errors import PauseOfArm, WordAsName
from vrs_cli.language.analysis.names import NameFindings
from vrs_cli.language.analysis.surroundings import Surroundings
from vrs_cli.language.text import ast
from vrs_cli.language.text.ast import Program, Statement
from vrs_cli.language.text.meaning import FUNCTION_NAMES
from vrs_cli.language.words.instructions import INSTRUCTIONS
from vrs_cli.language.words.monitor import COMMANDS
from vrs_cli.language.words.word import Route, State
from vrs_cli.values.diagnostics import Diagnostic, warning


def confusions(program: Program, names: NameFindings, surroundings: Surroundings) -> Iterator[Diagnostic]:
    """Yield the confusions of a program whose names are all known."""
    keys = FUNCTION_NAMES.keys() & {*names.given, *names.first_read, *names.declared, *names.parameters}
    for node in ast.nodes((program.parameters, program.steps)) if keys else ():
        if isinstance(node, ast.Variable) and node.key in keys:
            keys.discard(node.key)
            detail = f"{node.sigil}{node.name.lower()} is a variable in this program"
            yield _warning(node, detail, f"{FUNCTION_NAMES[node.key]}() is the function")
    for key, call in names.functions.items():
        if surroundings.given_elsewhere(key, program):
            detail = f"{call.name} is the function here, and a variable in another program"
            yield _warning(call, detail, f"GLOBAL {key} makes it the variable")
    for key, target in names.assigned.items():
        row = INSTRUCTIONS.get(target.name.upper())
        met = any(key in of for of in (names.first_read, names.declared, names.parameters, names.passed))
        if row is not None and not met and row.arguments and row.state is State.SUPPORTED:
            detail = f"{target.name.lower()} is a variable here, and nothing reads it"
            yield _warning(target, detail, f"the form of the instruction is {row.form}")


def first_assignment(target: ast.Variable) -> Iterator[Diagnostic]:
    """Warn of a variable that gets its first value at the prompt and has the name of a function or an instruction."""
    name, word = target.sigil + target.name.lower(), target.name.upper()
    row = COMMANDS.get(word) or INSTRUCTIONS.get(word)
    if target.key in FUNCTION_NAMES:
        yield _warning(target, f"{name} is a variable from now on", f"{FUNCTION_NAMES[target.key]}() is the function")
    elif row is not None and not target.sigil and target.indexes is None and row.required:
        yield _warning(target, f"{name} is a variable from now on", f"the form of the command is {row.form}")


def _warning(node: ast.Variable | ast.Call, detail: str, hint: str) -> Diagnostic:
    return warning(WordAsName, node.span, detail, hint)


# --- DELAY, which holds the arm ------------------------------------------------------------------------------


_TYPES = frozenset({"TYPE", "TYPEI", "PROMPT"})
_CLOCKS = frozenset({"TIME", "TIMER", "$TIME"})
_WAITS = frozenset({"WAIT", "WAIT.EVENT", "CALL", "CALLS", "PAUSE", "RETURN", "STOP", "HALT"})  # or nobody can tell


def delays(program: Program) -> Iterator[Diagnostic]:
    """Warn of the first such DELAY of a program."""
    statements = program.statements
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
