"""Pair the blocks and labels of a program, find steps that are never carried out, and refuse words that a dialect does
not have.

While the switch VPLUS is off, programs that use words of V+ are refused. In the word tables the column `where` names
the dialects that have a word; `IN_VAL2` and `IN_VAL` say what to write in these dialects instead of words that they
lack.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any

from msgspec import Struct, field

from vrs_cli.errors import ControlStructure, DuplicateLabel, NotAvailable, UndefinedLabel, UnreachableCode
from vrs_cli.language.analysis.names import LOOPS, Block, BlockKind, label_of, loops_of
from vrs_cli.language.text import ast
from vrs_cli.language.text.ast import Program, Statement
from vrs_cli.language.text.parser import parse_file
from vrs_cli.language.text.printer import print_file
from vrs_cli.language.words.foreign import own_word
from vrs_cli.language.words.functions import FUNCTIONS, LINKS, OPERATORS, RELATIONS
from vrs_cli.language.words.instructions import INSTRUCTIONS, LOOP_JUMPS
from vrs_cli.language.words.monitor import COMMANDS
from vrs_cli.values.diagnostics import Diagnostic, DiagnosticCollector, Dialect, Severity, Span, error, warning


def structure_of(program: Program) -> Structure:
    """Pair the opening and closing steps of all blocks in a program, find its labels, and report mistakes in both."""
    structure = Structure()
    for index, step in enumerate(program.steps):
        if step.label is not None and (before := structure.labels.setdefault(step.label, index)) != index:
            structure.fault(DuplicateLabel, step.span, f"{step.label} is the label of step {before + 1} too")
        if step.statement is not None:
            structure.step(index, step.statement)
    structure.end(program)
    return structure


class _Open(Struct):
    """A block whose end has not been found yet. `opener`: the index of its first step; `middles`: the indexes of its
    ELSE, or VALUE and ANY steps."""

    kind: BlockKind
    opener: int
    span: Span
    middles: list[int] = field(default_factory=list)
    complete: bool = False  # whether ELSE or ANY was found, so that only END may follow
    vague: bool = False  # whether it is uncertain that the line opened a block, because it has a syntax error

    @property
    def closing(self) -> str:
        return "UNTIL" if self.kind is BlockKind.DO else "END"

    @property
    def name(self) -> str:
        return f"{self.kind.value} at step {self.opener + 1}"


class Structure(DiagnosticCollector):
    """The structure of a program. `blocks`: its blocks in the order of their ends; `labels`: the step index of each
    label."""

    def __init__(self) -> None:
        super().__init__()
        self.blocks: list[Block] = []
        self.labels: dict[int, int] = {}
        self._open: list[_Open] = []
        self._vague_ends = 0  # number of END and UNTIL steps that were paired with uncertain (`vague`) blocks

    def step(self, index: int, statement: Statement) -> None:
        if isinstance(statement, ast.Instruction) and statement.word in LOOP_JUMPS:
            self._leaves(statement)
        # pair ENDIF like an END, so that the block is not reported too; the analyzer refuses the word itself
        if isinstance(statement, ast.Instruction) and statement.word == "ENDIF":
            self._unread(index, ast.BadLine("END", span=statement.span))
            return
        if (action := _ACTIONS.get(type(statement))) is not None:
            action(self, index, statement)
        elif isinstance(statement, ast.BadLine):
            self._unread(index, statement)
        elif self._open and self._open[-1].kind is BlockKind.CASE and not self._open[-1].middles:
            self.warn(
                ControlStructure,
                statement.span,
                f"between CASE at step {self._open[-1].opener + 1} and its first VALUE nothing is carried out",
            )

    def end(self, program: Program) -> None:
        """Report blocks without an end, and jumps to labels that no step has.

        A line with a syntax error may or may not open a block, and its first word may be a label. So each END that was
        paired with such an uncertain block may belong to another block: one block fewer is reported. Jumps to such a
        label are not reported."""
        missing = [block for block in self._open if not block.vague]
        for block in missing[: max(0, len(missing) - self._vague_ends)]:
            self._fault(block.span, f"{block.name} has no {block.closing}")
        statements = program.statements
        unread = {one.text.split(maxsplit=1)[0] for one in statements if isinstance(one, ast.BadLine)}
        known = ", ".join(str(label) for label in sorted(self.labels)[:8])
        hint = f"the labels are {known}" if known else "a label is a number before a statement"
        for statement in statements:
            if (label := label_of(statement)) is not None and label not in self.labels and str(label) not in unread:
                self.fault(UndefinedLabel, statement.span, str(label), hint)

    def _fault(self, span: Span, detail: str, hint: str = "") -> None:
        self.fault(ControlStructure, span, detail, hint)

    def _leaves(self, statement: ast.Instruction) -> None:
        """Check that EXIT or NEXT is inside at least as many loops as its number requires (`EXIT 2`: two loops)."""
        wanted, around = loops_of(statement), sum(block.kind in LOOPS for block in self._open)
        if not wanted:
            if self._open and self._open[-1].kind is BlockKind.FOR:
                self._open[-1].vague = True  # probably NEXT i stands in place of END, so do not report a missing END
            hint = (
                f"{statement.word} alone is for the innermost, {statement.word} 2 for two; END ends the steps of a loop"
            )
            self._fault(statement.span, f"{statement.word} takes a whole number of loops", hint)
        elif wanted > around:
            loops = "no loop" if not around else "1 loop" if around == 1 else f"{around} loops"
            more = "; RETURN ends a program" if statement.word == "EXIT" and not around else ""
            hint = f"the loops are FOR, WHILE and DO{more}"
            self._fault(statement.span, f"{statement.word} {wanted} with {loops} around it", hint)

    def _begin(self, index: int, statement: Statement) -> None:
        self._open.append(_Open(_OPENERS[type(statement)], index, statement.span))

    def _unread(self, index: int, line: ast.BadLine) -> None:
        """Treat a line with a syntax error as the first step, the ELSE or the END of a block, whichever it seems to be,
        so that a missing END or a superfluous ELSE is not reported in addition to the line itself."""
        words = _words(line.text)
        first, last = words[0], words[-1]
        if own_word(first) == "END":  # a word of another language for END, such as ENDFOR
            first = "END"
        if first in _UNREAD_MIDDLES:
            kind = _UNREAD_MIDDLES[first]
            block = None if kind is None else self._innermost(kind)
            if block is not None and block.kind is kind and not block.complete:
                block.middles.append(index)
        elif first in ("END", "UNTIL"):
            if any(one.closing == first for one in self._open):
                self._close(index, line, first, "")
        elif not (first == "IF" and last.isdigit() and {"GOTO", "THEN"} & set(words)):  # skip IF ... GOTO 10: no block
            kind = BlockKind.__members__.get(first) or _UNREAD_LAST.get(last)
            if kind is not None:
                sure = kind is BlockKind.FOR or last in _UNREAD_LAST
                self._open.append(_Open(kind, index, line.span, vague=not sure))

    def _innermost(self, kind: BlockKind) -> _Open | None:
        """Return the innermost open block, or None. First remove uncertain (`vague`) blocks of other kinds that are
        inside it."""
        while self._open and self._open[-1].vague and self._open[-1].kind is not kind:
            self._open.pop()
        return self._open[-1] if self._open else None

    def _middle(self, index: int, statement: Statement, word: str, kind: BlockKind, completes: bool) -> None:
        block = self._innermost(kind)
        if block is None or block.kind is not kind:
            inside = f", inside {block.name}" if block else ""
            self._fault(statement.span, f"{word} without {kind.value}{inside}")
        elif block.complete:
            last = "ELSE" if kind is BlockKind.IF else "ANY"
            self._fault(statement.span, f"{word} after {last} of {block.name}")
        else:
            block.middles.append(index)
            block.complete = completes

    def _close(self, index: int, statement: Statement, word: str, openers: str) -> None:
        """Close the innermost block that ends with `word` (END or UNTIL), and report the open blocks inside it as
        blocks without an end. `openers`: the words for a message if there is no such block."""
        if not any(block.closing == word for block in self._open):
            inside = f", inside {self._open[-1].name}" if self._open else ""
            wanted = "DO, alone on its line, begins the loop" if word == "UNTIL" else ".END ends the program"
            hint = wanted if word == "UNTIL" or not inside else ""
            self._fault(statement.span, f"{word} without {openers}{inside}", hint)
            return
        while self._open[-1].closing != word:
            block = self._open.pop()
            if not block.vague:
                self._fault(block.span, f"{block.name} has no {block.closing} before {word} at step {index + 1}")
        block = self._open.pop()
        self._vague_ends += block.vague
        self.blocks.append(Block(block.kind, block.opener, tuple(block.middles), index))


_OPENERS: Mapping[type, BlockKind] = {
    ast.If: BlockKind.IF,
    ast.While: BlockKind.WHILE,
    ast.Do: BlockKind.DO,
    ast.For: BlockKind.FOR,
    ast.Case: BlockKind.CASE,
}

# the kind of block that a line with a syntax error opens, by its last word, or divides, by its first word (None: ELSEIF
# divides a block, but VAL-II has no such step)
_UNREAD_LAST: Mapping[str, BlockKind] = {"THEN": BlockKind.IF, "DO": BlockKind.WHILE, "OF": BlockKind.CASE}
_UNREAD_MIDDLES: Mapping[str, BlockKind | None] = {
    "ELSE": BlockKind.IF,
    "VALUE": BlockKind.CASE,
    "ANY": BlockKind.CASE,
    **dict.fromkeys(("ELSEIF", "ELIF", "ELSIF"), None),
}


def _words(text: str) -> list[str]:
    """Return the words of a line in upper case, without its label, strings and comment. The first word is "" if the
    line is empty or looks like an assignment."""
    words = re.findall(r"[A-Z][\w.]*|\d+|\S", re.sub(r'"[^"]*"?|;.*', " ", text.upper()))
    if words and words[0].isdigit():
        words.pop(0)
    return ["", *words] if not words or words[1:2] in (["="], ["["]) else words


_ACTIONS: Mapping[type, Callable[[Structure, int, Any], None]] = {
    **dict.fromkeys(_OPENERS, Structure._begin),
    ast.Else: partial(Structure._middle, word="ELSE", kind=BlockKind.IF, completes=True),
    ast.Value: partial(Structure._middle, word="VALUE", kind=BlockKind.CASE, completes=False),
    ast.Any: partial(Structure._middle, word="ANY", kind=BlockKind.CASE, completes=True),
    ast.End: partial(Structure._close, word="END", openers="IF, WHILE, FOR or CASE"),
    ast.Until: partial(Structure._close, word="UNTIL", openers="DO"),
}


# --- the canonical text of a file ------------------------------------------------------------------------------


def canonical_text(text: str, dialect: Dialect = Dialect.VPLUS, name: str = "") -> str | tuple[Diagnostic, ...]:
    """Return the canonical text of a file. Return its errors instead if a line does not parse, or a block has no start
    or no end, because the indentation would then be misleading.

    `dialect`: the dialect to use if the file does not name one. `name`: the name of the file, for a program without a
    heading.
    """
    file, found = parse_file(text, dialect, name=name)
    unpaired = (
        one
        for part in file.parts
        if isinstance(part, Program)
        for one in structure_of(part).diagnostics
        if one.code == ControlStructure.code
    )
    wrong = tuple(one for one in (*found, *unpaired) if one.severity is Severity.ERROR)
    return wrong or print_file(file)


# --- steps that are never carried out ------------------------------------------------------------------------


LEAVING = frozenset({"RETURN", "STOP", "HALT", "RETURNE"})  # instructions after which the next step is not executed
_CLOSERS = (ast.End, ast.Until, ast.Else, ast.Any, ast.Value)


def unreachable(program: Program, blocks: Sequence[Block], labels: Mapping[int, int]) -> Iterator[Diagnostic]:
    """Warn about steps that are never carried out: one warning for each sequence, at its first step, which names the
    step before it that jumps away.

    Conditions are not evaluated, so WHILE TRUE is taken as a loop that can end. The blocks and labels must be correct.
    """
    reached = _reachable_steps(program, blocks, labels)
    leaving, before_reached = "", True
    for index, step in enumerate(program.steps):
        if step.statement is not None and not isinstance(step.statement, _CLOSERS):
            if index not in reached and before_reached:
                yield warning(
                    UnreachableCode,
                    step.statement.span,
                    f"this is never carried out{leaving}",
                    "a label before it would lead to it",
                )
            before_reached = index in reached
        if _leaves(step.statement):
            word = step.statement.word if isinstance(step.statement, ast.Instruction) else "GOTO"
            leaving = f", after {word} at step {index + 1}"


def _leaves(statement: Statement | None) -> bool:
    """Return whether the next step is never executed directly after this statement."""
    return isinstance(statement, ast.Goto) or (isinstance(statement, ast.Instruction) and statement.word in LEAVING)


def _reachable_steps(program: Program, blocks: Sequence[Block], labels: Mapping[int, int]) -> set[int]:
    """Return the indexes of all steps that the program can reach from its first step."""
    jumps: dict[int, tuple[int, ...]] = {}  # for each opener, middle and closer of a block: the steps that may be next
    for block in blocks:
        after, inside = block.closer + 1, tuple(middle + 1 for middle in block.middles)
        if block.kind in LOOPS:
            jumps[block.closer] = (block.opener, after)
            jumps |= {} if block.kind is BlockKind.DO else {block.opener: (block.opener + 1, after)}
        else:  # a CASE may continue after any VALUE; a VALUE or ELSE reached from the step above leaves the block
            way = (block.opener + 1, *(inside or (after,)))
            jumps[block.opener] = way if block.kind is BlockKind.IF else (*inside, after)
            jumps |= dict.fromkeys(block.middles, (after,))
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
        if isinstance(statement, ast.Instruction) and statement.word in LOOP_JUMPS:  # it may continue after any block
            waiting += (block.closer + 1 for block in blocks if block.opener < index < block.closer)
    return reached


# what to write in VAL-II in place of a word that only V+ has
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


# what to write in VAL in place of a word that only VAL-II and V+ have
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
    """Yield an error for each word and each form of a statement that the program's dialect lacks; if `vplus` is False
    (the switch VPLUS is off), for each that only V+ has."""
    check = _DialectCheck(program.dialect, "this program is in") if vplus else _DialectCheck(Dialect.VAL2)
    statements = () if check.dialect is Dialect.VPLUS else program.statements
    return (found for statement in statements for found in _beyond(statement, check))


def waits_for_signals(program: Program) -> bool:
    """Return whether WAIT 3 in a program waits for input 1003, as in VAL. In a program with words of V+ the number is a
    condition instead, which is always true; published drivers for V+ probably rely on this rule of V+."""
    remembered = vars(program)
    if "waits_for_signals" not in remembered:
        remembered["waits_for_signals"] = next(beyond(program, vplus=False), None) is None
    return bool(remembered["waits_for_signals"])


def line_beyond(statement: Statement, dialect: Dialect, *, vplus: bool) -> Iterator[Diagnostic]:
    """Yield an error for each word and form in a line typed at the prompt that the session's dialect lacks. `vplus`:
    whether the switch VPLUS is on; if not, words that only V+ has are errors too."""
    yield from _beyond(statement, _DialectCheck(dialect, "this session is in"), at_prompt=True)
    if not vplus:
        yield from _beyond(statement, _DialectCheck(Dialect.VAL2), at_prompt=True)


def _beyond(statement: Statement, check: _DialectCheck, at_prompt: bool = False) -> Iterator[Diagnostic]:
    inner = statement.statement if isinstance(statement, ast.DoInstruction | ast.ExplainCommand) else statement
    table = COMMANDS if at_prompt and inner is statement else INSTRUCTIONS
    for node in () if check.dialect is Dialect.VPLUS else ast.nodes(inner):
        match node:
            case ast.Instruction():
                row = table.get(node.word) or INSTRUCTIONS[node.word]
                yield from check.check_row(row.name, row.where, node.span)
                if node.modifiers.unit is not None:
                    yield from check.check_row(node.modifiers.unit, LINKS[node.modifiers.unit].where, node.span)
                place = len(row.arguments) - 1
                task = node.arguments[place] if row.takes_task and len(node.arguments) > place else None
                if task is not None and check.dialect.knows(row.where):
                    yield check.refusal("the number of a task is", IN_VAL2["EXECUTE"], task.span)
            case ast.Call() if node.name in FUNCTIONS:
                yield from check.check_row(node.name, FUNCTIONS[node.name].where, node.span)
            # skip relations in VAL: they exist after IF, where they are written EQ, NE and so on
            case ast.Binary() if node.operator not in RELATIONS or check.dialect is not Dialect.VAL:
                yield from check.check_row(node.operator, OPERATORS[node.operator].where, node.span)
            case ast.Variable() if len(node.indexes or ()) > 1 or node.rest:
                yield check.refusal(
                    "an array with several indexes is", f"one index: {node.sigil}{node.name}[10*i+j]", node.span
                )
        if check.dialect is Dialect.VAL and isinstance(node, _Block) and not getattr(node, "then", False):
            yield error(NotAvailable, node.span, f"this form is of VAL-II, and {check.why} VAL", _BLOCKS[type(node)])


class _DialectCheck(Struct, frozen=True):
    """A check against a dialect. `why`: the start of the reason in a message ("this program is in"); "" if the reason
    is that the switch VPLUS is off."""

    dialect: Dialect
    why: str = ""

    def refusal(self, what: str, instead: str, span: Span, of: Dialect = Dialect.VPLUS) -> Diagnostic:
        why = f"{self.why} {self.dialect.title}" if self.why else "VPLUS is off"
        return error(NotAvailable, span, f"{what} of {of.title}, and {why}", f"in {self.dialect.title}: {instead}")

    def check_row(self, name: str, where: str, span: Span) -> Iterator[Diagnostic]:
        """Yield an error if the word `name` does not exist in the dialect. `where`: the dialects that have it, as in
        the word tables."""
        if not self.dialect.knows(where):
            of = Dialect.VAL2 if Dialect.VAL2.knows(where) else Dialect.VPLUS
            ways = {**IN_VAL2, **IN_VAL} if self.dialect is Dialect.VAL else IN_VAL2
            yield self.refusal(f"{name} is", ways.get(name, "there is nothing like it"), span, of)
