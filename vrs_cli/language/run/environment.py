"""Prepare programs to run: the Python names that compiled programs use, programs with their LOCAL variables, and
activations (one record for each running call, with its variables and position)."""

from __future__ import annotations

import ast as py
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import suppress
from functools import cached_property
from itertools import chain
from typing import TYPE_CHECKING, Any, NoReturn, cast
from weakref import WeakKeyDictionary, ref

from msgspec import Struct

from vrs_cli.errors import ArgumentMismatch, ArithmeticOverflow, IllegalValue, ProgramNotExecutable, UndefinedValue
from vrs_cli.kinematics.joints import TURNING, JointUnits
from vrs_cli.kinematics.transform import compose
from vrs_cli.language.analysis import names
from vrs_cli.language.analysis.structure import beyond, waits_for_signals
from vrs_cli.language.compile.compiler import Compiled, compile_expression, compile_program
from vrs_cli.language.compile.expressions import ARGUMENT, CELLS, KEYS, ExpressionCompiler, Library
from vrs_cli.language.run.effects import CallProgram, Event, Return, Wait
from vrs_cli.language.run.memory import (
    NOT_BOUND,
    Bound,
    Context,
    Definable,
    Memory,
    StoredProgram,
    Wording,
    by_task,
    not_bound,
    stamp_of,
)
from vrs_cli.language.run.operations import IN_CONTEXT, OF_VALUES, modulo, power
from vrs_cli.language.run.semantics.input_output import INPUT_OUTPUT
from vrs_cli.language.run.semantics.instructions import MOTIONS, TASKS
from vrs_cli.language.run.variables import NO_CELLS, Cells, Given, RealArgument, Reference, new_variable
from vrs_cli.language.text.ast import Variable
from vrs_cli.language.words import values
from vrs_cli.values.commands import Break
from vrs_cli.values.diagnostics import Diagnostic
from vrs_cli.values.numbers import Value, count

if TYPE_CHECKING:
    from vrs_cli.language.compile.direct import Direct


def for_step(step: float) -> float:
    """Check the STEP of a FOR and return it. Raises IllegalValue for 0."""
    if step == 0.0:
        raise IllegalValue("a STEP of 0", "the loop would never end")
    return step


def setting(name: str, variable: Reference) -> Value:
    """Return the value for `PARAMETER p = name`: the value of the variable `name` if it has one, otherwise the name
    itself as a keyword."""
    return variable.value() if variable.has_value() else name.upper()


def by_value(context: Context, value: Value) -> Reference:
    """Store the value of an argument of CALL in a new unnamed variable, and return a reference to this variable."""
    kind, key = values.kind_of_value(value), ARGUMENT
    reference = new_variable(
        context.environment.spelling, key, values.Kind.REAL if kind is values.Kind.LOCATION else kind
    )
    (reference.locations if kind is values.Kind.LOCATION else reference.cells)[key] = value
    return reference


# cells that contain a real under the key of an argument, so that using any real argument as a transformation raises
# TypeMismatch
_ANY_REAL = RealArgument({ARGUMENT: 0.0})
NO_LOCATION = Cells({}, values.Kind.LOCATION)
NO_LOCATION.others = ref(_ANY_REAL)


def overflow(error: ArithmeticError) -> ArithmeticOverflow:
    """Convert an arithmetic error of Python to an error of VAL-II."""
    return ArithmeticOverflow(
        "division by zero" if isinstance(error, ZeroDivisionError) else "the result is too large for a real"
    )


def guard(condition: Callable[[], float | bool]) -> Callable[[], bool]:
    """Wrap the condition of a WAIT so that it raises only VrsError."""

    def ask() -> bool:
        try:
            return bool(condition())
        except ArithmeticError as error:
            raise overflow(error) from None

    return ask


def at_once() -> bool:
    return True


class Unset:
    """A placeholder for the limit and step of a FOR that has not been carried out. If a jump has entered the loop
    without its FOR, the loop's END compares or adds this value, which raises UndefinedValue."""

    def _say(self, _other: object) -> NoReturn:
        raise UndefinedValue("the limit of FOR", "the loop was entered by a jump past its FOR")

    __lt__ = __le__ = __gt__ = __ge__ = __radd__ = _say


