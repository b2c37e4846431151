"""A program while it runs: one task, its stack of programs, its cycles, and what it says to its driver.

A driver calls `resume` until an event says that the program has ended, and does what each event asks for:

    a request of engine.commands   give it to the robot            Wait      resume when its condition is true
    Type, Prompt                   the terminal                    Budget    nothing: look up, then resume
    CycleBegins                    perform its settings            Paused, Failed, Halted, Completed: it has stopped
    StartTask and the like         other tasks, and the robot

A task reads no clock and moves nothing, so the same program gives the same events at any speed. After `Paused`, and
after `Failed`, `resume` goes on with the next step (PROCEED); `retry` before it repeats the step (RETRY).

Reactions are the task's own affair: `signal_changed` tells it of the signals, and it calls what is due between two
steps. A driver that sees one `due` while the task waits may call `react`: the same wait is asked for again after it.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from inspect import GEN_CLOSED, getgeneratorstate
from itertools import islice
from typing import Any, cast

from vrs_cli.engine.commands import Brake, Break, Request
from vrs_cli.errors import ArgumentMismatch, IllegalValue, ProgramNotExecutable, StackOverflow, TimeExhausted, VrsError
from vrs_cli.language import ast
from vrs_cli.language.ast import Kind, Program, Step, Variable
from vrs_cli.language.compiler import Steps, compile_argument, compile_definable, compile_expression
from vrs_cli.language.diagnostics import counted
from vrs_cli.language.effects import (
    CYCLE_SETTINGS,
    AttachRobot,
    CallProgram,
    ControlTask,
    CycleBegins,
    DetachRobot,
    Halt,
    Ignore,
    Lock,
    Pause,
    Prompt,
    ReactToErrors,
    Return,
    ReturnFromError,
    RunSignal,
    SetEvent,
    SignalsSet,
    StartTask,
    Stop,
    Type,
    Wait,
    WaitEvent,
    Yielded,
)
from vrs_cli.language.environment import (
    NO_CELLS,
    SIGIL_KINDS,
    Cells,
    Context,
    Environment,
    Reference,
    Robot,
    StoredProgram,
    key_of,
)
from vrs_cli.language.operands import Definable
from vrs_cli.language.reactions import OF_ERRORS, Reaction, Reactions
from vrs_cli.language.support import by_value, overflow
from vrs_cli.language.units import UnitEffect
from vrs_cli.language.values import Value, kind_of_value

STACK_LIMIT = 10_000  # programs that have called one another
MOST_CYCLES = 32767
BUDGET = 10_000  # steps between two looks at the rest of the world

# --- events ------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class ProgramFault:
    """Where a program stopped with an error. `step` counts from 1; `line` is that of its file; `source` its text.

    `text` is VAL-II's message, `message` the whole of it with what happened and what would be right.
    """

    code: int
    text: str
    message: str
    program: str
    step: int
    line: int
    source: str


@dataclass(frozen=True, slots=True)
class Completed:
    """The last cycle has ended."""

    cycles: int


@dataclass(frozen=True, slots=True)
class Paused:
    """PAUSE: `resume` goes on with the next step."""

    program: str
    step: int


@dataclass(frozen=True, slots=True)
class Halted:
    """HALT: the end."""

    program: str
    step: int


@dataclass(frozen=True, slots=True)
class Failed:
    """A step could not be done. `resume` goes on with the next step, `retry` first repeats it."""

    fault: ProgramFault
    error: VrsError


@dataclass(frozen=True, slots=True)
class Budget:
    """So many steps were done, and nothing is asked for."""


Beside = WaitEvent | SetEvent | RunSignal | StartTask | ControlTask | AttachRobot | DetachRobot
Event = (
    Request | Type | Prompt | Wait | Beside | UnitEffect | CycleBegins | Completed | Paused | Halted | Failed | Budget
)

_BUDGET = Budget()


class _Between:
    """Between two steps, where a reaction can be called: the driver need not know."""


_BETWEEN = _Between()


class TaskState(Enum):
    RUNNING = "running"
    PAUSED = "paused"
    FAILED = "failed"
    HALTED = "halted"
    ABORTED = "aborted"
    COMPLETED = "completed"


# --- the stack ---------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Interruption:
    """What a reaction interrupts: the program's `priority`, and what it was `waiting` for; `failed`: its step did."""

    priority: int
    waiting: Event | None = None
    failed: bool = False


