"""How fast a program runs: `python -m benchmarks.language [passes]`.

One FOR loop with one assignment, in one run: as compiled for a task (which can stop it at every step), as a plain
loop of a Python module, and as a walk of the same syntax tree. Bar: at most 4 times plain Python.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from statistics import median
from time import perf_counter

from vrs_cli.engine.engine import Engine
from vrs_cli.interfaces.readings import Readings
from vrs_cli.kinematics.model import load_robot
from vrs_cli.language import ast
from vrs_cli.language.analyzer import Analysis, analyze
from vrs_cli.language.environment import Environment
from vrs_cli.language.parser import parse_file
from vrs_cli.language.runtime import Completed, Failed, Task

BAR = 4.0
REPEATS = 5

PROGRAM = """\
.PROGRAM count
    sum = 0
    FOR i = 1 TO passes
        sum = sum+i*2
    END
.END
"""

PYTHON = """\
total = 0.0
for i in range(1, passes + 1):
    total = total + i * 2.0
"""


def analysed(text: str) -> Analysis:
    file, _ = parse_file(text)
    return analyze(next(part for part in file.parts if isinstance(part, ast.Program)))


def compiled(analysis: Analysis, passes: int) -> float:
    """Seconds of the task from its first step to its end."""
    environment = Environment()
    environment.store(analysis)
    environment.reference("passes").assign(float(passes))
    task = Task(environment, Readings(Engine(load_robot("puma560"))), analysis.program.name)
    began = perf_counter()
    while not isinstance(event := task.resume(), Completed):
        assert not isinstance(event, Failed), event
    return perf_counter() - began


def plain(passes: int) -> float:
    """Seconds of a module-level loop of Python."""
    code = compile(PYTHON, "<plain>", "exec")
    began = perf_counter()
    exec(code, {"passes": passes})
    return perf_counter() - began


class Walker:
    """A straightforward interpreter of the tree, for comparison only."""

    def __init__(self, analysis: Analysis, variables: dict[str, float]) -> None:
        self.statements = [step.statement for step in analysis.program.steps]
        self.closers = {block.opener: block.closer for block in analysis.blocks}
        self.openers = {block.closer: block.opener for block in analysis.blocks}
        self.variables = variables
        self.limits: dict[int, float] = {}

    def run(self) -> None:
        step = 0
        while step < len(self.statements):
            step = self.execute(step, self.statements[step])

    def execute(self, step: int, statement: ast.Statement | None) -> int:
        if isinstance(statement, ast.Assignment):
            self.variables[statement.target.key] = self.value(statement.value)
        elif isinstance(statement, ast.For):
            self.variables[statement.variable.key] = self.value(statement.first)
            self.limits[step] = self.value(statement.last)
            return self.tested(step, statement)
        elif isinstance(statement, ast.End):
            opener = self.openers[step]
            loop = self.statements[opener]
            assert isinstance(loop, ast.For)
            self.variables[loop.variable.key] += 1.0
            return self.tested(opener, loop)
        return step + 1

    def tested(self, opener: int, loop: ast.For) -> int:
        inside = self.variables[loop.variable.key] <= self.limits[opener]
        return (opener if inside else self.closers[opener]) + 1

    def value(self, expression: ast.Expression) -> float:
        if isinstance(expression, ast.Number):
            return expression.value
        if isinstance(expression, ast.Variable):
            return self.variables[expression.key]
        assert isinstance(expression, ast.Binary)
        left, right = self.value(expression.left), self.value(expression.right)
        return left + right if expression.operator == "+" else left * right


def walked(analysis: Analysis, passes: int) -> float:
    """Seconds of the walk of the tree."""
    walker = Walker(analysis, {"passes": float(passes)})
    began = perf_counter()
    walker.run()
    return perf_counter() - began


def main(passes: int = 300_000) -> int:
    analysis = analysed(PROGRAM)
    ways: dict[str, Callable[[], float]] = {
        "plain Python loop": lambda: plain(passes),
        "compiled, in a task": lambda: compiled(analysis, passes),
        "walk of the tree": lambda: walked(analysis, passes),
    }
    rounds = [
        {name: way() for name, way in ways.items()} for _ in range(REPEATS)
    ]  # turn by turn: fair to a busy machine
    seconds = {name: median(turn[name] for turn in rounds) for name in ways}
    base = seconds["plain Python loop"]
    print(f"FOR loop with one assignment, {passes} passes, median of {REPEATS}")
    for name, time in seconds.items():
        print(f"  {name:<22}{time / passes * 1e9:8.0f} ns a pass {time / base:8.2f} x")
    ratio = seconds["compiled, in a task"] / base
    print(f"  bar: {BAR:g} x: {'met' if ratio <= BAR else 'MISSED'}")
    return 0 if ratio <= BAR else 1


if __name__ == "__main__":
    sys.exit(main(*map(int, sys.argv[1:])))