UNSET = Unset()
# if more programs have bound calls, no more direct functions are bound; this limits how deep they nest
MAX_BOUND = 200

# Functions that carry out instructions. They take the values of the operands, and return the requests and effects that
# the program yields. They themselves change variables, signals and timers.
HANDLERS = {**MOTIONS, **INPUT_OUTPUT, **TASKS}

_CALLED: tuple[Callable[..., Any], ...] = (
    *(compose, modulo, power),
    *(for_step, guard, at_once, stamp_of, values.storable, values.whole, values.within_range),
    *(setting, by_value, by_task, CallProgram, Definable, RealArgument, Reference, Wait, Wording),
)
_NAMES: Mapping[str, object] = {  # the globals of compiled programs
    **{one.__name__: one for one in _CALLED},
    "complement": lambda x: values.wrap(~values.integer(x)),
    "bit_and": lambda a, b: values.wrap(values.integer(a) & values.integer(b)),
    "bit_or": lambda a, b: values.wrap(values.integer(a) | values.integer(b)),
    "bit_xor": lambda a, b: values.wrap(values.integer(a) ^ values.integer(b)),
    "NO_LOCATION": NO_LOCATION,
    "NO_CELLS": NO_CELLS,
    "UNSET": UNSET,
    "BREAK": Break(),
    "RETURN": Return(),
}

LIBRARY = Library(_NAMES, OF_VALUES, IN_CONTEXT, HANDLERS, waits_for_signals)


def evaluator(
    make: Callable[[ExpressionCompiler], py.expr], kinds: Mapping[str, values.Kind], own: Sequence[str] = ()
) -> Callable[..., Any]:
    """Compile an expression to a function of the context and of a reference for each variable in `own`. `make`: returns
    the code of the expression; `kinds`: the kinds of the bare names that have a value; `own`: the keys of parameters
    and private variables."""
    function, arrays = compile_expression(LIBRARY, make, kinds, own)

    def evaluate(context: Context, *references: Reference) -> Any:
        cells = context.environment.cells
        try:
            fields = chain.from_iterable(references)
            return function(context, *map(cells, CELLS), *fields, *(cells(*array) for array in arrays))
        except ArithmeticError as error:
            raise overflow(error) from None

    return evaluate


Steps = Generator[int | Event, str | None, int | None]


