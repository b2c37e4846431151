"""Refuse words and forms that a dialect does not have, and say what is written instead.
So is every program of V+ while the switch VPLUS is off.

The tables say by their column `where` which rows are of which; `IN_VAL2` and `IN_VAL` what a programmer writes there.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

from vrs_cli.errors import NotAvailable
from vrs_cli.language.text import ast
from vrs_cli.language.text.ast import Program, Statement
from vrs_cli.language.text.meaning import RELATIONS
from vrs_cli.language.words.functions import FUNCTIONS, LINKS, OPERATORS
from vrs_cli.language.words.instructions import INSTRUCTIONS
from vrs_cli.language.words.monitor import COMMANDS
from vrs_cli.values.diagnostics import Diagnostic, Dialect, Span, error

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


# what a VAL programmer writes
IN_VAL: Mapping[str, str] = {
    "CALL": "GOSUB carries out a program",
    "SET": "SHIFT, INVERSE and FRAME define locations, HERE teaches them",
    "BITS": "SIGNAL sets signals one by one",
    "DURATION": "SPEED makes a motion slower",
    "TIMER": "DELAY holds the arm",
    "DECOMPOSE": "POINT shows the numbers",
    "LOCK": "IGNORE ends a reaction",
}
_Block = ast.If | ast.IfGoto | ast.While | ast.Do | ast.For | ast.Case
_BLOCKS: Mapping[type, str] = {
    ast.If: "IF a EQ b THEN 10 branches",
    ast.IfGoto: "IF a EQ b THEN 10 branches",
    ast.While: "IF a EQ b THEN 10 and GOTO make a loop",
    ast.Do: "IF a EQ b THEN 10 and GOTO make a loop",
    ast.For: "IF a EQ b THEN 10 and GOTO make a loop",
    ast.Case: "IF a EQ b THEN 10 branches",
}


def beyond(program: Program, *, vplus: bool = True) -> Iterator[Diagnostic]:
    """Yield the refusal of each word and form of a program that its dialect has not; without `vplus`, of each that V+
    alone has.
    """
    told = _Told(program.dialect, "this program is in") if vplus else _Told(Dialect.VAL2)
    statements = () if told.dialect is Dialect.VPLUS else program.statements
    return (found for statement in statements for found in _beyond(statement, told))


def waits_for_signals(program: Program) -> bool:
    """Return whether WAIT 3 is that of VAL, for the input 1003. In a program with anything that V+ alone has, a number
    is a condition, which is always true: drivers that were published for V+ have such lines (probable).
    """
    remembered = vars(program)
    if "waits_for_signals" not in remembered:
        remembered["waits_for_signals"] = next(beyond(program, vplus=False), None) is None
    found: bool = remembered["waits_for_signals"]
    return found


def line_beyond(statement: Statement, dialect: Dialect, *, vplus: bool) -> Iterator[Diagnostic]:
    """Yield the same of a line of the prompt, in a session of this dialect."""
    yield from _beyond(statement, _Told(dialect, "this session is in"), at_prompt=True)
    if not vplus:
        yield from _beyond(statement, _Told(Dialect.VAL2), at_prompt=True)


def _beyond(statement: Statement, told: _Told, at_prompt: bool = False) -> Iterator[Diagnostic]:
    inner = statement.statement if isinstance(statement, ast.DoInstruction | ast.ExplainCommand) else statement
    table = COMMANDS if at_prompt and inner is statement else INSTRUCTIONS
    for node in () if told.dialect is Dialect.VPLUS else ast.nodes(inner):
        match node:
            case ast.Instruction():
                row = table.get(node.word) or INSTRUCTIONS[node.word]
                yield from told.named(row.name, row.where, node.span)
                if node.modifiers.unit is not None:
                    yield from told.named(node.modifiers.unit, LINKS[node.modifiers.unit].where, node.span)
                place = len(row.arguments) - 1
                task = node.arguments[place] if row.tasked and len(node.arguments) > place else None
                if task is not None and told.dialect.knows(row.where):
                    yield told.refused("the number of a task is", IN_VAL2["EXECUTE"], task.span)
            case ast.Call() if node.name in FUNCTIONS:
                yield from told.named(node.name, FUNCTIONS[node.name].where, node.span)
            # in VAL the relations are EQ and the like, behind IF
            case ast.Binary() if node.operator not in RELATIONS or told.dialect is not Dialect.VAL:
                yield from told.named(node.operator, OPERATORS[node.operator].where, node.span)
            case ast.Variable() if len(node.indexes or ()) > 1 or node.rest:
                yield told.refused(
                    "an array with several indexes is", f"one index: {node.sigil}{node.name}[10*i+j]", node.span
                )
        if told.dialect is Dialect.VAL and isinstance(node, _Block) and not getattr(node, "then", False):
            yield error(NotAvailable, node.span, f"this form is of VAL-II, and {told.why} VAL", _BLOCKS[type(node)])


class _Told(NamedTuple):
    """The dialect that decides, and `why`, in words; "" where the switch VPLUS does."""

    dialect: Dialect
    why: str = ""

    def refused(self, what: str, instead: str, span: Span, of: Dialect = Dialect.VPLUS) -> Diagnostic:
        why = f"{self.why} {self.dialect.title}" if self.why else "VPLUS is off"
        return error(NotAvailable, span, f"{what} of {of.title}, and {why}", f"in {self.dialect.title}: {instead}")

    def named(self, name: str, where: str, span: Span) -> Iterator[Diagnostic]:
        """The refusal of a row that the dialect has not."""
        if not self.dialect.knows(where):
            of = Dialect.VAL2 if Dialect.VAL2.knows(where) else Dialect.VPLUS
            ways = {**IN_VAL2, **IN_VAL} if self.dialect is Dialect.VAL else IN_VAL2
            yield self.refused(f"{name} is", ways.get(name, NOTHING_LIKE_IT), span, of)
