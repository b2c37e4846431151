"""Find steps with constants that would fail in every run, or ask for more than full speed, without running the program.

Operands are evaluated and instructions are carried out by the code that runs programs, but in a separate memory with a
separate robot. So the messages are the same as in a run, and each rule is written only once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from enum import Enum
from functools import partial

from msgspec import Struct

from vrs_cli import errors
from vrs_cli.engine.settings import FULL_SPEED
from vrs_cli.language.analysis.names import VARIABLES
from vrs_cli.language.analysis.structure import waits_for_signals
from vrs_cli.language.compile.expressions import WORDS, word_of
from vrs_cli.language.run.effects import CallProgram
from vrs_cli.language.run.environment import HANDLERS, evaluator, for_step
from vrs_cli.language.run.memory import Context, Wording, stamp_of
from vrs_cli.language.run.operations import IN_CONTEXT
from vrs_cli.language.text import ast
from vrs_cli.language.words.functions import FUNCTIONS, Function
from vrs_cli.language.words.instructions import INSTRUCTIONS
from vrs_cli.language.words.values import Kind, plain
from vrs_cli.language.words.word import Argument, Shape, State, argument_at
from vrs_cli.values import commands
from vrs_cli.values.diagnostics import Diagnostic, Span, warning
from vrs_cli.values.numbers import Value

NEVER_RIGHT = (
    errors.IllegalValue,
    errors.IllegalSignal,
    errors.IllegalJoint,
    errors.ArithmeticOverflow,
    errors.NegativeSquareRoot,
)
CHECKED_BY_THE_ROBOT = (
    commands.SetSpeed,
    commands.SetMonitorSpeed,
    commands.SetAcceleration,
    commands.SetDuration,
    commands.SetParameter,
    commands.SetConfiguration,
)
# values tried in place of an unknown real; if all cause the same error, any number is assumed to cause this error
STAND_INS = (1.0, 8.0, 32.0)
TAKE_CHANNELS = frozenset({"WAIT", "IFSIG"})  # instructions in which a bare number may be a channel of VAL
# kinds of operand in which a name is kept as a name, not replaced by the variable's value
NAMED = frozenset({Shape.UNIT, Shape.SETTING})
REALS = NAMED | {Shape.REAL, Shape.GROUP, Shape.SIGNALS, Shape.TASK}


class Gap(Enum):
    """A placeholder for an operand whose value is not known before the program runs."""

    REAL = "any real"
    OTHER = "anything else"


Given = Value | CallProgram | Gap | None


class Constants(Struct, frozen=True):
    """A check that tries out a program's constants. `context`: a separate memory and robot, which must not be used for
    anything else."""

    context: Context

    def findings(self, program: ast.Program) -> Iterator[Diagnostic]:
        """Yield a warning for each constant that would make its step fail in every run. It is only a warning, because a
        run may never reach the step."""
        channelled = TAKE_CHANNELS if waits_for_signals(program) else TAKE_CHANNELS - {"WAIT"}
        for statement in program.statements:
            with suppress(RecursionError):  # ignore expressions that are nested too deeply; the compiler refuses them
                yield from self._in_expressions(_expressions(statement, channelled)) or self._whole(statement)

    def above_full_speed(self, program: ast.Program) -> Iterator[Diagnostic]:
        """Yield a warning for each constant speed or acceleration above full speed, because a run limits it without a
        message."""
        limited = (
            one for one in program.statements if isinstance(one, ast.Instruction) and one.word in ("SPEED", "ACCEL")
        )
        found = (one for statement in limited for one in self._instruction(statement))
        yield from (one for one in found if one.code == errors.AboveFullSpeed.code)

    # --- expressions ---

    def _in_expressions(self, expressions: Iterable[ast.Expression]) -> list[Diagnostic]:
        """Return a diagnostic for each constant expression whose evaluation fails. It marks the smallest part of the
        expression that fails."""
        return [found for expression in expressions for found in self._expression(expression)]

    def _expression(self, expression: ast.Expression) -> list[Diagnostic]:
        if not _evaluable(expression):
            return self._in_expressions(ast.children(expression))
        if (error := _error(lambda: self._evaluate(expression), (*NEVER_RIGHT, errors.UsageError))) is None:
            return []
        named = next((one for one in ast.children(expression) if isinstance(one, ast.BareWord)), expression)
        return self._in_expressions(ast.children(expression)) or [_wrong(named.span, error)]

    def _value(self, expression: ast.Expression) -> Value | Gap:
        """Return the value of an expression if it is constant, otherwise Gap.REAL."""
        if isinstance(expression, ast.StringConstant):
            return expression.value
        if (number := ast.plain_number(expression)) is not None:
            return number
        return self._evaluate(expression) if _constant(expression) else Gap.REAL

    def _evaluate(self, expression: ast.Expression) -> Value:
        value: Value = evaluator(lambda compiler: compiler.item(expression), {})(self.context)
        return value

    # --- statements ---

    def _whole(self, statement: ast.Statement) -> Iterator[Diagnostic]:
        """Yield the mistakes of a statement as a whole, once its expressions are found to be correct."""
        if isinstance(statement, ast.For):
            yield from self._check(statement.step, for_step)
        elif isinstance(statement, ast.Instruction):
            yield from self._check(statement.modifiers.at, lambda seconds: stamp_of(seconds, None))
            yield from self._check(statement.modifiers.within, lambda seconds: stamp_of(None, seconds))
            yield from self._instruction(statement)

    def _check(self, expression: ast.Expression | None, check: Callable[[float], object]) -> Iterator[Diagnostic]:
        value = None if expression is None else self._value(expression)
        if expression is not None and isinstance(value, float) and (error := _error(lambda: check(value))) is not None:
            yield _wrong(expression.span, error)

    def _instruction(self, statement: ast.Instruction) -> Iterator[Diagnostic]:
        if statement.word not in HANDLERS:
            return
        row = INSTRUCTIONS[statement.word]
        places = [*statement.arguments, statement.value]
        rows = [*(argument_at(row, place) for place in range(len(statement.arguments))), row.value]
        given = [self._operand(expression, argument) for expression, argument in zip(places, rows, strict=True)]
        error, *others = [None] if Gap.OTHER in given else self._outcomes(statement, given)
        # if all the tried numbers cause the same error, assume that every number does
        if error is not None and all(str(other) == str(error) for other in others):
            yield _wrong(self._culprit(statement, given, error), error)

    def _operand(self, expression: ast.Expression | None, argument: Argument | None) -> Given:
        if expression is None:
            return None
        if argument is None:
            return Gap.OTHER
        if argument.shape is Shape.PROGRAM:
            return CallProgram("", ())
        if argument.shape in WORDS or isinstance(expression, ast.BareWord):
            return word_of(expression)
        if argument.shape in REALS and not (argument.shape in NAMED and isinstance(expression, ast.Variable)):
            return self._value(expression)
        return expression.value if isinstance(expression, ast.StringConstant) else Gap.OTHER

    def _outcomes(self, statement: ast.Instruction, given: Sequence[Given]) -> list[errors.VrsError | None]:
        """Carry out an instruction with each of the numbers in STAND_INS in place of its unknown operands. Return the
        error of each trial, or None."""
        stand_ins = STAND_INS if Gap.REAL in given else STAND_INS[:1]
        filled = [[x if isinstance(one, Gap) else one for one in given] for x in stand_ins]
        carry_out = partial(self._carry_out, statement)
        return [
            _error(partial(carry_out, *operands), (*NEVER_RIGHT, errors.NotAvailable, errors.AboveFullSpeed))
            for operands in filled
        ]

    def _carry_out(self, statement: ast.Instruction, *operands: object) -> None:
        *arguments, value = operands
        stamp = commands.Stamp(0.0) if statement.modifiers.has_time else None
        it = Wording("", value, stamp, statement.modifiers.always, statement.modifiers.unit)
        for request in HANDLERS[statement.word](self.context, it, *arguments) or ():
            if isinstance(request, CHECKED_BY_THE_ROBOT):
                self.context.engine.perform(request)
                _check_limited(request)

    def _culprit(self, statement: ast.Instruction, given: Sequence[Given], error: errors.VrsError) -> Span:
        """Return the span of the operand that causes an error: the last one for which other numbers do not cause the
        same error. Return the span of the whole statement if there is none."""
        places = list(enumerate((*statement.arguments, statement.value)))
        for place, expression in reversed(places):
            if expression is not None and isinstance(given[place], float):
                without = [*given[:place], Gap.REAL, *given[place + 1 :]]
                if all(str(other) != str(error) for other in self._outcomes(statement, without)):
                    return expression.span
        return statement.span


def _check_limited(request: commands.Request) -> None:
    """Raise AboveFullSpeed if a request sets a speed or an acceleration above 100 %."""
    if isinstance(request, commands.SetAcceleration):
        what, percent = "ACCEL", request.acceleration
    elif isinstance(request, commands.SetSpeed) and request.unit is commands.SpeedUnit.PERCENT:
        what, percent = "SPEED", request.value
    else:
        return
    if percent > FULL_SPEED:
        raise errors.AboveFullSpeed(f"{what} {plain(percent)}", f"the robot does {FULL_SPEED:g} % at most")


def _error(act: Callable[[], object], wrong: tuple[type[errors.VrsError], ...] = NEVER_RIGHT) -> errors.VrsError | None:
    """Call `act`, and return the error that it raises if this is one of `wrong`, otherwise None. Other errors depend on
    the run (for example a program that is not in memory), so they are ignored."""
    try:
        act()
    except wrong as error:
        return error
    except errors.VrsError:
        pass
    return None


# --- expressions that can be evaluated -------------------------------------------------------------------------


def _expressions(statement: ast.Statement, channelled: frozenset[str]) -> Iterator[ast.Expression]:
    signals = isinstance(statement, ast.Instruction) and statement.word in channelled
    for one in ast.children(statement):
        yield one if not signals or ast.channel(one) is None else ast.signals_on((one,), one.span)


def _constant(expression: ast.Expression) -> bool:
    """Return whether an expression has the same value in every run."""
    if isinstance(expression, ast.Call):
        function = FUNCTIONS.get(expression.name)
        if function is None or function.name in IN_CONTEXT or not _by_value(function):
            return False
    elif not isinstance(expression, ast.Number | ast.StringConstant | ast.Unary | ast.Binary):
        return False
    return all(map(_constant, ast.children(expression)))


def _evaluable(expression: ast.Expression) -> bool:
    """Return whether an expression should be evaluated to find mistakes: an operation or a function with constant
    operands. A function that returns a transformation is not evaluated, because it accepts any numbers."""
    if isinstance(expression, ast.Unary | ast.Binary):
        return ast.plain_number(expression) is None and _constant(expression)
    function = FUNCTIONS.get(expression.name) if isinstance(expression, ast.Call) else None
    if function is None or function.result is Kind.LOCATION or not function.arguments:
        return False
    return _by_value(function) and all(
        isinstance(one, ast.BareWord) or _constant(one) for one in ast.children(expression)
    )


def _wrong(place: Span, error: errors.VrsError) -> Diagnostic:
    return warning(type(error), place, error.detail, error.hint)


def _by_value(function: Function) -> bool:
    """Return whether a function only needs the values of its arguments, and does not change a variable."""
    return function.state is State.SUPPORTED and not any(row.shape in VARIABLES for row in function.arguments)
