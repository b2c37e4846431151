"""Compile a checked program to a Python generator function, built as a tree of Python's own `ast`.

The operations of `lowering` are grouped into basic blocks. Inside `while True` a binary tree of `if pc < k` selects the
block with number `pc`, so that a GOTO into or out of a control structure only sets a number. The function yields each
request or effect, and Python suspends the program there. A task runs in turns: time slices with a limited number of
steps. `n` is the number of steps left in the turn. Each counted operation subtracts 1; at 0 the function yields the
operation's number before it carries the operation out. The first of several assignments subtracts the steps of all of
them at once, unless the turn may end among them (then `s` is True). While the program is suspended, the context's
`turn` holds n and the number of the current operation. `t` changes with each suspension; as long as it stays the same,
a variable that was found to be real stays real. The Python lines of an operation have its number, so that a traceback
shows in which operation an error occurred.

    def program(X, R, L, S, P, KR, KL, C, F, pc, ...):   X: context of the task; R, L, S, P: cells (storage) of reals,
        l0, s0 = F                                  locations, strings, precision points; KR, KL: keys of R and L;
        B = X.turn                                  C: functions bound to calls; F: frame with the limits of FOR and
        n = B[0]                                    subjects of CASE; ...: arrays and arguments
        try:
            while True:
                if pc < 4:
                    ...
        finally:
            F[:] = (l0, s0)

An IF becomes an `if` of Python if nothing jumps into its parts. A block that jumps to itself becomes a separate
`while True`, so that a simple loop does not pass through the binary tree. In the variant `everywhere` each operation
begins a block, so that the function can be entered at any step; this variant is made on demand.

A long program becomes several functions, so that its whole tree is never in memory at once. Each function takes the
arguments above and returns the number of the block where another function continues, or None at the end.
"""

from __future__ import annotations

import ast as py
from bisect import bisect_right
from collections.abc import Callable, Generator, Mapping, Sequence
from functools import cached_property
from itertools import pairwise
from typing import Any, cast

from msgspec import Struct

from vrs_cli.errors import ProgramNotExecutable
from vrs_cli.language.analysis.names import Analysis
from vrs_cli.language.compile import lowering
from vrs_cli.language.compile import python_tree as tree
from vrs_cli.language.compile.expressions import CELLS, KEYS, Array, ExpressionCompiler, Library, constant_index, reads
from vrs_cli.language.text import ast
from vrs_cli.language.text.collector import free_in_parts, pause_collector
from vrs_cli.language.text.printer import statement_text
from vrs_cli.language.words.instructions import INSTRUCTIONS
from vrs_cli.language.words.values import Kind
from vrs_cli.language.words.word import Argument, Shape, argument_at
from vrs_cli.values.numbers import LIMIT

Steps = Generator[Any, str | None, int | None]

FIRST_LINE = 2  # Python line number of operation 0; line 1 is for leaves that several syntax trees share
# maximum number of operations in a Python function, because no other thread runs while Python compiles a function
OPS_A_FUNCTION = 512


# statements that all operations share: the first counts a step, the second loads n and changes t after a suspension
_COUNT: py.stmt = tree.place(tree.assign("n", py.BinOp(tree.name("n"), py.Sub(), tree.constant(1))))
_LOAD_LEFT: py.stmt = tree.place(
    py.Assign(
        [tree.unpack_target("nt")],
        tree.tuple_of((tree.item("B", tree.constant(0)), py.BinOp(tree.name("t"), py.Add(), tree.constant(1)))),
    )
)


# --- programs ----------------------------------------------------------------------------------------------------


