"""Run programs as tasks. A task has a stack of calls, runs the main program in cycles, and yields events to its driver.

The module also carries out lines typed at the prompt: it runs an instruction as a task with one step, and evaluates
expressions.

A driver calls `resume` until an event says that the program has ended, and carries out each event:

    a request of values.commands   pass it to the robot            Wait      resume when its condition is true
    Type, Prompt                   use the terminal                Budget    do other work, then resume
    CycleBegins                    carry out its settings          Pause, Failed, Halt, Completed: the task has stopped
    StartTask, AttachRobot ...     control other tasks, the robot

A task reads no clock and moves nothing, so the same program yields the same events at any speed. After `Pause` or
`Failed`, `resume` continues with the next step (PROCEED), or if `retry` was called, it repeats the step (RETRY).

The driver reports changes of signals to `reactions.note_change`, and the task itself calls reactions between two steps.
If a reaction must be called while the driver is carrying out a wait, the driver may call `react`; after the reaction
the task yields the same wait again.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from itertools import repeat
from operator import methodcaller
from typing import TYPE_CHECKING, Any, cast

from vrs_cli.errors import (
    IllegalValue,
    LimitReached,
    LineMissing,
    ProgramNotExecutable,
    StackOverflow,
    UndefinedValue,
    VrsError,
)
from vrs_cli.language.analysis.analyzer import analyze
from vrs_cli.language.compile.compiler import FIRST_LINE
from vrs_cli.language.compile.lowering import Perform
from vrs_cli.language.compile.python_tree import DIRECT, FILE
from vrs_cli.language.run.effects import (
    CYCLE_SETTINGS,
    OF_ERRORS,
    AwaitLine,
    BrokenOff,
    Budget,
    CallProgram,
    CycleBegins,
    Event,
    Failed,
    Halt,
    LookAround,
    Pause,
    ProgramCompleted,
    Reactions,
    Return,
    Stop,
    TaskState,
    Wait,
)
from vrs_cli.language.run.environment import (
    Activation,
    Environment,
    Executable,
    Interruption,
    at_once,
    by_value,
    evaluator,
    overflow,
)
from vrs_cli.language.run.memory import Context, Definable, StoredProgram
from vrs_cli.language.run.variables import Reference
from vrs_cli.language.text import ast
from vrs_cli.language.text.ast import Program, Statement, Step, Variable
from vrs_cli.language.words.foreign import text_meant, value_given
from vrs_cli.language.words.values import Kind, key_of, kind_of_value
from vrs_cli.values.commands import Brake, Break
from vrs_cli.values.numbers import Value
from vrs_cli.values.results import ProgramFault

if TYPE_CHECKING:
    from vrs_cli.engine.engine import Engine

MAX_CALL_DEPTH = 10_000  # maximum depth of nested calls; above it, a program fails with StackOverflow
MAX_CYCLES = 32767  # maximum number of cycles that EXECUTE accepts
BUDGET = 10_000  # default number of steps that a task performs before it lets the driver do other work
_BUDGET, _LOOK_AROUND = Budget(), LookAround()

Arguments = Sequence[Reference | Value | None]  # arguments of the main program; None for an omitted one


class Task:
    """A running program. It runs `cycles` times from its first step (without end if negative); only the first cycle
    starts at `step` (from 1).

    `arguments`: values, or references to variables. Raises UndefinedName for an unknown program, ProgramNotExecutable
    for one with errors, ArgumentMismatch, and IllegalValue for `cycles` or `step` out of range.
    """

    def __init__(
        self,
        environment: Environment,
        engine: Engine,
        program: str | StoredProgram | Executable,
        arguments: Arguments = (),
        cycles: int = 1,
        step: int = 1,
    ) -> None:
        self._environment = environment
        self.reactions = Reactions()
        self._context = Context(environment, engine, self.reactions)
        stored = environment.program(program) if isinstance(program, str) else program
        main = self._check_allowed(stored if isinstance(stored, Executable) else environment.executable(stored))
        # set to None after the last cycle, so that a deleted program is freed
        self._main: Executable | None = main
        self._name = main.name
        self._arguments = tuple(
            one if one is None or isinstance(one, Reference) else by_value(self._context, one) for one in arguments
        )
        steps = len(main.program.steps)
        if not 1 <= step <= max(steps, 1):
            raise IllegalValue(f"step {step}", f"{self._name} has the steps 1 to {steps}")
        self._first_step = step - 1
        if cycles == 0 or cycles > MAX_CYCLES:
            raise IllegalValue(f"{cycles} cycles", f"1 to {MAX_CYCLES}, or -1 for ever")
        self.cycles = cycles
        self.cycles_done = 0
        self.steps_done = 0
        self.state = TaskState.RUNNING
        self.fault: ProgramFault | None = None
        self._activations: list[Activation] = []
        self._held: Event | None = None
        self._budget = BUDGET
        self._answer: str | None = None
        self._thrown: VrsError | None = None
        self._again = False
        self._begin()
        self._life = self._cycles()

    # for the driver

    def resume(self, answer: str | None = None, budget: int = BUDGET) -> Event:
        """Run until the program yields an event, or until `budget` steps have been carried out, and return the event.
        `answer`: the answer to the last event, such as the line that was read for Prompt.

        With a budget of 1 the program runs in single steps; at each `Budget` event, `step` is the next step. After the
        program has ended, each call returns its last event again.
        """
        self._answer, self._budget = answer, budget
        if not self.is_over:
            self.state, self.fault = TaskState.RUNNING, None
        return next(self._life)

    def throw(self, error: VrsError) -> Event:
        """Make the current step fail with an error, because the driver could not carry out the last event. Return the
        next event."""
        self._thrown, self._budget = error, BUDGET
        return next(self._life)

    def react(self, waiting: Event, budget: int = BUDGET) -> Event:
        """Call the reaction `reactions.due`, although the driver has not finished the last event, `waiting`. The task
        yields this event again after the reaction."""
        self._held = waiting
        return self.resume(budget=budget)

    def end_cycles(self) -> None:
        """Make the current cycle the last one (CYCLE.END)."""
        self.cycles = self.cycles_done + 1

    def retry(self) -> None:
        """Make the next `resume` repeat the step that failed or was interrupted."""
        self._again = True

    def abort(self) -> None:
        """Mark the task as aborted. `resume` continues at the same step."""
        if self.state is TaskState.RUNNING:
            self.state = TaskState.ABORTED

    def close(self) -> None:
        """End the task, which can then not be resumed. This breaks the reference cycle between the task and its
        generator, which a server would not free."""
        self._life.close()

    # for STATUS and messages

    @property
    def is_over(self) -> bool:
        """Return whether the task has ended and cannot be resumed."""
        return self.was_broken_off or self.state in (TaskState.COMPLETED, TaskState.HALTED)

    @property
    def was_broken_off(self) -> bool:
        """Return whether an exception from outside (Ctrl-C) ended the task in the middle of a step."""
        return cast(Any, self._life).gi_frame is None  # true once the generator has ended

    @property
    def between(self) -> bool:
        """Return whether the task has stopped between two steps, so that the step `step` has not begun."""
        return bool(self._activations) and self._activations[-1].reached

    @property
    def program(self) -> str:
        """Return the name of the innermost running program: the main program, or one that it has called."""
        return self._activations[-1].program.name if self._activations else self._name

    @property
    def step(self) -> int:
        """Return the number of the current step in the innermost running program, from 1."""
        return (self._activations[-1].step if self._activations else self._first_step) + 1

    @property
    def stack(self) -> tuple[tuple[str, int], ...]:
        """Return the names and the current step numbers (from 1) of the programs on the call stack, the main program
        first."""
        return tuple((activation.program.name, activation.step + 1) for activation in self._activations)

    @property
    def own(self) -> Mapping[str, Reference]:
        """Return the parameters, AUTO and LOCAL variables of the innermost running program, by key."""
        return self._activations[-1].own if self._activations else {}

    def own_size(self) -> int:
        """Return the size of the AUTO variables of all programs on the call stack: the number of array elements plus
        the number of string characters."""
        return sum(one.size() for activation in self._activations for one in activation.automatic)

    def uses(self, program: str) -> bool:
        """Return whether a program is on the call stack, so that it must not be changed."""
        return any(activation.program.program.key == key_of(program) for activation in self._activations)

    @property
    def operation(self) -> tuple[str, int]:
        activation = self._activations[-1]
        return activation.program.name, activation.op

    def place_of(self, op: int) -> str:
        """Return a message with the name of the innermost running program, and the step number (from 1) and text of its
        operation `op`."""
        program = self._activations[-1].program
        step = program.compilation.lowered.ops[op].step
        return f"{program.name} step {step + 1}: {program.source(step)}"

    @property
    def statement(self) -> Statement | None:
        return self._activations[-1].program.program.steps[self.step - 1].statement

    @property
    def source(self) -> str:
        """Return the text of the current step."""
        return self._activations[-1].program.source(self._activations[-1].step) if self._activations else ""

    # cycles

    def _cycles(self) -> Generator[Event, None, None]:
        """Yield the events of all cycles, then ProgramCompleted repeatedly without end."""
        while self.cycles < 0 or self.cycles_done < self.cycles:
            if not self._activations:
                self._begin()
            begun = self.steps_done
            yield from self._say(CycleBegins(self.cycles_done + 1, CYCLE_SETTINGS))
            yield from self._whole_cycle()
            self.cycles_done += 1
            # count at least one step in each cycle, so that an empty program does not keep other tasks from running
            self.steps_done += self.steps_done == begun
            self._activations.clear()
        self.state, self._main = TaskState.COMPLETED, None
        yield from repeat(ProgramCompleted(self.cycles_done))

    def _whole_cycle(self) -> Generator[Event, None, None]:
        """Run the main program to its end, wait until the robot is at rest, and call the reactions that must be called
        until then."""
        while True:
            yield from self._cycle()
            # after a STOP, remove the calls and reactions above the main program from the call stack
            interruptions = [one.interruption for one in self._activations[1:] if one.interruption is not None]
            if interruptions:
                self.reactions.priority = interruptions[0].priority
            del self._activations[1:]
            if self.reactions.due is None:
                yield from self._say(Break())
            if self.reactions.due is None:
                return
            main = self._activations[0]
            main.enter(main.program.compilation.lowered.entries[-1])

    def _begin(self) -> None:
        assert self._main is not None
        bound, op = self._main.bind(self._arguments), self._main.compilation.lowered.entries[self._first_step]
        self._activations = [Activation(self._context, self._main, bound, op)]
        self._first_step = 0
        self._tried: tuple[Activation, int, float] | None = None
        self.reactions.clear()

    def _check_allowed(self, program: Executable) -> Executable:
        """Check that a program may run, and return it. Raises ProgramNotExecutable if it uses V+ while the switch VPLUS
        is off."""
        if not self._context.engine.settings.switch("VPLUS"):
            program.refuse_beyond_val2()
        return program

    def _say(self, event: Event) -> Generator[Event, None, None]:
        """Yield an event to the driver. If the driver reports by `throw` that it could not carry out the event, call
        the REACTE routine or yield that the step has failed. Then set where the program continues."""
        yield event
        failed = isinstance(event, Failed)
        if self._thrown is not None:
            error, self._thrown = self._thrown, None
            if self._reacts_to(error):
                return
            failed = True
            yield self.fail(error)
        if self._held is not None:
            return
        if self._again:
            self._activations[-1].enter(self._activations[-1].op)
        elif failed:
            self._activations[-1].skip()
        self._again = False

    # steps

    def _cycle(self) -> Generator[Event, None, None]:
        """Run until the main program returns or a STOP ends the cycle. After a HALT, yield its event repeatedly without
        end."""
        while True:
            try:
                event = self._advance()
                if event.__class__ is CallProgram:
                    self._call(event)
                    continue
                if event.__class__ is BrokenOff:
                    frames = reversed(event.frames)
                    self._activations += (Activation(self._context, *frame) for frame in frames)
                    continue
            except LineMissing as missing:
                self._environment.system.put_back()
                yield from self._say(AwaitLine(int(missing.value or 0)))
                self._activations[-1].enter(self._activations[-1].op)
                continue
            except VrsError as error:
                if not self._reacts_to(error):
                    yield from self._say(self.fail(error))
                continue
            if event.__class__ is Return:
                if len(self._activations) == 1:
                    return
                interruption = self._activations.pop().interruption
                if interruption is not None:
                    yield from self._end_reaction(interruption, event.mended)
                elif event.steps:
                    self._activations[-1].skip(event.steps)
            elif isinstance(event, Stop):
                return
            elif isinstance(event, Halt):
                self.state = TaskState.HALTED
                yield from repeat(event)
            elif not isinstance(event, LookAround):
                if isinstance(event, Pause):
                    self.state = TaskState.PAUSED
                yield from self._say(event)

    def _end_reaction(self, interruption: Interruption, mended: bool) -> Generator[Event, None, None]:
        """Return from a reaction to the program that it interrupted. `interruption`: the state of that program;
        `mended`: whether to skip its failed step (RETURNE) rather than repeat it."""
        below = self._activations[-1]
        self.reactions.priority = interruption.priority
        if interruption.failed:
            below.enter(below.op)
            if mended:
                below.skip()
                return
            # wait one tick before the step is repeated at the same time again; a REACTE routine that does not remove
            # the cause would otherwise loop forever without time passing
            if self._tried == (below, below.op, self._context.engine.now):
                yield from self._say(Wait(at_once, 1))
            self._tried = (below, below.op, self._context.engine.now)
        elif interruption.waiting is not None:
            yield from self._say(interruption.waiting)

    def _reacts_to(self, error: VrsError) -> bool:
        """Call the REACTE routine, and return whether it was called. It is not called if there is none, if one is
        already running, or if the error is a limit of the whole run (such as its time)."""
        program = self.reactions.on_error
        if program is None or self.reactions.priority >= OF_ERRORS or isinstance(error, LimitReached):
            return False
        self._environment.last_error = error.code
        try:
            self._interrupt(program, OF_ERRORS, Interruption(self.reactions.priority, failed=True))
        except VrsError:
            return False
        return True

    def _interrupt(self, program: str, priority: int, interruption: Interruption) -> None:
        self._call(CallProgram(program, ()))
        self._activations[-1].interruption = interruption
        self.reactions.priority = priority

    def _advance(self) -> Event:
        """Run the innermost program, and the programs that it calls, until one yields an event or the number of steps
        in the task's time slice is used up. Return the event.

        If a reaction must be called, run only up to the next step and call the reaction there. Raises UndefinedName if
        the program of the reaction is unknown.
        """
        activation = self._activations[-1]
        due = self.reactions.due if self.reactions.waiting else None
        if due is not None and (activation.between or self._held is not None):
            # a reaction is removed when it is called; its program must set it again with REACT, as in the example of
            # the V+ Language User's Guide, pp. 125-126 (certain for V+, likely for VAL-II)
            self.reactions.ignore(due.signal)
            waiting, self._held = self._held, None
            self._interrupt(due.program, due.priority, Interruption(self.reactions.priority, waiting))
            return Brake() if due.immediate else _LOOK_AROUND
        self._held = None
        budget = self._budget if due is None else min(self._budget, 1)
        left, turn = budget, self._context.turn
        turn[0], turn[1] = (budget if budget > 0 else 1), activation.op
        answer = self._answer
        try:
            if budget > 0 or answer is not None:
                self._answer = None
                while (event := activation.steps.send(answer)).__class__ is not int:
                    left, activation.op = turn
                    activation.between = activation.reached = False
                    if event.__class__ is CallProgram and due is None:
                        self._call(event)
                    elif (
                        event.__class__ is Return
                        and due is None
                        and not event.steps
                        and activation.interruption is None
                        and len(self._activations) > 1
                    ):
                        self._activations.pop()
                    else:
                        return cast(Event, event)
                    activation, answer = self._activations[-1], None
                    turn[1] = activation.op
                activation.op, left = event, 0
                activation.between = activation.reached = True
            return _BUDGET if self._budget == budget else _LOOK_AROUND
        except BaseException as error:
            left = self._locate(error)
            if isinstance(error, ArithmeticError):
                raise overflow(error) from None
            raise
        finally:
            self.steps_done += budget - left
            self._budget -= budget - left

    def _locate(self, error: BaseException) -> int:
        """Use the traceback to find the operation that raised an error, and make it current. For each direct call in
        the traceback, add an activation to the call stack. Return how many steps are left in the task's time slice."""
        (activation, left), trace, located = (self._activations[-1], self._context.turn[0]), error.__traceback__, False
        while trace is not None:
            code, op = trace.tb_frame.f_code, trace.tb_lineno - FIRST_LINE
            if code.co_filename != FILE or op < 0:
                pass
            elif code.co_name == DIRECT:
                activation.between = activation.reached = False
                activation.continue_later(activation.op + 1)
                known = trace.tb_frame.f_locals
                program: Executable = known["E"]
                arguments = [known[f"a{number}"] for number in range(len(program.program.parameters))]
                count = program.compilation.lowered.slots
                slots = [known[f"{letter}{number}"] for number in range(count) for letter in "ls"]
                activation = Activation(self._context, program, (*arguments, *known.get("o", ())), op, slots)
                assert program.direct is not None
                self._activations.append(activation)
                left = known["n"] + program.direct.following[op]
            elif not located:
                located, activation.op = True, op
                performed = activation.program.compilation.lowered.ops[op]
                if not (isinstance(performed, Perform) and isinstance(performed.statement, ast.Instruction)):
                    known = trace.tb_frame.f_locals
                    left = known.get("n", left)  # take n from the frame; only before an instruction `turn` has it
                    if not known.get("s", True):  # if the steps of the whole run were counted, do not count later ones
                        left += activation.program.compilation.ordinary.following.get(op, 0)
            trace = trace.tb_next
        return left

    def _call(self, call: CallProgram) -> None:
        if len(self._activations) > MAX_CALL_DEPTH:
            raise StackOverflow(f"{MAX_CALL_DEPTH} calls deep", f"does {call.name} call itself for ever?")
        if call.site is None:
            program = self._environment.executable(self._environment.program(call.name))
        else:
            program = self._activations[-1].program.called(call.site, call.name)
        if program.beyond_val2:  # test this first, because it is cached, while reading the switch VPLUS is slower
            self._check_allowed(program)
        entry = program.compilation.lowered.entries[0]
        self._activations.append(Activation(self._context, program, program.bind(call.arguments), entry))

    def fail(self, error: VrsError) -> Failed:
        """Set the task to failed, because its current step has failed or was ended from outside. Return the event that
        reports the failure."""
        activation = self._activations[-1]
        program = activation.program.program
        span = program.steps[activation.step].span if program.steps else program.span
        statement = program.steps[activation.step].statement if program.steps else None
        types = isinstance(statement, ast.Instruction) and statement.word == "TYPE"
        if types and isinstance(error, UndefinedValue) and error.hint == value_given(error.detail):
            error = error.reworded(hint=text_meant(error.detail))  # TYPE Hello: the user may have meant TYPE "Hello"
        self._environment.last_error = error.code
        self.state = TaskState.FAILED
        self.fault = ProgramFault(
            error.code,
            error.title,
            str(error),
            program.name,
            activation.step + 1,
            span.line,
            activation.program.source(activation.step),
            error.numbers,
            str(error.for_python()) if error.in_python else "",
        )
        return Failed(self.fault, error)