class Executable:
    """A stored program that can run in a memory, together with its LOCAL variables, which keep their values between
    calls. It is compiled when it first runs."""

    def __init__(self, memory: Environment, stored: StoredProgram) -> None:
        self._memory = memory
        self.program = stored.program
        self.analysis = stored.analysis
        self._lines = stored.lines
        self._ahead: Compiled | None = None
        # by the operation where a call starts: the function, and the arguments that are the same for all these calls
        # (cells of simple variables, block number, cells of arrays)
        self._starts: dict[int, tuple[Callable[..., Steps], list[object], int, list[Cells]]] = {}

    @property
    def name(self) -> str:
        return self.program.name

    def source(self, step: int) -> str:
        """Return the text of a step as in the file. `step`: its index, from 0."""
        return StoredProgram(self.analysis, self._lines).source(step)

    @cached_property
    def compilation(self) -> Compiled:
        """Return the compiled program. Raises ProgramNotExecutable if the program has errors."""
        compiled, self._ahead = self._ahead or compile_program(LIBRARY, self.analysis), None
        for key, name in compiled.spelling.items():
            self._memory.spelling.setdefault(key, name)
        return compiled

    def compile_ahead(self, *, everywhere: bool) -> None:
        """Compile the program in advance, in any thread, so that its first run does not have to wait. `everywhere`:
        also compile the variant that can be entered at any step. A program with errors is left uncompiled."""
        known: Compiled | None = self.__dict__.get("compilation") or self._ahead
        with suppress(ProgramNotExecutable):
            known = self._ahead = known or compile_program(LIBRARY, self.analysis)
            if everywhere:
                # no block of the ordinary variant begins at operation -1, so this compiles the variant `everywhere`
                known.variant(op=-1)

    def start(self, context: Context, arguments: Sequence[Given], slots: list[object], op: int) -> Steps:
        """Return the generator of a call that starts at operation `op`. `arguments`: a reference for each parameter,
        then for each private variable.

        `slots`: the limits and steps of FOR loops and the subjects of CASEs, all UNSET at first; the generator stores
        them here when it ends.
        """
        known = self._starts.get(op)
        if known is None:
            variant = self.compilation.variant(op)
            arrays = [self._memory.cells(*array) for array in variant.arrays]
            known = self._starts[op] = variant.function, self._cells, variant.numbers[op], arrays
        function, cells, block, arrays = known
        return function(context, *cells, slots, block, *chain.from_iterable(arguments), *arrays)

    @cached_property
    def _cells(self) -> list[object]:
        """Return the arguments that all calls share: the cells of simple variables, views of their keys, and the bound
        calls."""
        simple = {name: self._memory.cells(kind) for kind, name in CELLS.items()}
        return [*simple.values(), *(simple[name].keys() for name in KEYS), self.calls]

    @cached_property
    def calls(self) -> list[Bound]:
        """Return, for each CALL in this program, the Python function and the called program that are bound to it."""
        return [NOT_BOUND] * len(self.compilation.lowered.calls)

    def called(self, site: int, name: str) -> Executable:
        """Return the program `name` for the CALL number `site`, and bind it to this CALL. At the second execution of
        the CALL, also bind the program's direct function, if it can have one. Raises UndefinedName."""
        callee: Executable | None
        function, callee = self.calls[site]
        if callee is None:
            callee = self._memory.executable(self._memory.program(name))
            self._memory.programs.bound.add(self)
            self.calls[site] = function, callee
        elif function is not_bound:
            direct = callee.direct if self._direct_calls(site, callee) else None
            if direct is None and self.__dict__.get("direct") is not None:
                # callers must not use the direct function of this program any more, because it now calls a program
                # that may wait
                self._memory.programs.unbind(self)
            if direct is None:
                self.direct = None
            self.calls[site] = by_task if direct is None else direct.function, callee
        return callee

    def _direct_calls(self, site: int, callee: Executable) -> bool:
        """Return whether a CALL can use the called program's direct function: the arguments must have the right kinds,
        and the called program must not call this one again, directly or indirectly."""
        given, rows = self.compilation.lowered.calls[site].called.arguments, callee._parameters
        if callee.direct is None or len(given) != len(rows) or len(self._memory.programs.bound) > MAX_BOUND:
            return False
        for argument, (kind, is_array, _) in zip(given, rows, strict=True):
            array = isinstance(argument, Variable) and not argument.grouped and argument.many
            if argument is None or is_array is not array:
                return False
            have = names.kind_of(argument, lambda it: values.SIGIL_KINDS.get(it.sigil)) or values.Kind.REAL
            if kind is not (values.Kind.REAL if have is values.Kind.LOCATION else have):
                return False
        reached = [callee]
        for program in reached:
            if program is self:
                return False
            reached += (one for _, one in program.calls if one is not None and one not in reached)
        return True

    @cached_property
    def direct(self) -> Direct | None:
        """Return the program's direct function (see `compile.direct`), or None if only a task can run the program."""
        from vrs_cli.language.compile.direct import compile_direct

        made = compile_direct(LIBRARY, self.analysis, self.compilation.lowered)
        if made is not None:
            arrays = (self._memory.cells(*array) for array in made.arrays)
            made.function.__defaults__ = (*self._cells, *arrays)
        return made

    def own(self) -> tuple[Reference, ...]:
        """Return references to the private variables for a new call: new AUTO variables, and the LOCAL variables, which
        all calls share."""
        kept = iter(self._local)
        spelling = self._memory.spelling
        return tuple(
            next(kept) if row is None else new_variable(spelling, row[0], row[1], array=row[2], automatic=True)
            for row in self._automatic
        )

    @cached_property
    def _automatic(self) -> tuple[tuple[str, values.Kind, bool] | None, ...]:
        """Return, for each private variable, its key, its kind, and whether it is an array if it is AUTO; None if it is
        LOCAL."""
        for own in self.analysis.own:
            self._memory.spelling.setdefault(own.key, self.compilation.spelling.get(own.key, own.key))
        return tuple(
            (own.key, values.kind_of_name(own.key), own.array) if own.automatic else None for own in self.analysis.own
        )

    @cached_property
    def _local(self) -> tuple[Reference, ...]:
        return tuple(
            new_variable(self._memory.spelling, it.key, values.kind_of_name(it.key), array=it.array)
            for it in self.analysis.own
            if not it.automatic
        )

    def local_size(self) -> int:
        """Return the size of the LOCAL variables: the number of array elements plus the number of string characters."""
        made: tuple[Reference, ...] = self.__dict__.get("_local", ())
        return sum(reference.size() for reference in made)

    @cached_property
    def _parameters(self) -> tuple[tuple[values.Kind, bool, int | None], ...]:
        """Return, for each parameter: its kind; whether it is an array; and, if the program decides that a bare name is
        a real or a transformation, the index in a reference of the cells of the other kind, which must not contain
        it."""
        other = {values.Kind.REAL: 1, values.Kind.LOCATION: 0, None: None}
        return tuple(
            (
                values.kind_of_name(one.sigil),
                one.key in self.compilation.array_parameters,
                None if one.sigil else other[self.analysis.kinds.get(one.key)],
            )
            for one in self.program.parameters
        )

    def bind(self, arguments: Sequence[Given | None]) -> Sequence[Given]:
        """Check the arguments of a call, and return a reference for each parameter. Raises ArgumentMismatch."""
        rows = self._parameters
        if len(arguments) == len(rows):
            for given, (kind, is_array, other) in zip(arguments, rows, strict=True):
                if given is None or given[0].kind is not kind or (given[2] is None) is not is_array:
                    break
                if other is not None and given[2] in (given[1] if other else given[0]):
                    break
            else:
                return cast("Sequence[Given]", arguments)
        parameters = self.program.parameters
        if len(arguments) > len(parameters):
            raise ArgumentMismatch(
                f"{self.name} is given {count(len(arguments), 'argument')}",
                f"it has {count(len(parameters), 'parameter')}",
            )
        padded = (*arguments, *(None,) * (len(parameters) - len(arguments)))
        return tuple(map(self._bind_one, parameters, padded))

    def _bind_one(self, parameter: Variable, argument: Given | None) -> Reference:
        """Return the reference for one parameter. For an omitted argument (None), it is a new variable without a value.
        Raises ArgumentMismatch."""
        given = None if argument is None else Reference(*argument)
        typed = parameter.sigil + parameter.name
        name, kind = f"{typed} of {self.name}", values.kind_of_name(parameter.sigil)
        is_array = parameter.key in self.compilation.array_parameters
        if given is None:
            array = parameter.indexes is not None
            form = f"{self.name}({', '.join(one.sigil + one.name for one in self.program.parameters)})"
            return new_variable(self._memory.spelling, typed, kind, array=array, omitted=form)
        if given.cells.kind is not kind:
            wanted = f"a {kind.value}" if parameter.sigil else "a real or a transformation"
            raise ArgumentMismatch(f"{name} is given a {given.cells.kind.value}", f"{wanted} is wanted")
        if (given.key is None) is not is_array:
            wanted, got = ("one value", "an array") if given.key is None else ("an array", "one value")
            raise ArgumentMismatch(f"{name} is given {got}", f"{wanted} is wanted")
        decided = self.analysis.kinds.get(parameter.key)
        if decided is not None and given.key in (given.locations if decided is values.Kind.REAL else given.cells):
            raise ArgumentMismatch(f"{name}: {given.name} is not a {decided.value}", f"a {decided.value} is wanted")
        return given

    @cached_property
    def beyond_val2(self) -> tuple[Diagnostic, ...]:
        """Return an error for each word or form in the program that only V+ has."""
        return tuple(beyond(self.program, vplus=False))

    def refuse_beyond_val2(self) -> None:
        """Raise ProgramNotExecutable if the program has a word or form that only V+ has."""
        if self.beyond_val2:
            first = self.beyond_val2[0]
            lines = [step.span.line for step in self.program.steps]
            raise ProgramNotExecutable(
                f"{self.name}, step {lines.index(first.span.line) + 1}: {first.detail}", first.hint
            )


