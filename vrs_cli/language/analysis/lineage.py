"""What VAL-II had not: while the switch VPLUS is off, the words and forms of V+ are refused, with the way of VAL-II.

The tables say by their column `where` which rows are of V+ alone; `IN_VAL2` says what a VAL-II programmer writes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

from vrs_cli.errors import NotAvailable
from vrs_cli.language.text import ast
from vrs_cli.language.text.ast import Program, Span, Statement
from vrs_cli.language.text.diagnostics import Diagnostic, error
from vrs_cli.language.words.functions import FUNCTIONS
from vrs_cli.language.words.instructions import INSTRUCTIONS
from vrs_cli.language.words.monitor import COMMANDS
from vrs_cli.language.words.operators import LINKS, OPERATORS
from vrs_cli.language.words.word import Word

V_PLUS = "+"  # the column of a row that V+ alone has
NOTHING_LIKE_IT = "there is nothing like it"

IN_VAL2: Mapping[str, str] = {
    # instructions
    "ACCEL": "SPEED makes a motion slower",
    "SELECT": "there is one robot",
    "EXIT": "GOTO leaves a loop",
    "NEXT": "GOTO a label before END begins the next pass",
    "CALLS": "CASE and CALL choose a program",
    "AUTO": "every variable is global",
    "LOCAL": "every variable is global",
    "GLOBAL": "every variable is global",
    "REACTE": "test before the step that can fail",
    "RETURNE": "test before the step that can fail",
    "BRAKE": "REACTI stops a motion at once",
    "EXECUTE": "PCEXECUTE starts the process control program",
    "ABORT": "PCABORT at the prompt stops the process control program",
    "KILL": "ABORT stops a program",
    "CYCLE.END": "PCEND ends the process control program",
    "PROCEED": "PCPROCEED at the prompt lets the process control program go on",
    "RETRY": "PCRETRY at the prompt repeats the step",
    "WAIT.EVENT": "WAIT SIG(2001) waits for a signal of another program",
    "SET.EVENT": "SIGNAL 2001 is seen by another program",
    "ATTACH": "the robot program has the robot, and TYPE and PROMPT the terminal",
    "DETACH": "the robot program has the robot, and TYPE and PROMPT the terminal",
    "FOPENR": "STORES and LOAD at the prompt keep values in files",
    "FOPENW": "STORES and LOAD at the prompt keep values in files",
    "FOPENA": "STORES and LOAD at the prompt keep values in files",
    "FOPEN": "PROMPT and TYPE talk to the terminal",
    "FCMND": "PROMPT and TYPE talk to the terminal",
    "FCLOSE": "STORES and LOAD at the prompt keep values in files",
    "FDELETE": "FDELETE at the prompt deletes a file",
    "READ": "PROMPT reads from the terminal",
    "WRITE": "TYPE writes on the terminal",
    # monitor commands
    "SEE": "EDIT is the editor",
    "XSTEP": "SSTEP does one step",
    "BPT": "PAUSE stops a program",
    "WATCH": "TYPE shows a value",
    # functions
    "BCD": "MOD and / take digits apart",
    "DCB": "MOD and / take digits apart",
    "BMASK": "add the powers of 2",
    "IDENTICAL": "DISTANCE(a, b) == 0 compares positions",
    "RX": "TRANS(0, 0, 0, o, a, t)",
    "RY": "TRANS(0, 0, 0, o, a, t)",
    "RZ": "TRANS(0, 0, 0, o, a, t)",
    "SCALE": "TRANS(k*DX(a), k*DY(a), k*DZ(a))",
    "#PHERE": "HERE #p defines a precision point",
    "DEFINED": "give every variable a value at the start",
    "LAST": "count the elements",
    "TAS": "WAIT for a signal, then set it",
    "$TIME": "TIME() is the clock in seconds",
    # operators and links
    "**": "a*a, or SQR(a)",
    "MONITOR": "SPEED at the prompt is the monitor speed",
}


def beyond_val2(statement: Statement, *, at_prompt: bool = False) -> Iterator[Diagnostic]:
    """What of a step, or of a line of the prompt, V+ alone has."""
    inner = statement.statement if isinstance(statement, ast.DoInstruction) else statement
    table = COMMANDS if at_prompt and inner is statement else INSTRUCTIONS
    for node in ast.nodes(inner):
        look = _LOOKS.get(type(node))
        if look is not None:
            yield from look(node, table)


def program_beyond_val2(program: Program) -> Iterator[Diagnostic]:
    """The same of a whole program."""
    for step in program.steps:
        if step.statement is not None:
            yield from beyond_val2(step.statement)


def _refused(what: str, instead: str, span: Span) -> Diagnostic:
    return error(NotAvailable, span, f"{what} of V+, and VPLUS is off", f"in VAL-II: {instead}")


def _named(name: str, where: str, span: Span) -> Iterator[Diagnostic]:
    if where.strip() == V_PLUS:
        yield _refused(f"{name} is", IN_VAL2.get(name, NOTHING_LIKE_IT), span)


def _instruction(node: ast.Instruction, table: Mapping[str, Word]) -> Iterator[Diagnostic]:
    row = table.get(node.word) or INSTRUCTIONS[node.word]
    yield from _named(row.name, row.where, node.span)
    if node.modifiers.unit is not None:
        yield from _named(node.modifiers.unit, LINKS[node.modifiers.unit].where, node.span)
    task = node.arguments[-1] if row.tasked and len(node.arguments) == len(row.arguments) else None
    if task is not None and row.where.strip() != V_PLUS:
        yield _refused("the number of a task is", IN_VAL2["EXECUTE"], task.span)


def _call(node: ast.Call, _table: Mapping[str, Word]) -> Iterator[Diagnostic]:
    row = FUNCTIONS.get(node.name)
    if row is not None:
        yield from _named(row.name, row.where, node.span)


def _binary(node: ast.Binary, _table: Mapping[str, Word]) -> Iterator[Diagnostic]:
    yield from _named(node.operator, OPERATORS[node.operator].where, node.span)


def _variable(node: ast.Variable, _table: Mapping[str, Word]) -> Iterator[Diagnostic]:
    if len(node.indexes or ()) > 1 or node.rest:
        hint = f"one index: {node.sigil}{node.name}[10*i+j]"
        yield _refused("an array with several indexes is", hint, node.span)


_LOOKS: Mapping[type, Callable[[Any, Mapping[str, Word]], Iterator[Diagnostic]]] = {
    ast.Instruction: _instruction,
    ast.Call: _call,
    ast.Binary: _binary,
    ast.Variable: _variable,
}
