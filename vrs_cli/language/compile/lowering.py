"""Convert a program's steps to a flat list of operations. It has no blocks, only jumps to operation numbers.

Each step has one operation at which it is entered, whether by GOTO, by EXECUTE p,,step, or from the step before. If a
VALUE, ANY or ELSE is reached from the step before, the branch above it is finished, and the program leaves the block.
The tests of a CASE are therefore separate operations, entered only from the CASE and from earlier tests.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Collection, Sequence

from msgspec import Struct
from msgspec.structs import replace

from vrs_cli.language.analysis.names import LOOPS, Analysis, Block, BlockKind, label_of, loops_of
from vrs_cli.language.text import ast
from vrs_cli.language.words.instructions import DECLARATIONS, LOOP_JUMPS


class Op(Struct, frozen=True):
    """An operation in the flat list. `step`: the index (from 0) of the step that it carries out."""

    step: int


class Perform(Op, frozen=True):
    """An assignment or an instruction."""

    statement: ast.Assignment | ast.Instruction


class Invoke(Op, frozen=True):
    """A CALL or GOSUB of a named program. `site`: the number of this call among the calls in the program, from 0."""

    called: ast.ProgramCall
    site: int


class Mark(Op, frozen=True):
    """A step that does nothing when executed: DO, the END of an IF or CASE, a declaration, a blank line."""


class Finish(Op, frozen=True):
    """The end of the program."""


class Jumping(Op, frozen=True):
    """An operation that may jump. `target`: the number of the operation to which it jumps."""

    target: int


class Jump(Jumping, frozen=True):
    """An unconditional jump. `counted`: True if it counts as an executed step (GOTO), False for a part of a block
    (ELSE, the END of WHILE)."""

    counted: bool


class JumpIf(Jumping, frozen=True):
    """A conditional jump. `when`: whether it is taken if the condition is true, or if it is false; `first`: an
    instruction to carry out before the condition is tested."""

    condition: ast.Expression
    when: bool
    first: ast.Instruction | None = None


class ForLoop(Jumping, frozen=True):
    """The FOR or END step of a loop. `slot`: the index of the pair of values in the frame that holds the loop's limit
    and step."""

    statement: ast.For
    slot: int


class ForBegin(ForLoop, frozen=True):
    """The start of a FOR loop: set the variable, and jump to the target if the loop is not carried out at all."""


class ForNext(ForLoop, frozen=True):
    """The END of a FOR loop: add the step, and jump to the target (the first step of the loop's body) for another
    pass."""


class CaseBegin(Jumping, frozen=True):
    """The start of a CASE: store the value of the subject in the frame (at index `slot`), and jump to the first
    test."""

    subject: ast.Expression
    slot: int


class CaseTest(CaseBegin, frozen=True):
    """The test of a VALUE: jump to the target (the next test) if the stored subject equals none of the values."""

    values: tuple[ast.Expression, ...]


class Lowered(Struct, frozen=True):
    """A program as a flat list of operations.

    `entries`: for each step, the number of the operation at which it is entered; the last entry is the end of the
    program. `slots`: the number of pairs of values in the frame, which are kept while a call of the program is active
    (limits and steps of FOR, subjects of CASE). `calls`: the calls of named programs, in the order of their `site`.
    """

    ops: tuple[Op, ...]
    entries: tuple[int, ...]
    slots: int
    calls: tuple[Invoke, ...] = ()


def is_silent(op: Op) -> bool:
    """Return whether an operation is not counted as an executed step."""
    return isinstance(op, Mark | Finish) or (isinstance(op, Jump) and not op.counted)


def run_length(ops: Sequence[Op], places: range) -> int:
    """Return the number of steps at the start of a range of operations that are always executed together: assignments,
    and the operation after them. `places`: the range of operation numbers."""
    steps = 0
    for op in map(ops.__getitem__, places):
        steps += not is_silent(op)
        if not isinstance(op, Mark) and not (isinstance(op, Perform) and isinstance(op.statement, ast.Assignment)):
            break
    return steps


class Branch(Struct, frozen=True):
    """The two parts of an IF, as ranges of operation numbers: `then` for a true condition, `otherwise` (the ELSE part,
    which may be empty) for a false one."""

    then: range
    otherwise: range


MAX_BRANCH_DEPTH = 20  # maximum number of nested IFs that become an `if` of Python; deeper ones become jumps


def leaders_of(ops: Sequence[Op], cuts: Collection[int]) -> tuple[list[int], dict[int, Branch]]:
    """Return the numbers of the operations that begin a basic block, and the IFs that become an `if` of Python, by the
    number of their JumpIf. No basic block begins inside such an `if`. `cuts`: operations that must begin a block."""
    jumps = [(place, op.target) for place, op in enumerate(ops) if isinstance(op, JumpIf) and op.target > place]
    branches = {place: _branch(ops, place, target) for place, target in jumps}
    around: list[Branch] = []
    for place, branch in list(branches.items()):
        around = [one for one in around if one.otherwise.stop > place]
        ends = [one.then.stop if place in one.then else one.otherwise.stop for one in around]
        if len(around) == MAX_BRANCH_DEPTH or branch.otherwise.stop > min(ends, default=len(ops)):
            del branches[place]  # the IF is nested too deeply, or is an IF ... GOTO out of the enclosing branch
        else:
            around.append(branch)
    while True:
        inside = {*branches, *(branch.then.stop for branch in branches.values() if branch.otherwise)}
        targets = (op.target for place, op in enumerate(ops) if isinstance(op, Jumping) and place not in inside)
        leaders = sorted({0, *cuts, *targets})
        entered = [
            place
            for place, branch in branches.items()
            if bisect_left(leaders, place + 1) < bisect_left(leaders, branch.otherwise.stop)
        ]
        if not entered:
            return leaders, branches
        for place in entered:
            del branches[place]


def _branch(ops: Sequence[Op], place: int, target: int) -> Branch:
    """Return the two parts of the IF whose JumpIf is at `place` and jumps forward to `target`. There is an ELSE part if
    the operation before the target jumps over it."""
    last = ops[target - 1]
    if target - 1 > place and isinstance(last, Jump) and not last.counted and last.target >= target:
        return Branch(range(place + 1, target - 1), range(target, last.target))
    return Branch(range(place + 1, target), range(target, target))


def lower(analysis: Analysis) -> Lowered:
    return _Lowering(analysis).result()


# added to the index of a VALUE step, this gives the target for jumps to the test of this VALUE rather than to its step
_TESTS = 1_000_000_000


class _Lowering:
    """A converter of one program to operations. Jump targets are first step indexes, or step indexes plus `_TESTS`;
    `result` replaces them with operation numbers, which are known only after the last step."""

    def __init__(self, analysis: Analysis) -> None:
        self._steps = analysis.program.steps
        self._labels = analysis.labels
        self._openers = {block.opener: block for block in analysis.blocks}
        self._middles = {step: block for block in analysis.blocks for step in block.middles}
        self._closers = {block.closer: block for block in analysis.blocks}
        self._slots = {block.opener: number for number, block in enumerate(analysis.blocks)}
        self._ops: list[Op] = []
        self._calls: list[Invoke] = []
        self._places: dict[int, int] = {}

    def result(self) -> Lowered:
        for number, step in enumerate(self._steps):
            self._places[number] = len(self._ops)
            self._ops.append(self._operation(number, step.statement))
        end = len(self._steps)
        self._places[end] = len(self._ops)
        self._ops.append(Finish(max(end - 1, 0)))
        places = self._places
        ops = tuple(replace(op, target=places[op.target]) if isinstance(op, Jumping) else op for op in self._ops)
        return Lowered(ops, tuple(places[step] for step in range(end + 1)), len(self._slots), tuple(self._calls))

    def _operation(self, number: int, statement: ast.Statement | None) -> Op:
        match statement:
            case ast.Assignment():
                return Perform(number, statement)
            case ast.Instruction():
                return self._instruction(number, statement)
            case ast.Goto():
                return Jump(number, self._labels[statement.label], counted=True)
            case ast.IfGoto():
                return JumpIf(number, self._labels[statement.label], statement.condition, True)
            case ast.If():
                return JumpIf(number, self._first_middle(number, 1), statement.condition, False)
            case ast.While():
                return JumpIf(number, self._openers[number].closer + 1, statement.condition, False)
            case ast.Until():
                return JumpIf(number, self._closers[number].opener, statement.condition, False)
            case ast.For():
                return ForBegin(number, self._openers[number].closer + 1, statement, self._slots[number])
            case ast.Case():
                return CaseBegin(number, self._first_middle(number, _TESTS), statement.subject, self._slots[number])
            case ast.Else():
                return Jump(number, self._middles[number].closer, counted=False)
            case ast.Value():
                return self._value(number, statement)
            case ast.Any():
                self._leave_case(number, self._middles[number])
            case ast.End():
                return self._end(number)
        return Mark(number)

    def _first_middle(self, opener: int, more: int) -> int:
        """Return the step index of the first ELSE, VALUE or ANY of a block, plus `more`; if there is none, the step
        index of the block's END."""
        block = self._openers[opener]
        return block.middles[0] + more if block.middles else block.closer

    def _instruction(self, number: int, statement: ast.Instruction) -> Op:
        if statement.word in LOOP_JUMPS:
            # EXIT jumps to the step after the loop; NEXT jumps to the last step of the loop, which begins the next pass
            around = (b for b in self._openers.values() if b.kind in LOOPS and b.opener < number < b.closer)
            loops = sorted(around, key=lambda block: block.opener, reverse=True)
            closer = loops[loops_of(statement) - 1].closer
            return Jump(number, closer + (statement.word == "EXIT"), counted=True)
        if statement.word in ("CALL", "GOSUB"):
            called = statement.arguments[0]
            assert isinstance(called, ast.ProgramCall)
            self._calls.append(Invoke(number, called, len(self._calls)))
            return self._calls[-1]
        if statement.word in _CONDITIONS and (label := label_of(statement)) is not None:
            condition, first = _CONDITIONS[statement.word](statement)
            return JumpIf(number, self._labels[label], condition, True, first)
        return Mark(number) if statement.word in DECLARATIONS else Perform(number, statement)

    def _value(self, number: int, statement: ast.Value) -> Op:
        block = self._middles[number]
        case = self._steps[block.opener].statement
        assert isinstance(case, ast.Case)
        target = next((step + _TESTS for step in block.middles if step > number), block.closer)
        self._leave_case(number, block)
        return CaseTest(number, target, case.subject, self._slots[block.opener], statement.tests)

    def _leave_case(self, number: int, block: Block) -> None:
        """Add a jump to the end of the CASE before a VALUE or ANY, for programs that reach it from the step above; the
        test of the VALUE follows the jump."""
        self._ops.append(Jump(number, block.closer, counted=False))
        self._places[number + _TESTS] = len(self._ops)

    def _end(self, number: int) -> Op:
        block = self._closers[number]
        if block.kind is BlockKind.WHILE:
            return Jump(number, block.opener, counted=False)
        if block.kind is BlockKind.FOR:
            opener = self._steps[block.opener].statement
            assert isinstance(opener, ast.For)
            return ForNext(number, block.opener + 1, opener, self._slots[block.opener])
        return Mark(number)


def _grasp(statement: ast.Instruction) -> tuple[ast.Expression, ast.Instruction | None]:
    """Return the condition of GRASP (the fingers are closer together than the given width), and the instruction before
    it, which closes the hand."""
    width, span = statement.arguments[0], statement.span
    assert width is not None
    gap = ast.Call("PARAMETER", (ast.BareWord("GRASP.WIDTH", span=span),), True, span=span)
    return ast.Binary("<", gap, width, span=span), statement


_CONDITIONS: dict[str, Callable[[ast.Instruction], tuple[ast.Expression, ast.Instruction | None]]] = {
    "IFSIG": lambda statement: (ast.signals_on(statement.arguments[:-1], statement.span), None),
    "GRASP": _grasp,
}
