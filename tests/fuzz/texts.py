"""Texts that nobody would write: mutated programs, words of the tables thrown together, and plain noise.

The generator is passed in, so that a seed names its texts.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from random import Random

from vrs_cli.language.words.functions import FUNCTIONS
from vrs_cli.language.words.instructions import CONNECTIVES, CONTROL, INSTRUCTIONS, OPERATOR_WORDS
from vrs_cli.language.words.monitor import COMMANDS

ROOT = Path(__file__).parents[2]

FRAGMENTS = (
    *("a", "b", "#p", "$s", "i", "x[1]", "x[]", "m[i,2]", "$t[3]", "#q[0]", "here", "_", "%belt"),
    *("m[i,]", "m[,]", "$t[1](a)", "EQ", "LT", "REAL", "LOC", "THEN 10"),
    *("0", "1", "-1", "2.5", "1E38", "1E-3", "^HFF", "^B101", "^17", "'A", "16777216", "1E999", ".", "1001"),
    *('"text"', '"', '""', "(", ")", "[", "]", ",", ":", ";", "=", "==", "<>", "=<", "+", "-", "*", "/", "**"),
    *("/F6.2", "/I0", "/X3", "/B", "/S", ".PROGRAM", ".END", ".LOCATIONS", ".REALS", ".STRINGS", "10", "20"),
    *("\t", "  ", "\N{NO-BREAK SPACE}", "é", "\u0660", "\N{GRINNING FACE}", "\x1a", "\x00", "\x0c", "\ufeff"),
)
NOISE = "".join(map(chr, range(32, 127))) + "\t\n\r;\"'^#$%.:[]()=<>"


@cache
def words() -> tuple[str, ...]:
    """Every word of the tables, with what stands between operands."""
    tables = (*INSTRUCTIONS, *CONTROL, *FUNCTIONS, *COMMANDS)
    return (*tables, *sorted(CONNECTIVES | OPERATOR_WORDS), *FRAGMENTS)


@cache
def lines() -> tuple[str, ...]:
    """Good lines: those of the sample programs, and the examples of the tables."""
    rows = [row.example for table in (INSTRUCTIONS, CONTROL, FUNCTIONS) for row in table.values()]
    samples = [line for path in sorted((ROOT / "programs").glob("*.v2")) for line in path.read_text().splitlines()]
    return tuple(line for text in (*rows, *samples) for line in text.splitlines())


def program(random: Random) -> str:
    """A program of good lines in no good order."""
    chosen = random.choices(lines(), k=random.randint(1, 12))
    return "\n".join((".PROGRAM p", *chosen, ".END", "")) if random.random() < 0.8 else "\n".join(chosen)


def soup(random: Random) -> str:
    """Words of the language, thrown together."""
    steps = [" ".join(random.choices(words(), k=random.randint(1, 8))) for _ in range(random.randint(1, 8))]
    return "\n".join((".PROGRAM p(a, $s)", *steps, ".END", ""))


def sentences(random: Random) -> str:
    """An instruction each line, with operands of the right look."""
    heads = random.choices((*INSTRUCTIONS, *CONTROL, "x =", "$s =", "SET a =", "TYPE"), k=random.randint(1, 8))
    steps = [f"{head} {_operands(random)}" for head in heads]
    return "\n".join((".PROGRAM p", *steps, ".END", ""))


def _operands(random: Random) -> str:
    return random.choice((", ", " ", ":", "+", " = ", " AND ")).join(
        _operand(random, 3) for _ in range(random.randint(0, 3))
    )


def _operand(random: Random, depth: int) -> str:
    if depth and random.random() < 0.4:
        inner = ", ".join(_operand(random, depth - 1) for _ in range(random.randint(0, 4)))
        return f"{random.choice(tuple(FUNCTIONS))}({inner})"
    return random.choice(FRAGMENTS[:24])


def noise(random: Random) -> str:
    """Characters."""
    return "".join(random.choices(NOISE, k=random.randint(0, 120)))


def nested(random: Random) -> str:
    """Deep parentheses, long operators, blocks in blocks."""
    depth = random.choice((3, 40, 400))
    return random.choice(
        (
            f".PROGRAM p\nx = {'(' * depth}1{')' * (depth - random.randint(0, 1))}\n.END\n",
            f".PROGRAM p\nx = {'-' * depth}1\n.END\n",
            f".PROGRAM p\nx = 1{'+1' * depth}\n.END\n",
            f".PROGRAM p\nx = 1{'**2' * depth}\n.END\n",
            f".PROGRAM p\nSET a = {':'.join(['a'] * depth)}\n.END\n",
            ".PROGRAM p\n" + "IF 1 THEN\n" * depth + "END\n" * (depth - random.randint(0, 1)) + ".END\n",
            ".PROGRAM p\n" + "FOR i = 1 TO 2\n" * depth + "END\n" * depth + ".END\n",
        )
    )


def mutated(text: str, random: Random) -> str:
    """The text with some of its pieces changed, doubled, swapped or gone."""
    for _ in range(random.randint(0, 6)):
        text = random.choice(_MUTATIONS)(text, random)
    return text


def _insert(text: str, random: Random) -> str:
    at = random.randint(0, len(text))
    return f"{text[:at]}{random.choice(words())}{text[at:]}"


def _delete(text: str, random: Random) -> str:
    at = random.randint(0, len(text))
    return text[:at] + text[at + random.randint(1, 10) :]


def _flip(text: str, random: Random) -> str:
    at = random.randint(0, len(text))
    return text[:at] + random.choice(NOISE) + text[at + 1 :]


def _swap_lines(text: str, random: Random) -> str:
    rows = text.split("\n")
    random.shuffle(rows)
    return "\n".join(rows)


def _double(text: str, random: Random) -> str:
    at, length = random.randint(0, len(text)), random.randint(1, 40)
    return text[: at + length] + text[at:]


def _other_case(text: str, random: Random) -> str:
    return random.choice((text.lower(), text.upper(), text.replace("\n", "\r\n"), text.replace("\n", "\r")))


_MUTATIONS: Sequence[Callable[[str, Random], str]] = (_insert, _delete, _flip, _double, _swap_lines, _other_case)
_SOURCES: Sequence[Callable[[Random], str]] = (program, program, sentences, sentences, soup, noise, nested)


def text(random: Random) -> str:
    """Any text."""
    return mutated(random.choice(_SOURCES)(random), random)
