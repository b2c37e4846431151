"""Compile a subroutine that never waits to a Python function, which programs call directly.

A direct call is fast because it makes no activation (the record of a running call) and no generator, and does not
return to the task. The subroutine may contain only assignments, blocks, jumps, RETURN and calls, and no function that
depends on the task.

    def direct(X, n, E, a0, a1, ..., R, L, S, P, KR, KL, C, ...):   X: context; n: steps left in the time slice;
        p0, q0, k0 = a0                                             E: executable; a0...: arguments; the others have
        pc = 0                                                      defaults: cells, bound calls, arrays (`compiler`)
        while True:
            ...

At the start of a straight run (operations that always follow each other), the function counts all steps of the run. It
returns the number of steps left in the task's time slice. If the time slice may end within a run, the function records
the current operation in the context and returns minus the number of steps left; the task then continues it with an
activation. If the task must make the whole call, the function records its arguments and returns 0.
"""

from __future__ import annotations

import ast as py
from collections import Counter
from collections.abc import Callable
from itertools import pairwise

from msgspec import Struct

from vrs_cli.language.analysis.names import Analysis
from vrs_cli.language.compile import lowering
from vrs_cli.language.compile import python_tree as tree
from vrs_cli.language.compile.compiler import FIRST_LINE, ProgramCompiler
from vrs_cli.language.compile.expressions import CELLS, KEYS, Array, Library
from vrs_cli.language.text import ast
from vrs_cli.language.words.values import Kind

MAX_OPERATIONS = 64  # maximum number of operations in a direct function, because the robot waits while it is compiled
# functions of VAL-II that depend on the current program or operation, or may wait
_TASK_FUNCTIONS = frozenset(
    ("BITS", "GETC", "GET.EVENT", "ID", "IOSTAT", "LATCH", "#PLATCH", "LATCHED", "PRIORITY", "SIG", "STATUS", "TASK")
)


class Direct(Struct, frozen=True):
    """A compiled direct function. `arrays`: the arrays that it takes as its last default arguments; `following`: for
    each operation, the number of later steps in its straight run, which are counted together with it."""

    function: Callable[..., int]
    arrays: tuple[Array, ...]
    following: tuple[int, ...]


def compile_direct(library: Library, analysis: Analysis, lowered: lowering.Lowered) -> Direct | None:
    """Compile a program to a direct function. Return None if the program is too long, may wait, or depends on its
    task."""
    nodes = (node for statement in analysis.program.statements for node in ast.nodes(statement))
    task_functions = (isinstance(node, ast.Call) and node.name in _TASK_FUNCTIONS for node in nodes)
    if len(lowered.ops) > MAX_OPERATIONS or not all(map(_never_waits, lowered.ops)) or any(task_functions):
        return None
    return _DirectCompiler(library, analysis, lowered).direct()


def _never_waits(op: lowering.Op) -> bool:
    if isinstance(op, lowering.JumpIf):
        return op.first is None
    return not isinstance(op, lowering.Perform) or isinstance(op.statement, ast.Assignment) or _returns(op)


def _returns(op: lowering.Op) -> bool:
    """Return whether an operation is a RETURN without an argument."""
    statement = op.statement if isinstance(op, lowering.Perform) else None
    return isinstance(statement, ast.Instruction) and statement.word == "RETURN" and not any(statement.arguments)


def _fields(number: int) -> py.Tuple:
    """Make the target `p0, q0, k0` of an assignment that unpacks the reference with this number (real cells, location
    cells, key)."""
    return tree.unpack_target(f"{letter}{number}" for letter in "pqk")


