"""Lines of the prompt with numbers that nobody would type: every setting, argument and function gets its extremes.

The generator is passed in, so that a seed names its lines.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from random import Random

from vrs_cli.engine.parameters import PARAMETERS
from vrs_cli.language.words.functions import FUNCTIONS
from vrs_cli.language.words.instructions import INSTRUCTIONS
from vrs_cli.language.words.monitor import COMMANDS
from vrs_cli.language.words.word import GROUPED, Argument, Shape, Word

EXTREMES = (
    *("0", "-0", "0.0", "1E-320", "-1E-320", "5E-324", "2.3E-308", "1E-100", "1E-38", "1E-12", "1E-9", "1E-4"),
    *("1E308", "-1E308", "1.7976931348623157E308", "9E37", "1E38", "-1E38", "1E39", "1E150", "-1E150", "1E30", "1E16"),
    *("1E12", "1E9", "1E7", "1E6", "-1E6", "123456789.123456789", "4194304", "4194303.999999999", "86400", "86401"),
    *("8388607", "8388608", "-8388608", "-8388609", "16777216", "2147483648", "4294967296", "9007199254740993"),
    *("0.49999999999999994", "0.9999999999999999", "1.0000000000000002", "-1", "0.5", "-0.5", "1E999", "1E-999"),
    *("TRUE", "PI", "1E308*1E308", "1E-320/3", "-(1E38)", "0/1E-300", "SQRT(1E300)", "2**1023", "(-8)**(1/3)", "1/3"),
)
USUAL = ("1", "2", "3", "5", "10", "30", "45", "90", "100", "-20", "180", "-180", "266", "320", "0.1", "1001", "2001")
PLACES = ("HERE", "DEST", "NULL", "a", "b", "#p", "SAFE", "TOOL", "BASE")
LEFT_OUT = frozenset({"EXIT", "QUIT", "SEE", "REPLAY", "PROMPT"})  # they leave, fill the screen, or take time of ours
WIDE = frozenset({"SPEED", "ACCEL", "DURATION", "PARAMETER", "TOOL", "BASE", "DRIVE", "JOG", "MOVE", "MOVES", "DELAY"})
LONGEST_NUMBER = 3  # nested in each other


def line(random: Random) -> str:
    """Any line."""
    word = random.choice(_chosen() if random.random() < 0.5 else _all())
    if word.name == "PARAMETER":
        return f"PARAMETER {random.choice(tuple(PARAMETERS))} = {number(random)}"
    grouped = [one for one in word.arguments if one.shape in GROUPED]
    others = [one for one in word.arguments if one.shape not in GROUPED]
    group = f"({', '.join(_operand(random, one) for one in grouped)})" if grouped else ""
    said = f"{word.name} {group}{_arguments(random, others)}"
    if word.value is not None and random.random() < 0.9:
        said += f" = {_operand(random, word.value)}"
    return said + _modifier(random, word)


@cache
def _all() -> tuple[Word, ...]:
    return tuple(word for table in (INSTRUCTIONS, COMMANDS) for word in table.values() if word.name not in LEFT_OUT)


@cache
def _chosen() -> tuple[Word, ...]:
    """Those whose numbers make motions."""
    return tuple(word for word in _all() if word.name in WIDE)


def number(random: Random, depth: int = 0) -> str:
    chance = random.random()
    if chance < 0.55:
        return random.choice(EXTREMES)
    if chance < 0.85 or depth >= LONGEST_NUMBER:
        return random.choice(USUAL)
    if chance < 0.9:
        return repr(random.uniform(-1.0, 1.0) * 10.0 ** random.uniform(-330.0, 308.0)).replace("e", "E")
    return _function(random, Shape.REAL, depth)


def _function(random: Random, shape: Shape, depth: int) -> str:
    wanted = tuple(one for one in FUNCTIONS.values() if one.arguments)
    row = random.choice(wanted)
    said = ", ".join(_operand(random, one, depth + 1) for one in row.arguments)
    return f"{row.name}({said})" if shape is Shape.REAL else f"TRANS({said})"


def _place(random: Random, depth: int = 0) -> str:
    def numbers(count: int) -> str:
        return ", ".join(number(random, depth + 1) for _ in range(count))

    return random.choice(
        (
            lambda: random.choice(PLACES),
            lambda: f"TRANS({numbers(6)})",
            lambda: f"#PPOINT({numbers(6)})",
            lambda: f"SHIFT(HERE BY {numbers(3)})",
            lambda: f"HERE:TRANS({numbers(6)})",
            lambda: f"RX({numbers(1)}):RY({numbers(1)})",
            lambda: f"INVERSE(TRANS({numbers(6)}))",
            lambda: f"SCALE(HERE BY {numbers(1)})",
        )
    )()


def _operand(random: Random, it: Argument, depth: int = 0) -> str:
    lead = f"{it.lead} " if it.lead else ""
    make = _OPERANDS.get(it.shape)
    return lead + (number(random, depth) if make is None else make(random, depth))


_OPERANDS: Mapping[Shape, Callable[[Random, int], str]] = {
    Shape.PLACE: _place,
    Shape.LOCATION: _place,
    Shape.STRING: lambda r, d: r.choice((f"$ENCODE({number(r, d)})", f'$MID("abc", {number(r, d)}, 2)', '"a"', "$s")),
    Shape.VARIABLE: lambda r, d: r.choice(("a", "#p", "$s", "x", f"x[{number(r, d)}]")),
    Shape.REAL_VARIABLE: lambda r, d: r.choice(("x", f"y[{number(r, d)}]", f"m[{number(r, d)}, {number(r, d)}]")),
    Shape.LOCATION_VARIABLE: lambda r, d: r.choice(("a", "#p", f"b[{number(r, d)}]")),
    Shape.STRING_VARIABLE: lambda r, _d: r.choice(("$s", "$t[2]")),
    Shape.PROGRAM: lambda r, d: r.choice(("main", f"main({number(r, d)})", "other")),
    Shape.ITEM: lambda r, d: r.choice((number(r, d), f"/F{r.randint(0, 20)}.{r.randint(0, 20)}, {number(r, d)}", "/S")),
    Shape.FILE: lambda r, _d: r.choice(("f.v2", "g.vrst", "none")),
    Shape.SWITCH: lambda r, _d: r.choice(("POWER", "CP", "UPPER", "TRACE")),
    Shape.SETTING: lambda r, d: r.choice(("X", "TRZ", "1", "6", number(r, d))),
    Shape.BRANCH: lambda r, _d: r.choice(("main", "trial")),
    Shape.WORD: lambda r, d: r.choice(("a", number(r, d))),
    Shape.INSTRUCTION: lambda r, d: f"DRIVE {number(r, d)}, {number(r, d)}, {number(r, d)}",
    Shape.PROGRAM_TEXT: lambda _r, _d: '"main"',
    Shape.LABEL: lambda _r, _d: "10",
}


def _arguments(random: Random, arguments: list[Argument]) -> str:
    """As many as are wanted, often some that need not be; repeated ones twice."""
    said = ""
    for index, it in enumerate(arguments):
        if it.optional and random.random() < 0.4:
            break
        comma = "" if not index else " " if it.lead else ", "
        said += comma + _operand(random, it)
        if it.repeated and random.random() < 0.3:
            said += f", {_operand(random, it)}"
    return said


def _modifier(random: Random, word: Word) -> str:
    if "AT" in word.modifiers and random.random() < 0.5:
        return f" {random.choice(('AT', 'IN'))} {number(random)}"
    if word.name == "SPEED" and random.random() < 0.6:
        return random.choice((" MMPS", " IPS", " MONITOR", " ALWAYS", " MMPS ALWAYS"))
    return " ALWAYS" if "ALWAYS" in word.modifiers and random.random() < 0.3 else ""
