"""Lines of the prompt: instructions as tasks of one step, and the values of expressions."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Mapping
from itertools import repeat
from operator import methodcaller
from typing import TYPE_CHECKING

from vrs_cli.errors import ProgramNotExecutable
from vrs_cli.language.analysis.analyzer import analyze
from vrs_cli.language.run.effects import Event, ProgramCompleted, TaskState
from vrs_cli.language.run.environment import Environment, Executable, evaluator
from vrs_cli.language.run.memory import Context, Definable, StoredProgram
from vrs_cli.language.run.runtime import Task
from vrs_cli.language.run.variables import Reference
from vrs_cli.language.text import ast
from vrs_cli.language.text.ast import Program, Step, Variable
from vrs_cli.language.words.values import Kind, kind_of_value
from vrs_cli.values.numbers import Value

if TYPE_CHECKING:
    from vrs_cli.engine.engine import Engine


class _StepTask(Task):
    """One instruction of the prompt: a program of one step, with no cycle around it."""

    def _cycles(self) -> Generator[Event, None, None]:
        yield from self._cycle()
        self.state = TaskState.COMPLETED
        yield from repeat(ProgramCompleted(0))


def statement_task(environment: Environment, engine: Engine, statement: ast.Statement) -> Task:
    """An instruction of the prompt as a task of one step; its program has no name.

    Raises ProgramNotExecutable with the first fault that the analyzer finds.
    """
    program = Program("", (), (Step(None, statement, None, span=statement.span),), None, span=statement.span)
    programs = {key: stored.program for key, stored in environment.programs.items()}
    analysis = analyze(program, environment.kinds(), programs)
    if not analysis.executable:
        raise ProgramNotExecutable(analysis.diagnostics[0].message)
    return _StepTask(environment, engine, Executable(environment, StoredProgram(analysis)))


class WatchedExpression:
    """An expression at the prompt that is looked at again and again, compiled once for each kind its names have."""

    def __init__(self, environment: Environment, engine: Engine, expression: ast.Expression) -> None:
        self._context = Context(environment, engine)
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
            self._compiled[sorts] = evaluator(lambda compiler: compiler.item(self._expression), kinds, tuple(used))
        return self._compiled[sorts](self._context, *used.values())

    def _kind(self, key: str, own: Reference | None) -> Kind | None:
        if own is None:
            return self._context.environment.kind_of(key)
        return kind_of_value(own.value()) if own.key is not None and own.defined() else None


def evaluate(environment: Environment, engine: Engine, expression: ast.Expression) -> Value:
    """The value of an expression at the prompt, of whichever kind it is. Raises VrsError."""
    return WatchedExpression(environment, engine, expression).value({})


def arguments_of(
    environment: Environment, engine: Engine, arguments: Iterable[ast.Expression | None]
) -> tuple[Reference | None, ...]:
    """The arguments of EXECUTE at the prompt: variables by reference, as CALL passes them. Raises VrsError."""
    context, kinds = Context(environment, engine), environment.kinds()
    return tuple(evaluator(methodcaller("argument_of_call", argument), kinds)(context) for argument in arguments)


def definable(environment: Environment, engine: Engine, expression: ast.Expression) -> Definable:
    """What HERE and POINT at the prompt define: `a`, `#p`, `row[3]`, or the last name of `a:b`. Raises VrsError."""
    evaluate = evaluator(lambda compiler: compiler.definable(expression), environment.kinds())
    made: Definable = evaluate(Context(environment, engine))
    return made
