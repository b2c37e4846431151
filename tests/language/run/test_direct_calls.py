"""Calls without a task do what calls by the task do: the same events, places of errors, numbers of steps and values,
wherever turns end.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from random import Random
from types import FrameType

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.examples import examples
from tests.language.running import StillRobot, environment_with, program
from vrs_cli.errors import UndefinedName
from vrs_cli.language.run.effects import Budget, CycleBegins, Failed, ProgramCompleted, Type
from vrs_cli.language.run.environment import MAX_BOUND, Environment
from vrs_cli.language.run.runtime import Task, statement_task
from vrs_cli.language.text.ast import DoInstruction
from vrs_cli.language.text.parser import parse_prompt
from vrs_cli.language.words.values import Kind

MOST_EVENTS = 400
NAMES = ("main", "one", "two", "three", "four")
HEADS = {"main": "", "one": "p, q", "two": "p, $t, r[]", "three": "", "four": "p, q, s, t, u, v"}


class Author:
    """Writes programs that call one another, make mistakes, and seldom wait."""

    def __init__(self, random: Random) -> None:
        self.random = random

    def among(self, *lines: str) -> str:
        return self.random.choice(lines)

    def number(self, name: str) -> str:
        known = ["x", "y", "a[1]", "a[i]", "2", "-1.5", "x+1", "(y)", "0", "SIN(x)", "a[2]"]
        return self.among(*known, *{"main": []}.get(name, ["p", "p", "q" if "q" in HEADS[name] else "p"]))

    def given(self, callee: str, name: str) -> str:
        numbers = [self.number(name) for _ in range(6)]
        return {
            "one": f"({', '.join(numbers[: self.random.choice((1, 2, 2, 2))])})",
            "two": f"({numbers[0]}, {self.among('$s', '$s+$u', '($s)')}, a[])",
            "three": "",
            "four": f"({', '.join(numbers)})",
        }[callee]

    def call(self, name: str) -> str:
        later = NAMES[NAMES.index(name) + 1 :]
        if name == "three" and self.random.random() < 0.1:
            return "IF x > 0 THEN\nx = x-1\nCALL three\nEND"
        if not later:
            return "x = x-1"
        callee = self.random.choice(later)
        return f"CALL {callee}{self.given(callee, name)}"

    def condition(self, name: str) -> str:
        return f"{self.number(name)} {self.among('<', '>', '==')} {self.number(name)}"

    def target(self, name: str) -> str:
        known = ["x", "x", "y", "i", "a[1]", "a[i]", "$s", "place"]
        return self.among(*known, *([] if name in ("main", "three") else ["p", "p"]))

    def assignment(self, name: str) -> str:
        target = self.target(name)
        if target == "$s":
            return self.among('$s = "b"', "$s = $u", "$s = $MID($s+$u, 1, 3)", "$s = $ENCODE(x)")
        if target == "place":
            return self.among("SET place = TRANS(2)", "SET place = place:place", "y = DX(place)")
        value = self.among("{}", "{}+1", "{}-{}", "{}*{}", "{}/{}", "{} MOD {}")
        return f"{target} = {value.replace('{}', '%s') % tuple(self.number(name) for _ in range(value.count('{}')))}"

    def lines(self, name: str, depth: int = 0) -> Iterator[str]:
        for _ in range(self.random.randint(1, 3)):
            kind = self.random.random()
            if kind < 0.5 or depth > 1:
                yield self.assignment(name)
            elif kind < 0.7:
                yield self.call(name)
            elif kind < 0.75:
                yield self.among("RETURN", 'TYPE "here", x', "GOTO 100", "RETURN 1", "WAIT x > 0", "STOP")
            else:
                yield from self.block(name, depth + 1)

    def block(self, name: str, depth: int) -> Iterator[str]:
        head, *middles, foot = self.random.choice(
            [
                (f"IF {self.condition(name)} THEN", "END"),
                (f"IF {self.condition(name)} THEN", "ELSE", "END"),
                (f"FOR {self.among('i', 'j')} = 1 TO {self.among('2', '3', '0', 'x')}", "END"),
                (f"WHILE {self.condition(name)} DO", "END"),
                (f"CASE {self.number(name)} OF", f"VALUE {self.number(name)}:", "ANY", "END"),
                ("DO", f"UNTIL {self.condition(name)}"),
            ]
        )
        yield head
        if not head.startswith("CASE"):
            yield from self.lines(name, depth)
        for middle in middles:
            yield middle
            yield from self.lines(name, depth)
        yield foot

    def program(self, name: str) -> str:
        own = ["AUTO q.q, z[]", "LOCAL k"] if name in ("two", "three") and self.random.random() < 0.5 else []
        begin = (
            ["a[2] = 2", "i = 1", "x = 1", "y = 3", "a[1] = 5", "SET place = NULL", '$s = "a"', '$u = "u"']
            if name == "main"
            else []
        )
        begin += [self.among("REACTE three", "REACT 1001, three", "REACTI 1001, three", "IGNORE 1001")] * bool(begin)
        body = [*self.lines(name), *self.lines(name)]
        if name == "main":
            body = ["FOR n = 1 TO 3", *body, *(self.call(name) for _ in range(3)), "END"]
        return program(*own, *begin, *body, "100", name=name, parameters=HEADS[name])


def seen(environment: Environment, task: Task) -> tuple[object, ...]:
    values = [(one.name, one.value) for kind in Kind for one in environment.variables(kind)]
    own = [(key, one.value() if one.key is not None and one.has_value() else None) for key, one in task.own.items()]
    return task.stack, task.steps_done, task.state, task.source, task.is_over, repr(values), repr(own)


def change(environment: Environment, text: str, random: Random) -> None:
    """Give the environment another version of one program, or delete it."""
    name = random.choice(NAMES)
    if random.random() < 0.7:
        environment.programs[name] = environment_with(text.replace("x", "y")).programs[name]
    else:
        environment.programs.pop(name, None)


def history(text: str, seed: int, direct: bool) -> list[tuple[object, ...]]:
    """What is seen after each turn of random length; failed steps are repeated or passed over."""
    random = Random(seed)
    budgets = random.choice([(1,), (1, 2, 3), (5, 50), (7, 1000), (1000,)])
    with pytest.MonkeyPatch.context() as patch:
        if not direct:
            patch.setattr("vrs_cli.language.compile.direct.compile_direct", lambda *_: None)
        environment = environment_with(text)
        task = Task(environment, StillRobot(), "main", cycles=2)
        turns = list[tuple[object, ...]]()
        for _ in range(MOST_EVENTS):
            event = task.resume(budget=random.choice(budgets))
            found = str(event.error) if isinstance(event, Failed) else type(event).__name__
            turns.append((found, *seen(environment, task), task.fault))
            if isinstance(event, ProgramCompleted):
                break
            if isinstance(event, Failed) and random.random() < 0.3:
                task.retry()
            if random.random() < 0.1:
                task.reactions.note_change(1001, True)
            if random.random() < 0.1:
                change(environment, text, random)
        return turns


def calls(environment: Environment) -> int:
    """The number of Python functions that are called while the program main runs."""
    task = Task(environment, StillRobot(), "main")
    counted = list[str]()

    def count(frame: FrameType, event: str, _argument: object) -> None:
        if event == "call":
            counted.append(frame.f_code.co_name)

    before = sys.getprofile()
    sys.setprofile(count)
    try:
        while not isinstance(task.resume(), ProgramCompleted):
            pass
    finally:
        sys.setprofile(before)
    return len(counted)


@pytest.mark.parametrize(
    ("call", "callee", "most"),
    [
        ("CALL one", program(name="one"), 1),
        ("CALL one(x, 2, $s)", program("p = p+q", name="one", parameters="p, q, $r"), 1),
        ("CALL one", program("CALL two", name="one") + program("y = x", name="two"), 2),
        ("CALL one", program("IF SIG(1001) THEN", "END", name="one"), 30),
    ],
)
def test_a_call_calls_few_functions(call: str, callee: str, most: int) -> None:
    fewer, more = (
        calls(environment_with(program("x = 1", '$s = ""', f"FOR i = 1 TO {count}", call, "END") + callee))
        for count in (10, 110)
    )
    assert (more - fewer) / 100 <= most


def test_a_program_that_is_replaced_or_deleted_is_not_called_any_more() -> None:
    text = program("FOR i = 1 TO 20", "CALL one", "END")
    environment = environment_with(text + program("x = x+1", name="one"))
    environment.reference("x").assign(0.0)
    task = Task(environment, StillRobot(), "main")

    def step_until(value: float) -> None:
        for _ in range(100):
            if environment.reference("x").value() == value:
                return
            task.resume(budget=1)
        raise AssertionError(environment.reference("x").value())

    step_until(5.0)
    environment.programs |= environment_with(program("x = x+100", name="one")).programs
    step_until(305.0)
    del environment.programs["one"]
    event = next(event for _ in range(100) if not isinstance(event := task.resume(), CycleBegins | Budget))
    assert isinstance(event, Failed)
    assert isinstance(event.error, UndefinedName)
    assert environment.reference("x").value() == 305.0


def test_a_subroutine_calls_the_new_version_of_a_program_that_types() -> None:
    def typed() -> list[str]:
        task = Task(environment, StillRobot(), "main")
        events = iter(task.resume, ProgramCompleted(1))
        return [event.text for event in events if isinstance(event, Type)]

    text = program("FOR i = 1 TO 4", "CALL one", "END") + program("CALL two", name="one")
    environment = environment_with(text + program('TYPE "old"', name="two"))
    assert typed() == ["old"] * 4
    environment.programs |= environment_with(program('TYPE "new"', name="two")).programs
    assert typed() == ["new"] * 4


def test_calls_are_as_fast_after_many_lines_with_a_call() -> None:
    text = program("FOR i = 1 TO 100", "CALL one", "END") + program(name="one")
    environment = environment_with(text)
    parsed = parse_prompt("DO CALL one")
    assert isinstance(parsed, DoInstruction)
    assert parsed.statement is not None
    for _ in range(MAX_BOUND + 2):
        task = statement_task(environment, StillRobot(), parsed.statement)
        assert isinstance(task.resume(), ProgramCompleted)
        task.close()
    calls(environment)  # compiles the programs
    assert calls(environment) < 200


@given(st.integers(0, 2**32))
@examples(300)
def test_direct_calls_do_what_calls_by_the_task_do(seed: int) -> None:
    author = Author(Random(seed))
    text = "".join(map(author.program, NAMES))
    try:
        environment_with(text)
    except AssertionError:  # the analyzer refuses it
        return
    direct, by_task = (history(text, seed, way) for way in (True, False))
    for ours, theirs in zip(direct, by_task, strict=True):
        assert ours == theirs