# --- lines typed at the prompt ---------------------------------------------------------------------------------------


class _StepTask(Task):
    """An instruction typed at the prompt, run as a program with one step. It has no cycles, so it does not change
    speeds and modes at its start."""

    def _cycles(self) -> Generator[Event, None, None]:
        yield from self._cycle()
        self.state = TaskState.COMPLETED
        yield from repeat(ProgramCompleted(0))


def statement_task(environment: Environment, engine: Engine, statement: ast.Statement) -> Task:
    """Return a task that carries out an instruction typed at the prompt, as a program with one step and no name. Raises
    ProgramNotExecutable with the first mistake that the analyzer finds."""
    program = Program("", (), (Step(None, statement, None, span=statement.span),), None, span=statement.span)
    analysis = analyze(
        program, environment.kinds, {key: stored.program for key, stored in environment.programs.items()}
    )
    if not analysis.executable:
        raise ProgramNotExecutable(analysis.diagnostics[0].message)
    return _StepTask(environment, engine, Executable(environment, StoredProgram(analysis)))


class WatchedExpression:
    """An expression typed at the prompt that is evaluated repeatedly. It is compiled once for each combination of the
    kinds that its variables have."""

    def __init__(self, environment: Environment, engine: Engine, expression: ast.Expression) -> None:
        self._context = Context(environment, engine)
        self._expression = expression
        self._keys = tuple(dict.fromkeys(node.key for node in ast.nodes(expression) if isinstance(node, Variable)))
        self._compiled: dict[tuple[object, ...], Callable[..., Value]] = {}

    def value(self, own: Mapping[str, Reference]) -> Value:
        """Return the current value, which may be of any kind. `own`: the parameters and private variables of a program
        by key; they hide global variables. Raises VrsError."""
        used = {key: own[key] for key in self._keys if key in own}
        kinds = {key: kind for key in self._keys if (kind := self._kind(key, used.get(key))) is not None}
        sorts = (*used, None, *kinds.items())
        if sorts not in self._compiled:
            self._compiled[sorts] = evaluator(lambda compiler: compiler.item(self._expression), kinds, tuple(used))
        return self._compiled[sorts](self._context, *used.values())

    def _kind(self, key: str, own: Reference | None) -> Kind | None:
        if own is None:
            return self._context.environment.kind_of(key)
        return kind_of_value(own.value()) if own.key is not None and own.has_value() else None


def evaluate(environment: Environment, engine: Engine, expression: ast.Expression) -> Value:
    """Return the value (of any kind) of an expression typed at the prompt. Raises VrsError."""
    return WatchedExpression(environment, engine, expression).value({})


def arguments_of(
    environment: Environment, engine: Engine, arguments: Iterable[ast.Expression | None]
) -> tuple[Reference | None, ...]:
    """Evaluate the arguments of EXECUTE at the prompt. Return a reference for each (None for an omitted one), so that
    the program can change variables, as after CALL. Raises VrsError."""
    context, kinds = Context(environment, engine), environment.kinds
    given = (evaluator(methodcaller("given_to_call", argument), kinds)(context) for argument in arguments)
    return tuple(one if one is None else Reference(*one) for one in given)


def definable(environment: Environment, engine: Engine, expression: ast.Expression) -> Definable:
    """Return the location that HERE or POINT at the prompt defines: `a`, `#p`, `row[3]`, or b in the compound `a:b`.
    Raises VrsError."""
    make = evaluator(lambda compiler: compiler.definable(expression), environment.kinds)
    return cast(Definable, make(Context(environment, engine)))
