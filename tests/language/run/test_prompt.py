"""Instructions and expressions at the prompt."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.language.running import StillRobot, drive, environment_with, program
from vrs_cli.errors import ArithmeticOverflow, ProgramNotExecutable, UndefinedValue
from vrs_cli.kinematics.transform import IDENTITY, translation
from vrs_cli.language.run.effects import Event, Failed, Halt, ProgramCompleted, Prompt
from vrs_cli.language.run.environment import Environment
from vrs_cli.language.run.runtime import Task, arguments_of, definable, evaluate, statement_task
from vrs_cli.language.text import ast
from vrs_cli.language.text.parser import parse_prompt
from vrs_cli.language.words.values import Kind
from vrs_cli.values.commands import Move


def execute_statement(environment: Environment, line: ast.Statement) -> Iterator[Event]:
    """The events of one instruction at the prompt. An error of the instruction itself is raised."""
    task = statement_task(environment, StillRobot(), line)
    while not isinstance(event := task.resume(), ProgramCompleted | Halt):
        if isinstance(event, Failed) and not event.fault.program:
            raise event.error
        yield event
        if isinstance(event, Failed):
            return


def statement(line: str) -> ast.Statement:
    parsed = parse_prompt(f"DO {line}")
    assert isinstance(parsed, ast.DoInstruction)
    assert parsed.statement is not None
    return parsed.statement


def test_one_instruction_at_the_prompt() -> None:
    environment = Environment()
    assert list(execute_statement(environment, statement("x = 2*3"))) == []
    assert environment.reference("x").value() == 6.0
    events = list(execute_statement(environment, statement("MOVE #PPOINT(0) AT 2")))
    assert [type(event) for event in events] == [Move]


def test_an_error_at_the_prompt_is_raised() -> None:
    with pytest.raises(UndefinedValue, match="nothing"):
        list(execute_statement(Environment(), statement("x = nothing")))


def test_a_program_called_from_the_prompt_fails_with_its_place() -> None:
    environment = environment_with(program("x = 1/0"))
    events = list(execute_statement(environment, statement("CALL main")))
    assert isinstance(events[-1], Failed)
    assert events[-1].fault.program == "main"


def test_a_prompt_at_the_prompt_is_answered() -> None:
    environment = Environment()
    task = statement_task(environment, StillRobot(), statement('PROMPT "n? ", n'))
    assert task.resume() == Prompt("n? ", 1)
    assert task.resume("7") == ProgramCompleted(0)
    assert environment.reference("n").value() == 7.0


def test_what_the_analyzer_refuses_is_not_executed() -> None:
    with pytest.raises(ProgramNotExecutable):
        statement_task(Environment(), StillRobot(), statement("MOVE 5"))


def argument(line: str) -> ast.Expression:
    """The expression of `x = ...`, or the argument of an instruction."""
    parsed = statement(line)
    if isinstance(parsed, ast.Assignment):
        return parsed.value
    assert isinstance(parsed, ast.Instruction)
    first = parsed.arguments[0]
    assert first is not None
    return first


def test_expressions_are_evaluated() -> None:
    environment = Environment()
    environment.reference("n").assign(4.0)
    environment.reference("p").assign(translation(1, 0, 0))
    robot = StillRobot()
    assert evaluate(environment, robot, argument("x = n*SQRT(4)")) == 8.0
    assert evaluate(environment, robot, argument("TYPE p")) == translation(1, 0, 0)
    assert evaluate(environment, robot, argument("MOVE p:p")) == translation(2, 0, 0)
    assert evaluate(environment, robot, argument('$x = "a"+$CHR(98)')) == "ab"
    with pytest.raises(ArithmeticOverflow):
        evaluate(environment, robot, argument("x = 1/0"))
    with pytest.raises(UndefinedValue, match="missing"):
        evaluate(environment, robot, argument("TYPE missing"))


def test_arguments_of_execute_are_those_of_call() -> None:
    environment = environment_with(program("a = a*b", parameters="a, b, c"))
    environment.reference("n").assign(4.0)
    call = argument("CALL main(n, 2+1)")
    assert isinstance(call, ast.ProgramCall)
    references = arguments_of(environment, StillRobot(), (*call.arguments, None))
    assert references[2] is None
    drive(Task(environment, StillRobot(), "main", references), StillRobot())
    assert environment.reference("n").value() == 12.0


def test_definable_places() -> None:
    environment = Environment()
    robot = StillRobot()
    environment.reference("jig").assign(translation(1, 0, 0))
    definable(environment, robot, argument("HERE jig:part")).define(translation(3, 0, 0))
    assert environment.reference("part").value() == translation(2, 0, 0)
    assert definable(environment, robot, argument("HERE #p")).reference.cells.kind is Kind.PRECISION
    definable(environment, robot, argument("HERE row[2]")).define(IDENTITY)
    assert environment.reference("row", 2).value() == IDENTITY
