"""How fast a program runs, and how fast a file is checked: `python -m benchmarks.language [passes]`.

One FOR loop with one assignment, in one run: as compiled for a task (which can stop it at every step), as a plain
loop of a Python module, and as a walk of the same syntax tree. Bar: at most 4 times plain Python.

Single statements in that loop (assignments, IF, SIN, elements of arrays, strings, $ENCODE, CALL with no, one and six
arguments), each beside the same line of Python, less the loop itself.

One program of 10,000 steps, in one run: compiled by us, and as many lines of Python compiled by Python.

A file of 10,000 lines, in one run: all that `vrs check` does with it, and the same lines through the same grammar by
Lark alone, with its own lexer and positions, building trees. All lines but END are different, in every round: the
parser remembers lines, and remembers none of these. Bar: at least 0.6 of the lines a second of bare Lark.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from itertools import count
from statistics import median
from time import process_time

from lark import Lark

from vrs_cli.engine.engine import Engine
from vrs_cli.interfaces.inspection import inspect
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.language.analysis.analyzer import analyze
from vrs_cli.language.analysis.names import Analysis
from vrs_cli.language.compile.compiler import compile_program
from vrs_cli.language.run.effects import Failed, ProgramCompleted
from vrs_cli.language.run.environment import LIBRARY, Environment
from vrs_cli.language.run.runtime import Task
from vrs_cli.language.text import ast
from vrs_cli.language.text.parser import parse_file
from vrs_cli.values.diagnostics import Severity

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


def analysed(text: str) -> list[Analysis]:
    """The programs of a text, the one to run first."""
    file, _ = parse_file(text)
    return [analyze(part) for part in file.parts if isinstance(part, ast.Program)]


def compiled(programs: Sequence[Analysis], passes: int) -> float:
    """CPU seconds of the task from its first step to its end."""
    environment = Environment()
    for analysis in programs:
        environment.store(analysis)
    environment.reference("passes").assign(float(passes))
    task = Task(environment, Engine(load_robot("puma560")), programs[0].program.name)
    began = process_time()
    while not isinstance(event := task.resume(), ProgramCompleted):
        assert not isinstance(event, Failed), event
    return process_time() - began


def plain(passes: int, text: str = PYTHON, before: str = "") -> float:
    """CPU seconds of a module-level loop of Python."""
    code, known = compile(text, "<plain>", "exec"), {"passes": passes}
    exec(before, known)
    began = process_time()
    exec(code, known)
    return process_time() - began


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
    """CPU seconds of the walk of the tree."""
    walker = Walker(analysis, {"passes": float(passes)})
    began = process_time()
    walker.run()
    return process_time() - began


# --- statements --------------------------------------------------------------------------------------------------

STATEMENTS = (  # what it is; a line of VAL-II, the subroutine that it calls; the line of Python, what stands before it
    ("nothing", "", "", "pass", ""),
    ("x = i", "x = i", "", "x = i", ""),
    ("IF i > 5 THEN", "IF i > 5 THEN\n END", "", "if i > 5: pass", ""),
    ("x = SIN(i)", "x = SIN(i)", "", "x = sin(radians(i))", "from math import sin, radians"),
    ("a[7] = a[7]+1", "a[7] = a[7]+1", "", "a[7] = a[7] + 1.0", "a = {7: 0.0}"),
    ("a[i] = i", "a[i] = i", "", "a[int(i)] = i", "a = {}"),
    ('$s = $t+"b"', '$s = $t+"b"', "", 's = t + "b"', 't = "a"'),
    ("$s = $ENCODE(/F8.2, i)", "$s = $ENCODE(/F8.2, i)", "", 's = f"{i:8.2f}"', ""),
    ("CALL sub", "CALL sub", ".PROGRAM sub\n.END\n", "sub()", "def sub(): pass"),
    ("CALL sub(i)", "CALL sub(i)", ".PROGRAM sub(p)\n.END\n", "sub(i)", "def sub(p): pass"),
    (
        "CALL sub(i, 1, 2, 3, x, y)",
        "CALL sub(i, 1, 2, 3, x, y)",
        ".PROGRAM sub(p, q, r, s, t, u)\n t = p+q\n.END\n",
        "x = sub(i, 1.0, 2.0, 3.0, x, y)",
        "x = y = 0.0\ndef sub(p, q, r, s, t, u): return p + q",
    ),
)


def statement_times(passes: int) -> Iterator[tuple[str, float, float]]:
    """Yield each statement with its time, and that of the same line of Python [ns], less those of an empty loop."""
    empty, *others = [_loop(*row[1:]) for row in STATEMENTS]
    for row, loop in zip(STATEMENTS[1:], others, strict=True):
        rounds = [
            [compiled(program, passes) for program, _, _ in (empty, loop)]
            + [plain(passes, text, before) for _, text, before in (empty, loop)]
            for _ in range(REPEATS)
        ]
        nothing, ours, python_nothing, theirs = map(min, zip(*rounds, strict=True))
        yield row[0], (ours - nothing) / passes * 1e9, (theirs - python_nothing) / passes * 1e9


def _loop(line: str, called: str, python: str, before: str) -> tuple[list[Analysis], str, str]:
    """Return a loop around a line as a program, and as Python with the lines before it."""
    first = 'y = 0\n $t = "a"\n a[7] = 0\n'
    program = analysed(f".PROGRAM main\n {first} FOR i = 1 TO passes\n {line}\n END\n.END\n{called}")
    return program, f"for i in map(float, range(1, passes + 1)):\n    {python}\n", before


def statements(passes: int) -> None:
    """Print what single statements cost, less the loop, beside the same lines of Python."""
    print(f"single statements in a loop of {passes} passes, without it, minimum of {REPEATS}")
    for name, ours, theirs in statement_times(passes):
        print(f"  {name:<28}{ours:8.0f} ns {theirs:8.0f} ns of Python {ours / max(theirs, 1.0):8.1f} x")


# --- checking ----------------------------------------------------------------------------------------------------

CHECK_BAR = 0.6
LINES = 10_000
CHECK_REPEATS = 3
BODY = """\
    x = x+SQRT(y*y+#)*COS(angle)
    MOVE SHIFT(part BY #, 0, 0):grip
    APPRO part, #
    IF (x > #) AND (y =< 10) THEN
        TYPE "x is ", /F8.2, x+#
        SIGNAL x+#, -2
    END
    FOR i = 1 TO #
        SET part = SHIFT(part BY dx, dy, #)
        CALL other(part, x, #)
    END
""".splitlines()  # each # is a number that no other line has
NUMBERS = count(1)
# the statements of BODY for a lexer of Lark's own: it cannot tell an operation from a name as the tables do
BARE_GRAMMAR = r"""
step: (assign | operation)? NEWLINE
assign: NAME "=" expression
operation: WORD (item (","? item)*)?
?item: expression | FORMAT | LINK | "=" expression
?expression: term (OPERATOR term)*
?term: NUMBER | STRING | NAME arguments? | "-" term | "(" expression ")"
arguments: "(" (item (","? item)*)? ")"
file: step*
WORD.3: /(MOVE|APPRO|IF|TYPE|SIGNAL|END|FOR|SET|CALL)\b/
LINK.3: /(TO|BY|THEN)\b/
OPERATOR.2: /AND\b|=<|>|\+|\*|:/
FORMAT: /\/[A-Z][0-9.]*/
NAME: /[a-zA-Z][\w.]*/
NUMBER: /[0-9]+(\.[0-9]*)?/
STRING: /"[^"]*"/
NEWLINE: /\n/
%ignore /[ \t]+/
"""


def numbered(lines: list[str]) -> list[str]:
    """Return lines with other numbers than all lines before."""
    return [line.replace("#", str(next(NUMBERS))) for line in lines]


def long_file() -> str:
    """Return programs of a hundred lines, up to 10,000, with lines that were never read before."""
    programs = []
    for number in range(LINES // 100):
        body = numbered(BODY * 8)
        programs.append("\n".join((f".PROGRAM p{number}", *body, *[""] * (98 - len(body)), ".END")))
    return "\n".join(programs) + "\n"


def checked(text: str) -> float:
    """Seconds of everything that `vrs check` does with a text."""
    began = process_time()
    found = inspect(text, load_robot("puma560"))
    seconds = process_time() - began
    assert not any(one.severity is Severity.ERROR and one.code == -450 for one in found), found[0]
    return seconds


def bare(text: str) -> float:
    """Seconds of Lark alone: its LALR parser with its contextual lexer and positions, trees built, nothing checked."""
    lark = Lark(BARE_GRAMMAR, start="file", parser="lalr", propagate_positions=True)
    steps = "\n".join(line for line in text.splitlines() if not line.startswith(".")) + "\n"
    began = process_time()
    lark.parse(steps)
    return process_time() - began


def checking() -> bool:
    """Whether the bar of checking is met; prints the figures."""
    checked(long_file())  # the parser's tables are read
    texts = [long_file() for _ in range(CHECK_REPEATS)]
    ours, theirs = (median(column) for column in zip(*[(checked(text), bare(text)) for text in texts], strict=True))
    lines = texts[0].count("\n")
    print(f"vrs check of {lines} lines, median of {CHECK_REPEATS}")
    print(f"  {'vrs check':<22}{lines / ours:8.0f} lines/s {theirs / ours:8.2f} x")
    print(f"  {'bare Lark, positions':<22}{lines / theirs:8.0f} lines/s {1:8.2f} x")
    print(f"  bar: {CHECK_BAR:g} x: {'met' if theirs / ours >= CHECK_BAR else 'MISSED'}")
    return theirs / ours >= CHECK_BAR


# --- compiling ---------------------------------------------------------------------------------------------------

# what BODY would be in Python, line by line
PYTHON_BODY = """\
x = x + sqrt(y * y + #) * cos(angle)
move(compose(shift(part, (#, 0, 0)), grip))
appro(part, #)
if x > # and y <= 10:
    print("x is ", f"{x + #:8.2f}")
    signal(x + #, -2)
    pass
for i in range(1, #):
    part = shift(part, (ddx, ddy, #))
    other(part, x, #)
    pass
""".splitlines()


def compiling() -> None:
    """Print what it costs to compile one program of 10,000 steps, beside Python compiling as many lines of its own."""
    body = [line.replace("dx, dy", "ddx, ddy") for line in BODY]
    blocks = LINES // len(body)
    (analysis,) = analysed("\n".join((".PROGRAM long", *numbered(body * blocks), ".END", "")))
    lines, text = len(body) * blocks, "\n".join(numbered(PYTHON_BODY * blocks))

    def seconds(act: Callable[[], object]) -> float:
        began = process_time()
        act()
        return process_time() - began

    rounds = [
        (seconds(lambda: compile_program(LIBRARY, analysis)), seconds(lambda: compile(text, "<plain>", "exec")))
        for _ in range(REPEATS)
    ]
    ours, theirs = (median(column) for column in zip(*rounds, strict=True))
    print(f"compiling a program of {lines} steps, median of {REPEATS}")
    print(f"  {'compiled for a task':<22}{ours / lines * 1e6:8.1f} us a step {ours / theirs:8.2f} x")
    print(f"  {'Python, as many lines':<22}{theirs / lines * 1e6:8.1f} us a line {1:8.2f} x")


# --- all of them -------------------------------------------------------------------------------------------------


def main(passes: int = 300_000) -> int:
    programs = analysed(PROGRAM)
    (analysis,) = programs
    ways: dict[str, Callable[[], float]] = {
        "plain Python loop": lambda: plain(passes),
        "compiled, in a task": lambda: compiled(programs, passes),
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
    statements(passes // 10)
    compiling()
    return 0 if checking() and ratio <= BAR else 1


if __name__ == "__main__":
    sys.exit(main(*map(int, sys.argv[1:])))