class ProgramCompiler(ExpressionCompiler):
    """A compiler of a program's operations to the body of a Python function.

    Operations are given by their numbers, and "current" means being compiled. `_numbers`: the number of each block, by
    its first operation; `_here`: the blocks of the current function; `_inner`: the current block if it becomes a
    separate `while True`; `_silent_blocks`: the blocks without a counted operation; `_later`: the number of following
    steps that have been counted together with an earlier one; `_following`: the same number for each operation in such
    a run of steps; `_branches`: the IFs that become an `if` of Python, by their operation; `_place`: the current
    operation; `_counted`: the last counted operation of the current block, or None if it depends on the path; `_real`:
    by the key of a variable, the Python variable that equals `t` if the VAL-II variable was found to be real since the
    last suspension.
    """

    def __init__(self, library: Library, analysis: Analysis, lowered: lowering.Lowered) -> None:
        declared = (*analysis.program.parameters, *(own.variable for own in analysis.own))
        super().__init__(library, analysis.kinds, {variable.key: number for number, variable in enumerate(declared)})
        self.array_parameters.update(variable.key for variable in declared if variable.indexes is not None)
        self._lowered, self._program = lowered, analysis.program
        self.slots = [f"{letter}{number}" for number in range(lowered.slots) for letter in "ls"]
        self._numbers: Mapping[int, int] = {}
        self._here = range(0)
        self._inner: int | None = None
        self._silent_blocks: frozenset[int] = frozenset()
        self._branches: Mapping[int, lowering.Branch] = {}
        self._place = 0
        self._real: dict[str, str] | None = None
        self._counted: int | None = None
        self._later = 0
        self._following: dict[int, int] = {}

    def variant(self, everywhere: bool) -> Variant:
        ops = self._lowered.ops
        cuts = range(len(ops)) if everywhere else range(0, len(ops), OPS_A_FUNCTION)
        leaders, self._branches = lowering.leaders_of(ops, cuts)
        self._numbers = numbers = {op: number for number, op in enumerate(leaders)}
        firsts = [numbers[op] for op in range(0, len(ops), OPS_A_FUNCTION)]
        ends = zip(leaders, [*leaders[1:], len(ops)], strict=True)
        self._silent_blocks = frozenset(
            k for k, cut in enumerate(ends) if all(map(lowering.is_silent, ops[slice(*cut)]))
        )
        parts = [self._function(range(*cut), leaders) for cut in pairwise([*firsts, len(leaders)])]
        function = parts[0] if len(parts) == 1 else _join(parts, firsts)
        return Variant(function, tuple(self.arrays), numbers, self._following)

    def _function(self, here: range, leaders: list[int]) -> Callable[..., Steps]:
        """Make the Python function for the blocks in `here`. It accepts and ignores further arguments: the arrays that
        only later functions need."""
        self._here, self._real = here, {}
        blocks = [self._block(number, leaders) for number in here]
        loop: list[py.stmt] = [py.While(tree.constant(True), self._tree(blocks, here.start), [])]
        flags = [tree.assign(flag, tree.constant(None)) for flag in self._real.values()]
        turn = tree.assign("B", py.Attribute(tree.name("X"), "turn", py.Load()))
        body = [*flags, tree.assign("t", tree.constant(0)), turn, _LOAD_LEFT]
        if self._lowered.slots:  # load the slots from the frame; store them again in `finally`, even after an error
            frame = py.Subscript(tree.name("F"), py.Slice(), py.Store())
            kept = py.Assign([frame], tree.tuple_of(map(tree.name, self.slots)))
            loop = [py.Assign([tree.unpack_target(self.slots)], tree.name("F")), py.Try(loop, [], [], [kept])]
        names = ["X", *CELLS.values(), *KEYS.values(), "C", "F", "pc", *self.parameter_fields(), *self.arrays.values()]
        body += [*loop, tree.yield_(tree.constant(None))]  # the yield is never reached, but makes a generator
        parameters = tree.parameters(names, rest=py.arg("_rest"))
        return tree.make_function(py.FunctionDef("program", parameters, body, [], None), self.namespace)

    def _tree(self, blocks: list[list[py.stmt]], first: int) -> list[py.stmt]:
        if len(blocks) == 1:
            return blocks[0]
        half = len(blocks) // 2
        test = tree.compare(tree.name("pc"), py.Lt(), tree.constant(first + half))
        return [py.If(test, self._tree(blocks[:half], first), self._tree(blocks[half:], first + half))]

    # blocks

    def _block(self, number: int, leaders: list[int]) -> list[py.stmt]:
        first, end = (*leaders, len(self._lowered.ops))[number : number + 2]
        ops = self._lowered.ops[first:end]
        inner = any(isinstance(op, lowering.Jumping) and op.target == first for op in ops)
        self._inner, self._counted = number if inner else None, None
        statements, goes_on = self._operations(range(first, end))
        if goes_on and end < len(self._lowered.ops):
            statements += self._to(end)
        return [py.While(tree.constant(True), statements, [])] if inner else statements

    def _operations(self, places: range) -> tuple[list[py.stmt], bool]:
        """Return the Python statements for a range of operations, and whether the program may continue after it."""
        statements, place = list[py.stmt](), places.start
        while place < places.stop:
            op = self._lowered.ops[place]
            statements += self._operation(place, op, places.stop)
            branch = self._branches.get(place)
            if branch is not None:
                self._fill(cast(py.If, statements[-1]), branch)
            elif isinstance(op, lowering.Jump) or type(op) is lowering.CaseBegin:
                return statements, False
            place = place + 1 if branch is None else branch.otherwise.stop
        return statements, True

    def _fill(self, statement: py.If, branch: lowering.Branch) -> None:
        """Fill both parts of an `if`. If the program can end after the `if` without another counted operation, each
        part stores the number of its last counted operation in the context, because the number depends on the part."""
        stores, counted = self._ends_silently(branch.otherwise.stop), self._counted
        parts = list[list[py.stmt]]()
        for places in (branch.then, branch.otherwise):
            self._counted = counted
            statements, goes_on = self._operations(places)
            if goes_on and stores and self._counted is not None:
                statements.append(_store(1, self._counted))
            parts.append(statements or [py.Pass()] * (places is branch.then))
            for made in parts[-1]:
                tree.place(made)
        statement.body, statement.orelse = parts
        self._counted = None

    def _ends_silently(self, place: int) -> bool:
        """Return whether the program, from this operation on, reaches its end or a block without counted operations
        before it carries out a counted operation."""
        while place not in self._numbers:
            op = self._lowered.ops[place]
            if not lowering.is_silent(op) or isinstance(op, lowering.Finish):
                return lowering.is_silent(op)
            place = op.target if isinstance(op, lowering.Jump) else place + 1
        return self._numbers[place] in self._silent_blocks

    def _to(self, op: int) -> list[py.stmt]:
        """Return the Python statements that jump to the block that begins with operation `op`. If another Python
        function has the block, they return the block's number to `_join`."""
        target = self._numbers[op]
        told = [] if target not in self._silent_blocks or self._counted is None else [_store(1, self._counted)]
        if target not in self._here:
            return [*told, _store(0), py.Return(tree.constant(target))]
        if target == self._inner:
            return [py.Continue()]
        return [*told, tree.assign("pc", tree.constant(target)), py.Continue() if self._inner is None else py.Break()]

    def _operation(self, place: int, op: lowering.Op, stop: int) -> list[py.stmt]:
        self.reads = self.observes = False
        self._place = place
        if not lowering.is_silent(op):
            self._counted = place
        statements = self._statements(op)
        if self.observes:
            statements.insert(0, py.Expr(tree.method(tree.name("X"), "observes_at", tree.constant(place))))
        if self.reads:
            statements.insert(0, py.Expr(tree.method(tree.name("X"), "reading_begins")))
        if not lowering.is_silent(op):
            statements = [*self._count_steps(place, stop), *statements]
        for statement in statements:
            tree.place(statement, place + FIRST_LINE)
        return statements

    def _count_steps(self, place: int, stop: int) -> list[py.stmt]:
        """Return the code that counts the step of an operation. The steps of a straight run of operations are counted
        together at its start; if the task's time slice may end within the run, each operation counts its own step."""
        suspended = py.If(tree.not_(tree.name("n")), [tree.yield_(tree.constant(place)), _LOAD_LEFT], [])
        if self._later:
            self._later -= 1
            self._following[place] = self._later
            return [py.If(tree.name("s"), [_COUNT, suspended], [])]
        steps = lowering.run_length(self._lowered.ops, range(place, stop))
        if steps == 1:
            return [_COUNT, suspended]
        self._later = self._following[place] = steps - 1
        taken = py.BinOp(tree.name("n"), py.Sub(), tree.constant(steps))
        enough = tree.compare(tree.name("n"), py.Gt(), tree.constant(steps))
        alone = [tree.assign("s", tree.constant(True)), _COUNT, suspended]
        return [py.If(enough, [tree.assign("n", taken), tree.assign("s", tree.constant(False))], alone)]

    def _statements(self, op: lowering.Op) -> list[py.stmt]:
        return _OPERATIONS[type(op)](self, op)

    def _jump_if(self, op: lowering.JumpIf) -> list[py.stmt]:
        truth = self.truth(op.condition)
        first = [] if op.first is None else self._statement(op.first)
        if self._place in self._branches:
            return [*first, py.If(tree.not_(truth) if op.when else truth, [], [])]
        return [*first, py.If(truth if op.when else tree.not_(truth), self._to(op.target), [])]

    # loops and cases

    def _for_begin(self, op: lowering.ForBegin) -> list[py.stmt]:
        statement = op.statement
        limit, step = f"l{op.slot}", f"s{op.slot}"
        taken: list[py.stmt] = [
            tree.assign("v", self.in_range(statement.first)),
            tree.assign(limit, self.in_range(statement.last)),
        ]
        if _constant_step(statement) is None:
            assert statement.step is not None
            taken.append(tree.assign(step, tree.call("for_step", self.in_range(statement.step))))
        past = tree.not_(self._another_pass(statement, limit, step))
        return [*taken, *self._store(statement.variable, tree.name("v")), py.If(past, self._to(op.target), [])]

    def _for_next(self, op: lowering.ForNext) -> list[py.stmt]:
        statement = op.statement
        limit, step = f"l{op.slot}", f"s{op.slot}"
        known = _constant_step(statement)
        sum_ = py.BinOp(
            self.value(statement.variable), py.Add(), tree.name(step) if known is None else tree.constant(known)
        )
        cells, _, key = self.place(statement.variable, Kind.REAL)
        assert key is not None
        return [
            py.Assign([py.Name("v", py.Store()), py.Subscript(tree.name(cells), key, py.Store())], sum_),
            py.If(self._another_pass(statement, limit, step), self._to(op.target), []),
        ]

    def _another_pass(self, statement: ast.For, limit: str, step: str) -> py.expr:
        up = tree.compare(tree.name("v"), py.LtE(), tree.name(limit))
        down = tree.compare(tree.name("v"), py.GtE(), tree.name(limit))
        known = _constant_step(statement)
        if known is None:
            return py.IfExp(tree.compare(tree.name(step), py.Gt(), tree.constant(0.0)), up, down)
        return up if known > 0.0 else down

    def _case_test(self, op: lowering.CaseTest) -> list[py.stmt]:
        kind = self.kind_of(op.subject)
        subject = tree.name(f"l{op.slot}")
        tests = [self.comparison(subject, "==", self.value(value), kind) for value in op.values]
        return [py.If(tree.not_(tests[0] if len(tests) == 1 else py.BoolOp(py.Or(), tests)), self._to(op.target), [])]

    def _finish(self) -> list[py.stmt]:
        told = [] if self._counted is None else [_store(1, self._counted)]
        return [_store(0), *told, tree.yield_(tree.name("RETURN")), py.Return(None)]

    # statements

    def _statement(self, statement: ast.Assignment | ast.Instruction) -> list[py.stmt]:
        """Return the code of a statement. If the word table requires it, a BREAK (wait until the robot has stopped)
        comes first, unless the statement has a time (AT or IN)."""
        if isinstance(statement, ast.Assignment):
            return self._assignment(statement)
        special = _SPECIAL.get(statement.word)
        statements = special(self, statement) if special else self._instruction(statement)
        if INSTRUCTIONS[statement.word].breaks and not statement.modifiers.has_time:
            statements.insert(0, tree.yield_(tree.name("BREAK")))
        assert self._counted is not None
        return [_store(0), _store(1, self._counted), *statements, _LOAD_LEFT]

    def _assignment(self, statement: ast.Assignment) -> list[py.stmt]:
        target, value = statement.target, statement.value
        if target.sigil == "$":
            return self._store(target, tree.call("storable", self.value(value, Kind.STRING)))
        if not self.may_overflow(value):
            return self._store(target, self.value(value))
        is_real = reads(value, target)
        inside = py.Compare(tree.constant(-LIMIT), [py.LtE(), py.LtE()], [tree.name("v"), tree.constant(LIMIT)])
        check = py.If(tree.not_(inside), [py.Expr(tree.call("within_range", tree.name("v")))], [])
        return [tree.assign("v", self.value(value)), check, *self._store(target, tree.name("v"), is_real=is_real)]

    def _store(self, variable: ast.Variable, value: py.expr, *, is_real: bool = False) -> list[py.stmt]:
        """Return the code that assigns a value to a variable; it raises an error if a location with the same bare name
        exists. `is_real`: the statement has just read the variable as a real, so that no check is needed."""
        (cells, other, key), first = self.place(variable, Kind.REAL), list[py.stmt]()
        constants = [*map(constant_index, variable.indexes or ())]
        if constants and all(constants):
            key = tree.tuple_of([one for one in constants if one]) if len(constants) > 1 else constants[0]
        elif variable.indexes:
            values = [*map(self.value, variable.indexes)]
            method, given = ("index", values[0]) if len(values) == 1 else ("round_indexes", tree.tuple_of(values))
            first.append(tree.assign("i", tree.method(tree.name(cells), method, given)))
            key = tree.name("i")
        assert key is not None
        if other is not None and not is_real:
            denied = py.Expr(tree.method(tree.name(cells), "deny", key))
            check = py.If(tree.compare(key, py.In(), tree.name(KEYS.get(other, other))), [denied], [])
            # do not repeat the check until the next suspension, because until then no other task can change the kind
            if self._real is not None and not variable.indexes and other in KEYS:
                flag = self._real.setdefault(variable.key, f"r{len(self._real)}")
                known = tree.compare(tree.name(flag), py.IsNot(), tree.name("t"))
                check = py.If(known, [check, tree.assign(flag, tree.name("t"))], [])
            first.append(check)
        return [*first, py.Assign([py.Subscript(tree.name(cells), key, py.Store())], value)]

    def _instruction(self, statement: ast.Instruction) -> list[py.stmt]:
        word = INSTRUCTIONS[statement.word]
        rows = (argument_at(word, place) for place in range(len(statement.arguments)))
        arguments = [
            self._operand(statement.word, expression, row)
            for expression, row in zip(statement.arguments, rows, strict=True)
            if row is not None
        ]
        wording: list[py.expr] = [tree.constant(statement_text(statement))]
        if statement.value is not None or statement.modifiers != ast.NO_MODIFIERS:
            wording += (
                tree.constant(None) if word.value is None else self.operand(statement.value, word.value),
                self._stamp(statement.modifiers),
                tree.constant(statement.modifiers.always),
                tree.constant(statement.modifiers.unit),
            )
        if statement.word not in self.library.handlers:
            raise ProgramNotExecutable(f"{statement.word} is not available in a program")
        handler = f"h_{statement.word.replace('.', '__')}"
        self.namespace[handler] = self.library.handlers[statement.word]
        carried_out = tree.call(handler, tree.name("X"), tree.call("Wording", *wording), *arguments)
        return [py.Expr(py.YieldFrom(py.BoolOp(py.Or(), [carried_out, tree.tuple_of(())])))]

    def _operand(self, word: str, expression: ast.Expression | None, row: Argument) -> py.expr:
        if isinstance(expression, ast.Variable) and (word == "PROMPT" or row.shape is Shape.UNIT):
            return self.reference(expression)
        if isinstance(expression, ast.ProgramCall):
            given = tree.tuple_of(map(self.given_to_call, expression.arguments))
            return tree.call("CallProgram", tree.constant(expression.name), given)
        return self.operand(expression, row)

    def _stamp(self, modifiers: ast.Modifiers) -> py.expr:
        if not modifiers.has_time:
            return tree.constant(None)
        times = (modifiers.at, modifiers.within)
        return tree.call("stamp_of", *(tree.constant(None) if time is None else self.in_range(time) for time in times))

    def _wait(self, statement: ast.Instruction) -> list[py.stmt]:
        if not statement.arguments or statement.arguments[0] is None:
            return [tree.yield_(tree.call("Wait", tree.name("at_once"), tree.constant(1)))]
        asked = statement.arguments[0]
        of_val = ast.channel(asked) is not None and self.library.waits_for_signals(self._program)
        truth = self.truth(ast.signals_on((asked,), asked.span) if of_val else asked)
        # pass the Python variables of the program to the condition as default arguments, because as closure variables
        # they would be slower to access in the whole program
        names = {node.id for node in py.walk(truth) if isinstance(node, py.Name)} - self.namespace.keys()
        condition = py.Lambda(tree.parameters(sorted(names), defaults=True), truth)
        # do not yield if the condition is already true, because a loop with such a WAIT must be fast enough for real
        # time
        wait = tree.yield_(tree.call("Wait", tree.name("w")))
        return [
            tree.assign("w", tree.call("guard", condition)),
            py.If(tree.not_(py.Call(tree.name("w"), [], [])), [wait], []),
        ]

    def _call_program(self, op: lowering.Invoke) -> list[py.stmt]:
        """Return the code that calls the direct function bound to the call (`direct`). If its result is 0 or negative,
        the function did not finish; the code then yields to the task, which completes the call."""
        assert self._counted is not None
        by_task = tree.method(
            tree.name("X"),
            "task_call",
            tree.constant(op.called.name),
            tree.constant(op.site),
            tree.name("n"),
            tree.name("m"),
        )
        done = tree.compare(tree.name("m"), py.Gt(), tree.constant(0))
        away = [_store(1, self._counted), tree.yield_(by_task), _LOAD_LEFT]
        return [*self.call_bound(op), py.If(done, [tree.assign("n", tree.name("m"))], away)]

    def call_bound(self, op: lowering.Invoke) -> list[py.stmt]:
        """Return the code that calls the function bound to the call, with the number of steps left in the task's time
        slice, and assigns its result to `m`."""
        given = map(self.given_to_call, op.called.arguments)
        call = tree.call("f", tree.name("X"), tree.name("n"), tree.name("e"), *given)
        return [py.Assign([tree.unpack_target("fe")], tree.item("C", tree.constant(op.site))), tree.assign("m", call)]

    def _call_by_text(self, statement: ast.Instruction) -> list[py.stmt]:
        """Return the code of CALLS, which calls the program whose name is the value of a string expression."""
        called = statement.arguments[0]
        assert called is not None
        text, given = (called.text, called.arguments) if isinstance(called, ast.Applied) else (called, ())
        name = tree.method(self.in_range(text, Kind.STRING), "strip")
        return [tree.yield_(tree.call("CallProgram", name, tree.tuple_of(map(self.given_to_call, given))))]