class _Frame:
    """An activation of a program: where it is (`op`), and what it keeps while its generator is replaced.

    `between`: the step `op` has not begun; `reached`: it is the very next thing to be done. `interruption`: it was
    called as a reaction.
    """

    __slots__ = ("_arguments", "_context", "_slots", "between", "interruption", "op", "program", "reached", "steps")

    def __init__(self, context: Context, program: StoredProgram, arguments: Sequence[Reference], step: int = 0) -> None:
        program.check_lineage(vplus=context.robot.switch("VPLUS"))
        compiled = program.compiled
        self.program = program
        self.op = compiled.entry(step)
        self._context = context
        self._arguments = (*arguments, *program.own())
        self._slots = compiled.fresh_slots()
        self.between, self.reached = True, False
        self.interruption: _Interruption | None = None
        self.steps: Steps = compiled.start(context, self._arguments, self._slots, self.op)

    @property
    def step(self) -> int:
        """The present step, from 0."""
        return self.program.compiled.step_of(self.op)

    @property
    def own(self) -> Mapping[str, Reference]:
        """Its arguments and its own variables, by key."""
        analysis = self.program.analysis
        keys = [variable.key for variable in analysis.program.parameters] + [one.key for one in analysis.own]
        return dict(zip(keys, self._arguments, strict=True))

    def enter(self, op: int) -> None:
        """Go on from another operation."""
        self.steps.close()
        self.op, self.between, self.reached = op, True, False
        self.steps = self.program.compiled.start(self._context, self._arguments, self._slots, op)

    def skip(self, more: int = 0) -> None:
        """Go on with the next step, or so many steps after that."""
        end = len(self.program.program.steps)
        self.enter(self.program.compiled.entry(min(self.step + 1 + more, end)))


# --- arguments ---------------------------------------------------------------------------------------------------


def _left_out(environment: Environment, parameter: Variable) -> Reference:
    """What stands for an argument that is not given: undefined until the program assigns it."""
    name = parameter.sigil + parameter.name
    kind = SIGIL_KINDS.get(parameter.sigil, Kind.REAL)
    locations = NO_CELLS if parameter.sigil else Cells(environment, Kind.LOCATION, omitted=name)
    key = None if parameter.indexes is not None else name
    return Reference(Cells(environment, kind, omitted=name), locations, key)


def _checked_argument(
    program: StoredProgram, parameter: Variable, given: Reference, arrays: frozenset[str]
) -> Reference:
    name = f"{parameter.sigil}{parameter.name} of {program.name}"
    kind = SIGIL_KINDS.get(parameter.sigil, Kind.REAL)
    if given.cells.kind is not kind:
        wanted = kind.value if parameter.sigil else "real or a transformation"
        raise ArgumentMismatch(f"{name} is given a {given.cells.kind.value}", f"a {wanted} is wanted")
    if (given.key is None) is not (parameter.key in arrays):
        wanted, got = ("an array", "one value") if given.key is not None else ("one value", "an array")
        raise ArgumentMismatch(f"{name} is given {got}", f"{wanted} is wanted")
    decided = program.analysis.kinds.get(parameter.key)
    wrong = given.locations if decided is Kind.REAL else given.cells
    if decided is not None and given.key in wrong:
        raise ArgumentMismatch(f"{name}: {given.name} is not a {decided.value}", f"a {decided.value} is wanted")
    return given


def bind(
    environment: Environment, program: StoredProgram, arguments: Sequence[Reference | None]
) -> tuple[Reference, ...]:
    """One reference for each parameter. Raises ArgumentMismatch."""
    parameters = program.program.parameters
    if len(arguments) > len(parameters):
        raise ArgumentMismatch(
            f"{program.name} is given {counted(len(arguments), 'argument')}",
            f"it has {counted(len(parameters), 'parameter')}",
        )
    arrays = program.compiled.array_parameters
    padded = (*arguments, *(None,) * (len(parameters) - len(arguments)))
    return tuple(
        _left_out(environment, parameter) if given is None else _checked_argument(program, parameter, given, arrays)
        for parameter, given in zip(parameters, padded, strict=True)
    )


