"""Lines and programs by the tables of the language: every word with all forms of its arguments, and numbers that nobody
would type.

The generator is passed in, so that a seed names its lines.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache
from random import Random

from vrs_cli.engine.settings import IDLE_PARAMETERS, IDLE_SWITCHES, PARAMETERS, SWITCHES
from vrs_cli.language.words.functions import FUNCTIONS, ORDER, Function
from vrs_cli.language.words.instructions import DECLARATIONS, INSTRUCTIONS
from vrs_cli.language.words.monitor import COMMANDS
from vrs_cli.language.words.values import Kind
from vrs_cli.language.words.word import GROUPED, SORT_WORDS, Argument, Shape, Word
from vrs_cli.values.diagnostics import DIALECTS

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
STRINGS = (
    *('"a"', '""', '"TCP"', '"DISK"', '"f.v2"', '"/LOCAL_PORT 11000 /CLIENTS 1"', '"12.5, 3"'),
    *('"main"', '"é\u0660"'),
)
NAMES = ("a", "b", "#p", "$s", "x", "i", "x[1]", "m[i, 2]", "$t[3]", "#q[0]", "speed", "end.pos", "_t", "move")
LEFT_OUT = frozenset({"EXIT", "QUIT", "SEE", "REPLAY", "PROMPT"})  # they leave, fill the screen, or take time of ours
WIDE = frozenset({"SPEED", "ACCEL", "DURATION", "PARAMETER", "TOOL", "BASE", "DRIVE", "JOG", "MOVE", "MOVES", "DELAY"})
LONGEST_NUMBER = 3  # nested in each other


def line(random: Random) -> str:
    """Any line of the prompt."""
    return sentence(random, random.choice(_chosen() if random.random() < 0.5 else _all()))


def sentence(random: Random, word: Word) -> str:
    """A word with its arguments, in any of its forms."""
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
    if chance < 0.4:
        return random.choice(EXTREMES)
    if chance < 0.85 or depth >= LONGEST_NUMBER:
        return random.choice(USUAL)
    if chance < 0.9:
        return repr(random.uniform(-1.0, 1.0) * 10.0 ** random.uniform(-330.0, 308.0)).replace("e", "E")
    return _function(random, _functions(Kind.REAL), depth)


def _function(random: Random, rows: Sequence[Function], depth: int) -> str:
    row = random.choice(rows)
    return row.name if row.constant else f"{row.name}({_arguments(random, row.arguments, depth + 1)})"


@cache
def _functions(*kinds: Kind) -> tuple[Function, ...]:
    return tuple(row for row in FUNCTIONS.values() if row.result in kinds)


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


def _string(random: Random, depth: int = 0) -> str:
    if depth < LONGEST_NUMBER and random.random() < 0.3:
        return _function(random, _functions(Kind.STRING), depth)
    return random.choice((*STRINGS, f"$ENCODE({number(random, depth + 1)})", "$s", "$t[2]", '$s + "b"'))


def _operand(random: Random, it: Argument, depth: int = 0) -> str:
    lead = f"{it.lead} " if it.lead else ""
    make = _OPERANDS.get(it.shape)
    return lead + (number(random, depth) if make is None else make(random, depth))


_OPERANDS: Mapping[Shape, Callable[[Random, int], str]] = {
    Shape.PLACE: _place,
    Shape.LOCATION: _place,
    Shape.STRING: _string,
    Shape.VARIABLE: lambda r, d: r.choice(("a", "#p", "$s", "x", f"x[{number(r, d)}]")),
    Shape.REAL_VARIABLE: lambda r, d: r.choice(("x", f"y[{number(r, d)}]", f"m[{number(r, d)}, {number(r, d)}]")),
    Shape.LOCATION_VARIABLE: lambda r, d: r.choice(("a", "#p", f"b[{number(r, d)}]")),
    Shape.STRING_VARIABLE: lambda r, _d: r.choice(("$s", "$t[2]")),
    Shape.PROGRAM: lambda r, d: r.choice(("main", f"main({number(r, d)})", "other")),
    Shape.ITEM: lambda r, d: r.choice((number(r, d), f"/F{r.randint(0, 20)}.{r.randint(0, 20)}, {number(r, d)}", "/S")),
    Shape.FILE: lambda r, _d: r.choice(("f.v2", "g.vrst", "none")),
    Shape.SWITCH: lambda r, _d: r.choice((*SWITCHES, *IDLE_SWITCHES, "SCALE.ACCEL[1]", "ROBOT")),
    Shape.PARAMETER_NAME: lambda r, _d: r.choice((*PARAMETERS, *IDLE_PARAMETERS)),
    Shape.UNIT: lambda r, d: r.choice(("0", "4", "5", "lun", number(r, d))),
    Shape.GROUP: lambda r, d: r.choice(("0", "4", "5", "lun", number(r, d))),
    Shape.TASK: lambda r, _d: r.choice(("0", "1", "2", "7")),
    Shape.ELEMENTS: lambda r, d: r.choice(("x[1]", f"x[{number(r, d)}]", "m[1, 0]")),
    Shape.SETTING: lambda r, d: r.choice(("X", "TRZ", "1", "6", number(r, d))),
    Shape.PART: lambda r, d: r.choice(("box", "1", '"no part"', number(r, d))),
    Shape.BRANCH: lambda r, _d: r.choice(("main", "trial")),
    Shape.WORD: lambda r, d: r.choice(("a", number(r, d))),
    Shape.INSTRUCTION: lambda r, d: f"DRIVE {number(r, d)}, {number(r, d)}, {number(r, d)}",
    Shape.PROGRAM_TEXT: lambda _r, _d: '"main"',
    Shape.LABEL: lambda _r, _d: "10",
}


def _arguments(random: Random, arguments: Sequence[Argument], depth: int = 0) -> str:
    """As many as are wanted, often some that need not be; some left out between commas; repeated ones twice."""
    said = ""
    for index, it in enumerate(arguments):
        if it.optional and random.random() < 0.4:
            break
        comma = "" if not index else " " if it.lead else ", "
        left_out = it.optional and index and not it.lead and random.random() < 0.1
        said += comma if left_out else comma + _operand(random, it, depth)
        if it.repeated and random.random() < 0.3:
            said += f", {_operand(random, it, depth)}"
    return said


def _modifier(random: Random, word: Word) -> str:
    if "AT" in word.modifiers and random.random() < 0.5:
        return f" {random.choice(('AT', 'IN'))} {number(random)}"
    if word.name == "SPEED" and random.random() < 0.6:
        return random.choice((" MMPS", " IPS", " MONITOR", " ALWAYS", " MMPS ALWAYS"))
    return " ALWAYS" if "ALWAYS" in word.modifiers and random.random() < 0.3 else ""


# --- programs --------------------------------------------------------------------------------------------------------

LONGEST_PROGRAM = 12  # lines between its heading and its end
DEEPEST = 3  # blocks in each other


def program(random: Random) -> str:
    """A file with a program whose blocks close; sometimes with what stands above programs, and with values."""
    lines = list(_above(random))
    parameters = ", ".join(random.sample(("x", "$s", "a", "#p", "t[]"), random.choice((0, 0, 1, 2))))
    lines.append(f".PROGRAM {random.choice(('main', 'main', 'pick.up', 'move', 'end'))}({parameters})")
    for declared in range(random.choice((0, 0, 0, 1, 2))):
        word = random.choice(sorted(DECLARATIONS))
        sort = random.choice(("", "", *SORT_WORDS))
        lines.append(f"  {word} {sort} {', '.join(random.sample(('i', 'x', '$s', 'a', 't[]', '$t[]'), 1 + declared))}")
    lines += steps(random, LONGEST_PROGRAM)
    lines.append(".END")
    if random.random() < 0.2:
        lines += _values(random)
    return "\n".join(lines) + "\n"


def _above(random: Random) -> Iterator[str]:
    if random.random() < 0.15:
        yield f"; dialect: {random.choice((*DIALECTS, 'VAL2', 'as', ''))}"
    if random.random() < 0.1:
        yield random.choice(("; vrs: ignore V401", "; picks parts", "", ";", "; robot: ur5e"))


def _values(random: Random) -> Iterator[str]:
    section = random.choice((".LOCATIONS", ".REALS", ".STRINGS"))
    yield section
    for _ in range(random.randint(0, 3)):
        wanted = {".LOCATIONS": 6, ".REALS": 1, ".STRINGS": 0}[section]
        values = [random.choice((*USUAL, *EXTREMES)) for _ in range(wanted + random.choice((0, 0, 0, 1, -1)))]
        yield f"{random.choice(NAMES)} {' '.join(values) or random.choice(STRINGS)}"
    yield ".END"


def steps(random: Random, most: int, depth: int = 0) -> list[str]:
    """At most so many lines: steps, and blocks of them."""
    found: list[str] = []
    while len(found) < most and random.random() < 0.85:
        left = most - len(found)
        if left > 3 and depth < DEEPEST and random.random() < 0.25:
            found += _block(random, left - 2, depth + 1)
        else:
            found.append(f"{'  ' * depth}{_label(random)}{step(random)}{_comment(random)}")
    return found


def _block(random: Random, most: int, depth: int) -> list[str]:
    head, end = random.choice(_BLOCKS)(random)
    inner = steps(random, most, depth)
    if head.startswith(("IF", "CASE")) and most > 2:
        between = "ELSE" if head.startswith("IF") else random.choice(("ANY", f"VALUE {number(random)}, 2:"))
        first = [] if head.startswith("IF") else [f"VALUE {number(random)}:"]
        inner = [*first, *inner, between, *steps(random, 1, depth)]
    return [head, *inner, end]


_BLOCKS: tuple[Callable[[Random], tuple[str, str]], ...] = (
    lambda r: (f"IF {condition(r)} THEN", "END"),
    lambda r: (f"WHILE {condition(r)} DO", "END"),
    lambda r: ("DO", f"UNTIL {condition(r)}"),
    lambda r: (f"FOR {r.choice(('i', 'x[1]', 'x'))} = {number(r)} TO {number(r)}{_stride(r)}", "END"),
    lambda r: (f"CASE {number(r)} OF", "END"),
)


def _stride(random: Random) -> str:
    return f" STEP {number(random)}" if random.random() < 0.3 else ""


def condition(random: Random, depth: int = 0) -> str:
    """A real made with operators of all ranks."""
    if depth > 2 or random.random() < 0.3:
        return random.choice((number(random, depth), "x", "i", "SIG(1001)", "NOT x", '$s == "a"', "(x)", "- -x"))
    left, right = condition(random, depth + 1), condition(random, depth + 1)
    said = f"{left} {random.choice(_INFIX)} {right}"
    return f"({said})" if random.random() < 0.3 else said


_INFIX = (*(sign for sign in ORDER.infix if sign != ":"), "=", "=<", "=>", "EQ")


def step(random: Random) -> str:
    """A step of a program that opens no block."""
    chance = random.random()
    if chance < 0.6:
        return sentence(random, random.choice(tuple(INSTRUCTIONS.values())))
    if chance < 0.95:
        return random.choice(_STEPS)(random)
    return ""


_STEPS: tuple[Callable[[Random], str], ...] = (
    lambda r: f"{r.choice(NAMES)} = {condition(r)}",
    lambda r: f"{r.choice(('$s', '$t[2]'))} = {_string(r)}",
    lambda r: f"SET {r.choice(('a', '#p', 'b[1]', 'a:b'))} = {_place(r)}",
    lambda r: f"IF {condition(r)} GOTO {r.choice(('10', '20', '99999'))}",
    lambda r: f"GOTO {r.choice(('10', '20', '30'))}",
    lambda r: f"IF x {r.choice(('EQ', 'LT'))} {number(r)} THEN {r.choice(('10', '20'))}",
    lambda r: f"MOVE {_place(r)}",
)


def _label(random: Random) -> str:
    return random.choice(("10 ", "20 ", "65535 ", "0 ", "10")) if random.random() < 0.15 else ""


def _comment(random: Random) -> str:
    return random.choice((" ; it", ";", '; "', "  ;  é ", " ;;; dialect: val")) if random.random() < 0.15 else ""