class _DirectCompiler(ProgramCompiler):
    """A compiler of one direct function. `_runs`: the number of steps in each straight run, by its first operation;
    `_needed`: by the operation before which `n` is tested, the number of steps until the next test."""

    def direct(self) -> Direct:
        leaders, self._branches = lowering.leaders_of(self._lowered.ops, ())
        self._numbers = {op: number for number, op in enumerate(leaders)}
        self._here = range(len(leaders))
        following = self._count(leaders)
        count = len(self._program.parameters)
        self._given = [f"a{number}" for number in range(count)]
        blocks = [self._block(number, leaders) for number in self._here]
        loop = py.While(tree.constant(True), self._tree(blocks, 0), [])
        names = ["X", "n", "E", *self._given, *CELLS.values(), *KEYS.values(), "C", *self.arrays.values()]
        definition = py.FunctionDef(tree.DIRECT, tree.parameters(names), [*self._prologue(count), loop], [], None)
        return Direct(tree.make_function(definition, self.namespace), tuple(self.arrays), following)

    def _count(self, leaders: list[int]) -> tuple[int, ...]:
        """Set `_runs` and `_needed`. Return, for each operation, the number of steps after it in its straight run."""
        ops = self._lowered.ops
        self._runs, self._needed = Counter[int](), Counter[int]()
        following = [0] * len(ops)
        joins, tests = set[int](), {*leaders}
        for place, branch in self._branches.items():
            joins |= {branch.otherwise.start, branch.otherwise.stop}
            if any(isinstance(op, lowering.Invoke) for op in ops[place : branch.otherwise.stop]):
                tests |= {branch.otherwise.start, branch.otherwise.stop}
        for first, end in pairwise([*leaders, len(ops)]):
            run = test = first
            for place in range(first, end):
                run = place if place in joins else run
                test = place if place in tests else test
                if not lowering.is_silent(ops[place]):
                    self._runs[run] += 1
                    self._needed[test] += 1
                    following[run:place] = [number + 1 for number in following[run:place]]
                calls = isinstance(ops[place], lowering.Invoke)
                if calls or isinstance(ops[place], lowering.Jumping) or _returns(ops[place]):
                    run = place + 1
                test = run if calls else test
        return tuple(following)

    def _prologue(self, count: int) -> list[py.stmt]:
        """Return the code at the start of the function. It unpacks the arguments, and leaves the call to the task if an
        argument has the wrong kind, or if the program needs V+ and the switch VPLUS is off."""
        by_task = py.Return(tree.call("by_task", *map(tree.name, ("X", "n", "E", *self._given))))
        body: list[py.stmt] = []
        if not self.library.waits_for_signals(self._program):  # False for a program with words that only V+ has
            settings = py.Attribute(py.Attribute(tree.name("X"), "engine", py.Load()), "settings", py.Load())
            body.append(py.If(tree.not_(tree.method(settings, "switch", tree.constant("VPLUS"))), [by_task], []))
        for number, parameter in enumerate(self._program.parameters):
            body.append(py.Assign([_fields(number)], tree.name(f"a{number}")))
            decided = None if parameter.sigil else self.kinds.get(parameter.key)
            if decided is not None:
                other = tree.name(f"{'q' if decided is Kind.REAL else 'p'}{number}")
                body.append(py.If(tree.compare(tree.name(f"k{number}"), py.In(), other), [by_task], []))
        if own := [*map(_fields, range(count, len(self.parameters)))]:
            body.append(tree.assign("o", tree.method(tree.name("E"), "own")))
            body.append(py.Assign([py.Tuple([*own], py.Store())], tree.name("o")))
        slots = [py.Name(slot, py.Store()) for slot in self.slots]
        return [
            *body,
            *([py.Assign([*slots], tree.name("UNSET"))] if slots else []),
            tree.assign("pc", tree.constant(0)),
        ]

    def _ends_silently(self, _place: int) -> bool:
        return False  # so `_fill` adds no stores: a direct function does not keep the number of an operation

    def _operation(self, place: int, op: lowering.Op, _stop: int) -> list[py.stmt]:
        self._place = place
        statements = self._statements(op)
        if self._runs[place]:
            count = py.BinOp(tree.name("n"), py.Sub(), tree.constant(self._runs[place]))
            statements.insert(0, tree.assign("n", count))
        if self._needed[place]:
            enough = tree.compare(tree.name("n"), py.LtE(), tree.constant(self._needed[place]))
            statements.insert(0, py.If(enough, [self._break_off(tree.constant(0), tree.name("n"))], []))
        for statement in statements:
            tree.place(statement, place + FIRST_LINE)
        return statements

    def _break_off(self, result: py.expr, left: py.expr) -> py.stmt:
        """Return the code that ends the direct call, so that the task continues the subroutine with an activation:
        before the current operation, or after it if the operation is a call that returned a negative `result`.
        `left`: the number of steps left in the time slice."""
        arguments: list[py.expr] = [*map(tree.name, self._given)]
        if len(self.parameters) > len(arguments):
            arguments.append(py.Starred(tree.name("o"), py.Load()))
        slots = tree.tuple_of(map(tree.name, self.slots))
        called = tree.compare(result, py.Lt(), tree.constant(0))
        frame = tree.tuple_of((tree.name("E"), tree.tuple_of(arguments), tree.constant(self._place), slots, called))
        return py.Return(tree.method(tree.name("X"), "break_off", result, left, frame))

    def _call_program(self, op: lowering.Invoke) -> list[py.stmt]:
        before = py.BinOp(tree.name("n"), py.Add(), tree.constant(1))
        unfinished = tree.compare(tree.name("m"), py.LtE(), tree.constant(0))
        left = py.If(unfinished, [self._break_off(tree.name("m"), before)], [])
        return [*self.call_bound(op), left, tree.assign("n", tree.name("m"))]

    def _finish(self) -> list[py.stmt]:
        return [py.Return(tree.name("n"))]

    def _statement(self, statement: ast.Assignment | ast.Instruction) -> list[py.stmt]:
        return self._assignment(statement) if isinstance(statement, ast.Assignment) else self._finish()
