"""Texts that nobody would write: mutated programs, words of the tables thrown together, and plain noise.

The generator is passed in, so that a seed names its texts.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path
from random import Random
from typing import NamedTuple

from tests.fuzz.lines import line, program
from vrs_cli.language.words.functions import FUNCTIONS
from vrs_cli.language.words.instructions import CONNECTIVES, CONTROL, INSTRUCTIONS, OPERATOR_WORDS
from vrs_cli.language.words.monitor import COMMANDS

ROOT = Path(__file__).parents[2]
FILES = ("programs/*.v2", "tests/conformance/programs/*.v2", "tests/errors/*.v2err")
LONGEST_PART = 13  # lines of a sample

FRAGMENTS = (
    *("a", "b", "#p", "$s", "i", "x[1]", "x[]", "m[i,2]", "$t[3]", "#q[0]", "here", "_", "%belt"),
    *("m[i,]", "m[,]", "$t[1](a)", "EQ", "LT", "REAL", "LOC", "THEN 10"),
    *("0", "1", "-1", "2.5", "1E38", "1E-3", "^HFF", "^B101", "^17", "'A", "16777216", "1E999", ".", "1001"),
    *('"text"', '"', '""', "(", ")", "[", "]", ",", ":", ";", "=", "==", "<>", "=<", "+", "-", "*", "/", "**"),
    *("/F6.2", "/I0", "/X3", "/B", "/S", ".PROGRAM", ".END", ".LOCATIONS", ".REALS", ".STRINGS", "10", "20"),
    *("\t", "  ", "\N{NO-BREAK SPACE}", "é", "\u0660", "\N{GRINNING FACE}", "\x1a", "\x00", "\x0c", "\ufeff"),
)
NOISE = "".join(map(chr, range(32, 127))) + "\t\n\r;\"'^#$%.:[]()=<>"


CONTROLS = (
    *("\x00", "\x07", "\x1a", "\x1b[31m", "\r", "\x0c", "\x85"),
    *("\u2028", "\u200b", "\u202e", "\ud800", "\ufeff", "\xa0"),
)
FOREIGN = (  # in our words: the manner of each maker's language
    "DEF pick()\nINI\nPTP HOME Vel=100 % DEFAULT\nLIN {X 10, Y 20, Z 5}\n$OUT[3]=TRUE\nWAIT SEC 0.5\nEND",
    "MODULE Cell\n  PERS robtarget p1;\n  PROC main()\n    MoveJ p1, v100, z1, t0;\n    Set do1;\n  ENDPROC\nENDMODULE",
    "def pick():\n  movej([0, -1.57, 0, 0, 0, 0], a=1.4, v=1.05)\n  set_digital_out(1, True)\n  sleep(0.5)\nend",
    "/PROG  PICK\n/MN\n   1:  J P[1] 100% FINE    ;\n   2:  DO[1]=ON ;\n/POS\n/END",
    ".PROGRAM pick()\n  JMOVE #home\n  LAPPRO part, 50\n  TWAIT 0.5\n  LMOVE part\n.END\n.TRANS\np 1 2 3 4 5 6\n.END",
    "PROGRAM pick\nVAR i : INTEGER\nBEGIN\n  -- go\n  MOVE TO home\nEND pick",
)


@cache
def words() -> tuple[str, ...]:
    """Every word of the tables, with what stands between operands."""
    tables = (*INSTRUCTIONS, *CONTROL, *FUNCTIONS, *COMMANDS)
    return (*tables, *sorted(CONNECTIVES | OPERATOR_WORDS), *FRAGMENTS)


@cache
def samples() -> tuple[tuple[str, ...], ...]:
    """The lines of texts that people wrote: sample and conformance programs, wrong ones, examples of the tables and of
    the documentation, programs of other makers' languages.
    """
    files = (path for pattern in FILES for path in sorted(ROOT.glob(pattern)))
    pages = "\n".join(path.read_text(encoding="utf-8") for path in sorted(ROOT.glob("docs/*.md")))
    shown = re.findall(r"(?ms)^```vrs[^\n]*\n(.*?)^```", pages)
    rows = [row.example for table in (INSTRUCTIONS, CONTROL, FUNCTIONS, COMMANDS) for row in table.values()]
    texts = (
        *(path.read_text(encoding="utf-8") for path in files),
        *re.findall(r"(?ms)^```val2[^\n]*\n(.*?)^```", pages),
        *("\n".join(re.findall(r"(?m)^\.+(.*)$", one)) for one in shown),
        *("\n".join(rows[at : at + LONGEST_PART]) for at in range(0, len(rows), LONGEST_PART)),
        *FOREIGN,
    )
    return tuple(tuple(text.splitlines()) for text in texts)


def sample(random: Random) -> str:
    """Some lines of such a text, as they are or as the steps of a program."""
    lines = random.choice(samples())
    begin = random.choice((0, random.randint(0, max(len(lines) - 1, 0))))
    chosen = lines[begin : begin + random.randint(1, LONGEST_PART)]
    return "\n".join((".PROGRAM p", *chosen, ".END", "") if begin and random.random() < 0.7 else (*chosen, ""))


def medley(random: Random) -> str:
    """A program of good lines in no good order."""
    chosen = (random.choice(random.choice(samples()) or ("",)) for _ in range(random.randint(1, LONGEST_PART)))
    return "\n".join((".PROGRAM p", *chosen, ".END", ""))


def typed(random: Random) -> str:
    """Lines of the prompt."""
    return "\n".join(line(random) for _ in range(random.randint(1, 8)))


def soup(random: Random) -> str:
    """Words of the language, thrown together."""
    steps = [" ".join(random.choices(words(), k=random.randint(1, 8))) for _ in range(random.randint(1, 8))]
    return "\n".join((".PROGRAM p(a, $s)", *steps, ".END", ""))


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


def mutated(text: str, random: Random, times: int) -> str:
    """The text with some of its pieces changed, doubled, swapped or gone."""
    for _ in range(times):
        text = random.choice(_MUTATIONS)(text, random)
    return text


def _insert(text: str, random: Random) -> str:
    return _put(text, random, random.choice(words()))


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


def _truncate(text: str, random: Random) -> str:
    return text[: random.randint(0, len(text))]


def _quote(text: str, random: Random) -> str:
    """A quote too many, or one gone."""
    return text.replace('"', "", 1) if random.random() < 0.5 else _put(text, random, '"')


def _control(text: str, random: Random) -> str:
    return _put(text, random, random.choice(CONTROLS))


def _number_lines(text: str, random: Random) -> str:
    form = random.choice(("{} {}", "{}. {}", "{}.? {}", "{}{}"))
    return "\n".join(form.format(number, row) for number, row in enumerate(text.split("\n")))


def _put(text: str, random: Random, what: str) -> str:
    at = random.randint(0, len(text))
    return text[:at] + what + text[at:]


_MUTATIONS: Sequence[Callable[[str, Random], str]] = (
    *(_insert, _insert, _delete, _delete, _flip, _flip, _double, _swap_lines, _other_case),
    *(_truncate, _quote, _control, _number_lines),
)
KINDS: Mapping[str, Callable[[Random], str]] = {
    "by the tables": program,
    "typed lines": typed,
    "samples": sample,
    "good lines anyhow": medley,
    "words anyhow": soup,
    "characters": noise,
    "nested": nested,
}
_SHARES = (30, 10, 25, 15, 10, 5, 5)  # of a hundred texts


class Text(NamedTuple):
    """`kind`: what it was made of; `mutated`: what was changed in it afterwards, how often."""

    kind: str
    mutations: int
    text: str


def text(random: Random) -> Text:
    """Any text. Every other one is as it was made."""
    (kind,) = random.choices(tuple(KINDS), _SHARES)
    mutations = random.choice((0, 0, 0, 1, 2, 6))
    return Text(kind, mutations, mutated(KINDS[kind](random), random, mutations))