def _store(place: int, op: int | None = None) -> py.stmt:
    """Return the code that stores `n`, or the operation number `op` if given, in the context's `turn`. `place`: the
    index there: 0 for n, 1 for the operation."""
    target = py.Subscript(tree.name("B"), tree.constant(place), py.Store())
    return py.Assign([target], tree.name("n") if op is None else tree.constant(op))


def _constant_step(statement: ast.For) -> float | None:
    """Return the STEP of a FOR: 1 if it is omitted, its value if it is a constant other than 0. Return None if it must
    be computed at run time."""
    return 1.0 if statement.step is None else ast.plain_number(statement.step) or None


_OPERATIONS: dict[type, Callable[..., list[py.stmt]]] = {
    lowering.Perform: lambda compiler, op: compiler._statement(op.statement),
    lowering.Invoke: lambda compiler, op: compiler._call_program(op),
    lowering.Jump: lambda compiler, op: compiler._to(op.target),
    lowering.JumpIf: ProgramCompiler._jump_if,
    lowering.ForBegin: ProgramCompiler._for_begin,
    lowering.ForNext: ProgramCompiler._for_next,
    lowering.CaseBegin: lambda compiler, op: [
        tree.assign(f"l{op.slot}", compiler.value(op.subject)),
        *compiler._to(op.target),
    ],
    lowering.CaseTest: ProgramCompiler._case_test,
    lowering.Mark: lambda _compiler, _op: [py.Pass()],
    lowering.Finish: lambda compiler, _op: compiler._finish(),
}