# --- the task ----------------------------------------------------------------------------------------------------


class Task:
    """A program under way: `cycles` times from the top (for ever if negative), the first time from `step` (from 1).

    Arguments are values, or references to variables. Raises UndefinedName for a program that is not there,
    ProgramNotExecutable, ArgumentMismatch, IllegalValue.
    """

    def __init__(
        self,
        environment: Environment,
        robot: Robot,
        program: str | StoredProgram,
        arguments: Sequence[Reference | Value | None] = (),
        cycles: int = 1,
        step: int = 1,
    ) -> None:
        self._context = Context(environment, robot)
        self._main = environment.program(program) if isinstance(program, str) else program
        self._arguments = tuple(self._referred(argument) for argument in arguments)
        self._first_step = self._checked_step(step) - 1
        if cycles == 0 or cycles > MOST_CYCLES:
            raise IllegalValue(f"{cycles} cycles", f"1 to {MOST_CYCLES}, or -1 for ever")
        bind(environment, self._main, self._arguments)
        self.cycles = cycles
        self.cycles_done = 0
        self.steps_done = 0
        self.state = TaskState.RUNNING
        self.fault: ProgramFault | None = None
        self.reactions = Reactions()
        self._frames: list[_Frame] = []
        self._held: Event | None = None
        self._budget = BUDGET
        self._answer: str | None = None
        self._thrown: VrsError | None = None
        self._again = False
        self._life = self._live()

    # for the driver

    def resume(self, answer: str | None = None, budget: int = BUDGET) -> Event:
        """Go on until something is to be done, or `budget` steps have begun. `answer`: the line that Prompt asked for.

        With a budget of 1 the program goes on by single steps: each `Budget` stands before the step `step`.
        After the end the last event is given again.
        """
        self._answer, self._budget = answer, budget
        if not self.ended:
            self.state, self.fault = TaskState.RUNNING, None
        return next(self._life)

    def throw(self, error: VrsError) -> Event:
        """The driver could not do what the last event asked for: the present step fails with that error."""
        self._thrown, self._budget = error, BUDGET
        return next(self._life)

    def signal_changed(self, signal: int, on: bool) -> None:
        """A signal (its number, and its new state) has changed."""
        self.reactions.changed(signal, on)

    def react(self, waiting: Event, budget: int = BUDGET) -> Event:
        """Call the reaction that is `due` now, although the driver has not done yet what the last event, `waiting`,
        asks for: that is asked for again when the reaction has returned."""
        self._held = waiting
        return self.resume(budget=budget)

    def end_cycles(self) -> None:
        """CYCLE.END: the present cycle is the last."""
        self.cycles = self.cycles_done + 1

    def retry(self) -> None:
        """Let `resume` repeat the step that failed or was interrupted."""
        self._again = True

    def abort(self) -> None:
        """The driver stops here. `resume` goes on where it was left."""
        if self.state is TaskState.RUNNING:
            self.state = TaskState.ABORTED

    # for STATUS and messages

    @property
    def ended(self) -> bool:
        """Whether it cannot go on."""
        return self.broken or self.state in (TaskState.COMPLETED, TaskState.HALTED)

    @property
    def broken(self) -> bool:
        """Whether an exception from outside (Ctrl-C) ended it in the middle of a step."""
        return getgeneratorstate(self._life) == GEN_CLOSED

    @property
    def between(self) -> bool:
        """Whether it stands before the step `step`, nothing of which has been done."""
        return bool(self._frames) and self._frames[-1].reached

    @property
    def program(self) -> str:
        """The name of the program that is running: the main one, or one it has called."""
        return self._frames[-1].program.name if self._frames else self._main.name

    @property
    def step(self) -> int:
        """The present step of that program, from 1."""
        return (self._frames[-1].step if self._frames else self._first_step) + 1

    @property
    def stack(self) -> tuple[tuple[str, int], ...]:
        """Programs and their steps (from 1), the main program first."""
        return tuple((frame.program.name, frame.step + 1) for frame in self._frames)

    @property
    def own(self) -> Mapping[str, Reference]:
        """What the program on top has for itself, by key: its arguments, and the variables of AUTO and LOCAL."""
        return self._frames[-1].own if self._frames else {}

    def uses(self, program: str) -> bool:
        """Whether a program is on the stack, so that it cannot be changed."""
        programs = [self._main, *(frame.program for frame in self._frames)]
        return any(one.program.key == key_of(program) for one in programs)

    @property
    def source(self) -> str:
        """The text of the present step."""
        frame = self._frames[-1] if self._frames else None
        return frame.program.source(frame.step) if frame is not None and frame.program.program.steps else ""

    # cycles

    def _live(self) -> Generator[Event, None, None]:
        last = yield from self._cycles()
        while True:
            yield last

    def _cycles(self) -> Generator[Event, None, Completed | Halted]:
        while self.cycles < 0 or self.cycles_done < self.cycles:
            self._begin()
            yield from self._say(CycleBegins(self.cycles_done + 1, CYCLE_SETTINGS))
            halted = yield from self._whole_cycle()
            if halted is not None:
                return halted
            self.cycles_done += 1
            self._frames.clear()
        self.state = TaskState.COMPLETED
        return Completed(self.cycles_done)

    def _whole_cycle(self) -> Generator[Event, None, Halted | None]:
        """To the end of the main program, where the robot comes to rest; what is to be reacted to by then is."""
        while True:
            halted = yield from self._cycle()
            if halted is not None:
                return halted
            self._leave_called()
            if self.reactions.due is None:
                yield from self._say(Break())
            if self.reactions.due is None:
                return None
            main = self._frames[0]
            main.enter(main.program.compiled.entry(len(main.program.program.steps)))

    def _leave_called(self) -> None:
        """After a STOP in a program that was called, or in a reaction."""
        interruptions = (frame.interruption for frame in self._frames[1:])
        outermost = next((one for one in interruptions if one is not None), None)
        if outermost is not None:
            self.reactions.priority = outermost.priority
        del self._frames[1:]

    def _begin(self) -> None:
        arguments = bind(self._context.environment, self._main, self._arguments)
        self._frames = [_Frame(self._context, self._main, arguments, self._first_step)]
        self._first_step = 0
        self.reactions = Reactions()

    def _say(self, event: Event) -> Generator[Event, None, None]:
        """Tell the driver, and again that the step has failed when the driver could not do it."""
        yield event
        failed = isinstance(event, Failed)
        if self._thrown is not None:
            error, self._thrown = self._thrown, None
            if self._reacts_to(error):
                return
            failed = True
            yield self._failed(error)
        if self._held is not None:
            return
        if self._again:
            self._frames[-1].enter(self._frames[-1].op)
        elif failed:
            self._frames[-1].skip()
        self._again = False

    # steps

    def _cycle(self) -> Generator[Event, None, Halted | None]:
        """Until the main program returns or a STOP; the last event where it was a HALT."""
        while True:
            try:
                event = self._advance()
                if isinstance(event, CallProgram):
                    self._call(event)
                    continue
            except VrsError as error:
                if not self._reacts_to(error):
                    yield from self._say(self._failed(error))
                continue
            returns = isinstance(event, Return | ReturnFromError)
            if isinstance(event, Stop) or (returns and len(self._frames) == 1):
                return None
            own = _OWN.get(type(event))
            if returns:
                yield from self._return(cast("Return | ReturnFromError", event))
            elif own is not None:
                own(self.reactions, event)
            elif isinstance(event, Halt):
                self.state = TaskState.HALTED
                return Halted(self.program, self.step)
            elif isinstance(event, Pause):
                self.state = TaskState.PAUSED
                yield from self._say(Paused(self.program, self.step))
            elif not isinstance(event, _Between):
                yield from self._say(cast(Event, event))

    def _return(self, event: Return | ReturnFromError) -> Generator[Event, None, None]:
        """The program on top returns; after a reaction what it interrupted goes on."""
        interruption = self._frames.pop().interruption
        below = self._frames[-1]
        skips = isinstance(event, ReturnFromError)
        if interruption is None:
            if isinstance(event, Return) and event.steps:
                below.skip(event.steps)
            return
        self.reactions.priority = interruption.priority
        if interruption.failed:
            below.enter(below.op)
            if skips:
                below.skip()
        elif interruption.waiting is not None:
            yield from self._say(interruption.waiting)

    def _reaction(self, reaction: Reaction) -> Brake | _Between:
        """Call it. Raises UndefinedName for a program that is there no more."""
        self.reactions.take(reaction)
        waiting, self._held = self._held, None
        self._interrupt(reaction.program, reaction.priority, _Interruption(self.reactions.priority, waiting))
        return Brake() if reaction.immediate else _BETWEEN

    def _reacts_to(self, error: VrsError) -> bool:
        """Call the routine of REACTE, if there is one that may be called and this error is not the end in any case."""
        program = self.reactions.on_error
        if program is None or self.reactions.priority >= OF_ERRORS or isinstance(error, TimeExhausted):
            return False
        self._context.environment.last_error = error.code
        try:
            self._interrupt(program, OF_ERRORS, _Interruption(self.reactions.priority, failed=True))
        except VrsError:
            return False
        return True

    def _interrupt(self, program: str, priority: int, interruption: _Interruption) -> None:
        self._call(CallProgram(program, ()))
        self._frames[-1].interruption = interruption
        self.reactions.priority = priority

    def _advance(self) -> Yielded | Budget | _Between:
        """Steps of the program on top until it yields something else than the number of its next operation.

        With a reaction due, up to the next step only.
        """
        frame, due = self._frames[-1], self.reactions.due
        if due is not None and (frame.between or self._held is not None):
            return self._reaction(due)
        self._held = None
        budget = self._budget if due is None else min(self._budget, 1)
        op, left = frame.op, budget
        try:
            if self._answer is not None:
                answered = self._answered(frame)
                if not isinstance(answered, int):
                    frame.between = frame.reached = False
                    return answered
                op, left = answered, left - 1
            for event in islice(frame.steps, max(left, 0)):
                if event.__class__ is not int:
                    frame.between = frame.reached = False
                    return cast(Yielded, event)
                op = event
                left -= 1
            frame.reached = frame.reached or budget > 0
            frame.between = frame.between or budget > 0
            return _BUDGET if self._budget == budget else _BETWEEN
        except ArithmeticError as error:
            raise overflow(error) from None
        finally:
            frame.op = op
            self.steps_done += budget - left
            self._budget -= budget - left

    def _answered(self, frame: _Frame) -> int | Yielded:
        """What the program says to the answer of a PROMPT."""
        answer, self._answer = self._answer, None
        return frame.steps.send(answer)

    def _call(self, call: CallProgram) -> None:
        if len(self._frames) > STACK_LIMIT:
            raise StackOverflow(f"{STACK_LIMIT} calls deep", f"does {call.name} call itself for ever?")
        environment = self._context.environment
        program = environment.program(call.name)
        self._frames.append(_Frame(self._context, program, bind(environment, program, call.arguments)))

    def _failed(self, error: VrsError) -> Failed:
        frame = self._frames[-1]
        program = frame.program.program
        span = program.steps[frame.step].span if program.steps else program.span
        message = str(error)
        self._context.environment.last_error = error.code
        self.state = TaskState.FAILED
        self.fault = ProgramFault(
            error.code,
            message.split("*")[1],
            message,
            program.name,
            frame.step + 1,
            span.line,
            frame.program.source(frame.step),
        )
        return Failed(self.fault, error)

    # arguments

    def _referred(self, argument: Reference | Value | None) -> Reference | None:
        if argument is None or isinstance(argument, Reference):
            return argument
        return by_value(self._context, argument)

    def _checked_step(self, step: int) -> int:
        steps = len(self._main.program.steps)
        if not 1 <= step <= max(steps, 1):
            raise IllegalValue(f"step {step}", f"{self._main.name} has the steps 1 to {steps}")
        return step