class Interruption(Struct, frozen=True):
    """The state of a program that a reaction interrupts. `priority`: its priority; `waiting`: the event that the driver
    had not finished, or None; `failed`: whether a failed step started the reaction (REACTE)."""

    priority: int
    waiting: Event | None = None
    failed: bool = False


def _started_later(
    program: Executable, context: Context, arguments: Sequence[Given], slots: list[object], op: int
) -> Steps:
    """Start a call at operation `op` only when the task resumes it, because starting there may first require compiling
    the variant `everywhere`."""
    return (yield from program.start(context, arguments, slots, op))


class Activation:
    """A running call of a program. `op`: its current operation; `steps`: the generator that runs it, which is replaced
    when the program continues at another operation.

    `between`: whether the operation `op` has not begun; `reached`: whether the program has run up to `op` and stopped
    before it. `interruption`: the state of the interrupted program, if this is the call of a reaction. Arguments of the
    constructor for a direct call that the task continues: `slots` (see `Executable.start`), and `called` (whether the
    operation has already made its call).
    """

    __slots__ = ("_arguments", "_context", "_slots", "between", "interruption", "op", "program", "reached", "steps")

    def __init__(
        self,
        context: Context,
        program: Executable,
        arguments: Sequence[Given],
        op: int,
        slots: Sequence[object] | None = None,
        called: bool = False,
    ) -> None:
        self.program, self._context, self.op = program, context, op
        self.between, self.reached = not called, False
        self.interruption: Interruption | None = None
        self.steps: Steps
        if slots is None:
            self._arguments = (*arguments, *program.own()) if program.analysis.own else arguments
            self._slots: list[object] = [UNSET] * (2 * program.compilation.lowered.slots)
            self.steps = program.start(context, self._arguments, self._slots, op)
        else:
            self._arguments, self._slots = arguments, list(slots)
            self.continue_later(op + called)

    def continue_later(self, op: int) -> None:
        """Make the call continue at operation `op` when the task resumes it."""
        self.steps = _started_later(self.program, self._context, self._arguments, self._slots, op)

    @property
    def step(self) -> int:
        """Return the index of the current step, from 0."""
        return self.program.compilation.lowered.ops[self.op].step

    @property
    def automatic(self) -> tuple[Reference, ...]:
        return tuple(self.own[declared.key] for declared in self.program.analysis.own if declared.automatic)

    @property
    def own(self) -> Mapping[str, Reference]:
        """Return references to the parameters and private variables, by key."""
        parameters, own = self.program.program.parameters, self.program.analysis.own
        keys = [variable.key for variable in parameters] + [one.key for one in own]
        return {key: Reference(*given) for key, given in zip(keys, self._arguments, strict=True)}

    def enter(self, op: int) -> None:
        """Stop the generator, and make the call continue at operation `op`."""
        self.steps.close()
        self.op, self.between, self.reached = op, True, False
        self.steps = self.program.start(self._context, self._arguments, self._slots, op)

    def skip(self, more: int = 0) -> None:
        """Make the call continue with the next step, or `more` steps after that step."""
        end = len(self.program.program.steps)
        self.enter(self.program.compilation.lowered.entries[min(self.step + 1 + more, end)])


class Environment(Memory):
    """A memory that can also run its programs. It keeps one Executable for each stored program, which is freed when the
    program is deleted or replaced and no task uses it."""

    def __init__(self, seed: int = 0, units: JointUnits = TURNING) -> None:
        super().__init__(seed, units)
        self._executables: WeakKeyDictionary[StoredProgram, Executable] = WeakKeyDictionary()

    def executable(self, stored: StoredProgram) -> Executable:
        if (known := self._executables.get(stored)) is None:
            known = self._executables[stored] = Executable(self, stored)
        return known

    def size_of_all(self) -> int:
        """Return the size of all variables, including LOCAL ones: the number of array elements plus the number of
        string characters."""
        return self.size() + sum(
            one.local_size()
            for stored, one in self._executables.items()
            if self.programs.get(one.program.key) is stored
        )