_SPECIAL: dict[str, Callable[[ProgramCompiler, ast.Instruction], list[py.stmt]]] = {
    "BREAK": lambda _compiler, _statement: [],  # `_statement` adds the wait, because the row of BREAK has `breaks`
    "WAIT": ProgramCompiler._wait,
    "CALLS": ProgramCompiler._call_by_text,
}


def _join(parts: Sequence[Callable[..., Steps]], firsts: Sequence[int]) -> Callable[..., Steps]:
    """Join the functions of a long program into one. `firsts`: the number of the first block of each function."""
    at = 3 + len(CELLS) + len(KEYS)  # index of `pc` among the arguments

    def program(*arguments: object) -> Steps:
        pc = arguments[at]
        while pc is not None:
            number = bisect_right(firsts, cast(int, pc)) - 1
            pc = yield from parts[number](*arguments[:at], pc, *arguments[at + 1 :])
        return None

    return program


# --- the result --------------------------------------------------------------------------------------------------


class Variant(Struct, frozen=True):
    """A Python function for a program. `arrays`: the arrays that it takes after its fixed arguments; `numbers`: the
    number of each block, by its first operation; `following`: for an operation whose run of steps is counted together,
    the number of steps after it in the run."""

    function: Callable[..., Steps]
    arrays: tuple[Array, ...]
    numbers: Mapping[int, int]
    following: Mapping[int, int]