_OWN: dict[type, Callable[[Reactions, Any], None]] = {
    Reaction: Reactions.set,
    SignalsSet: lambda _reactions, _event: None,
    Ignore: lambda reactions, event: reactions.ignore(event.signal),
    Lock: lambda reactions, event: reactions.lock(event.priority),
    ReactToErrors: lambda reactions, event: setattr(reactions, "on_error", event.program),
}


# --- the prompt --------------------------------------------------------------------------------------------------


class _LineTask(Task):
    """One instruction of the prompt: a program of one step, with no cycle around it."""

    def _cycles(self) -> Generator[Event, None, Completed | Halted]:
        self._begin()
        halted = yield from self._cycle()
        self.state = TaskState.COMPLETED
        return halted or Completed(0)


def statement_task(environment: Environment, robot: Robot, statement: ast.Statement) -> Task:
    """An instruction of the prompt as a task of one step; its program has no name.

    Raises ProgramNotExecutable with the first fault that the analyzer finds.
    """
    from vrs_cli.language.analyzer import analyze

    program = Program("", (), (Step(None, statement, None, statement.span),), None, statement.span)
    programs = {key: stored.program for key, stored in environment.programs.items()}
    analysis = analyze(program, environment.kinds(), programs)
    if not analysis.executable:
        raise ProgramNotExecutable(analysis.diagnostics[0].message)
    return _LineTask(environment, robot, StoredProgram(environment, analysis))


def execute_statement(
    environment: Environment, robot: Robot, statement: ast.Statement
) -> Generator[Event, str | None, None]:
    """The events of one instruction at the prompt (DO), in the order a program of that one step gives them.

    `send` the answer to Prompt. An error of the instruction itself is raised; one of a program that it calls is
    `Failed`, the last event.
    """
    task = statement_task(environment, robot, statement)
    answer: str | None = None
    while True:
        event = task.resume(answer)
        if isinstance(event, Completed):
            return
        if isinstance(event, Failed) and not event.fault.program:
            raise event.error
        answer = yield event
        if isinstance(event, Failed | Halted):
            return


class Sight:
    """An expression at the prompt that is looked at again and again, compiled once for each kind its names have."""

    def __init__(self, environment: Environment, robot: Robot, expression: ast.Expression) -> None:
        self._context = Context(environment, robot)
        self._expression = expression
        variables = (node for node in ast.nodes(expression) if isinstance(node, Variable))
        self._keys = tuple(dict.fromkeys(variable.key for variable in variables))
        self._compiled: dict[tuple[object, ...], Callable[..., Value]] = {}

    def value(self, own: Mapping[str, Reference]) -> Value:
        """Its value now, of whichever kind it is. `own`: variables that a program has for itself, which come before
        those of the same names that belong to all. Raises VrsError."""
        used = {key: own[key] for key in self._keys if key in own}
        kinds = {key: kind for key in self._keys if (kind := self._kind(key, used.get(key))) is not None}
        sorts = (*used, None, *kinds.items())
        if sorts not in self._compiled:
            self._compiled[sorts] = compile_expression(self._expression, kinds, tuple(used))
        return self._compiled[sorts](self._context, *used.values())

    def _kind(self, key: str, own: Reference | None) -> Kind | None:
        if own is None:
            return self._context.environment.kind_of(key)
        return kind_of_value(own.value()) if own.key is not None and own.defined() else None


def evaluate(environment: Environment, robot: Robot, expression: ast.Expression) -> Value:
    """The value of an expression at the prompt, of whichever kind it is. Raises VrsError."""
    return Sight(environment, robot, expression).value({})


def arguments_of(
    environment: Environment, robot: Robot, arguments: Iterable[ast.Expression | None]
) -> tuple[Reference | None, ...]:
    """The arguments of EXECUTE at the prompt: variables by reference, as CALL passes them. Raises VrsError."""
    context, kinds = Context(environment, robot), environment.kinds()
    return tuple(compile_argument(argument, kinds)(context) for argument in arguments)


def definable(environment: Environment, robot: Robot, expression: ast.Expression) -> Definable:
    """What HERE and POINT at the prompt define: `a`, `#p`, `row[3]`, or the last name of `a:b`. Raises VrsError."""
    return compile_definable(expression, environment.kinds())(Context(environment, robot))