class Compiled(Struct, frozen=True, dict=True, weakref=True):
    """A compiled program. `lowered`: its operations; `spelling`: the first spelling of each name in the program, by
    key; `array_parameters`: the keys of parameters and private variables that are arrays; `ordinary`: the Python
    function."""

    library: Library
    analysis: Analysis
    lowered: lowering.Lowered
    spelling: Mapping[str, str]
    array_parameters: frozenset[str]
    ordinary: Variant

    @cached_property
    def everywhere(self) -> Variant:
        """Return the variant of the function that can be entered at every operation, compiled on first use."""
        with pause_collector():
            return ProgramCompiler(self.library, self.analysis, self.lowered).variant(everywhere=True)

    def variant(self, op: int) -> Variant:
        """Return a variant of the function that can be entered at operation `op`: the ordinary one if possible."""
        return self.ordinary if op in self.ordinary.numbers else self.everywhere

    def stand(self, step: int) -> int | None:
        """Return the index of the first step at or after `step` that counts as executed, before which the program can
        therefore stop; None if there is none. Indexes count from 0."""
        steps = (op.step for op in self.lowered.ops if op.step >= step and not lowering.is_silent(op))
        return min(steps, default=None)


def compile_program(library: Library, analysis: Analysis) -> Compiled:
    """Compile a program. Raises ProgramNotExecutable if the program has errors."""
    if not analysis.executable:
        raise ProgramNotExecutable(analysis.program.name, "mend its errors first")
    try:
        lowered = lowering.lower(analysis)
        compiler = ProgramCompiler(library, analysis, lowered)
        with pause_collector():
            variant = compiler.variant(everywhere=False)
    except RecursionError:
        raise ProgramNotExecutable(analysis.program.name, "an expression is nested too deeply") from None
    names, arrays = compiler.spelling, frozenset(compiler.array_parameters)
    compiled = Compiled(library, analysis, lowered, names, arrays, variant)
    free_in_parts(compiled, lowered.ops)
    return compiled


def compile_expression(
    library: Library, make: Callable[[ExpressionCompiler], py.expr], kinds: Mapping[str, Kind], own: Sequence[str] = ()
) -> tuple[Callable[..., Any], tuple[Array, ...]]:
    """Compile an expression typed at the prompt. `make`: returns its Python expression; `kinds`: the kinds of the bare
    names that have a value; `own`: the keys of variables that are passed as references (parameters and private
    variables of a stopped program).

    Return a Python function and the arrays that it needs. Its arguments are the context, the cells of each kind, the
    fields of each reference, and the cells of each array.
    """
    compiler = ExpressionCompiler(library, kinds, {key: number for number, key in enumerate(own)})
    value = make(compiler)
    names = ["X", *CELLS.values(), *compiler.parameter_fields(), *compiler.arrays.values()]
    definition = py.FunctionDef("value", tree.parameters(names), [py.Return(value)], [], None)
    return tree.make_function(definition, compiler.namespace), tuple(compiler.arrays)
