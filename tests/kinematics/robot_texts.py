"""Robot files that somebody has damaged, by mistake or on purpose, each made from a seed."""

from __future__ import annotations

from pathlib import Path
from random import Random

from vrs_cli.kinematics.robot_file import ROBOTS

FILES = sorted(Path(ROBOTS).glob("*.toml"))
DEEP = 3000  # brackets
VALUES = (
    *("1e400", "-1e400", "nan", "inf", "-inf", "1e308", "1e9", "-1e9", "1e-320", "-0.0", "0", "1", "1" + "0" * 400),
    *("true", '""', '"x"', '"\\u0000"', '"\\n"', f'"{"A" * 5000}"', "[]", "[[1]]", "{}", "{a = 1}", "[1, 2, 3]"),
    *("[nan, inf, 1, 2, 3, 4]", "1979-05-27", "07:32:00", "[" * DEEP + "]" * DEEP, "{a = " * DEEP + "1" + "}" * DEEP),
)
LINES = (
    *(
        "[joints]",
        "[[poses]]",
        "[[tool]]",
        "[a.b.c]",
        '["\\u0000"]',
        "joints = 3",
        "name = []",
        "= 3",
        "\x00",
        "\ufeff",
    ),
    *(
        "urdf = 3",
        'urdf = "/dev/null"',
        'urdf = "none.urdf"',
        'urdf = "\\u0000"',
        f'urdf = "{"A" * 5000}"',
        'urdf = "."',
    ),
    *('task = "pose"', "task = 3", "base = [0, 0, 0, 0, 0, 0]", "flange = [1, 2, 3, 1e9, 1, 1]", "profile = []"),
)
CHARACTERS = '\0\n"[]={}\u2028\U0001f600'


def robot_text(seed: int) -> str:
    """A built-in robot with some changes."""
    source = Random(seed)
    text = source.choice(FILES).read_text(encoding="utf-8")
    for _ in range(source.choice((1, 1, 2, 5))):
        text = source.choice((_with_a_value, _with_a_value, _with_a_line, _without_a_line, _with_a_character, _cut))(
            source, text
        )
    return text


def _with_a_value(source: Random, text: str) -> str:
    lines = text.split("\n")
    given = [i for i, line in enumerate(lines) if "=" in line]
    if given:
        i = source.choice(given)
        lines[i] = f"{lines[i].split('=')[0]}= {source.choice(VALUES)}"
    return "\n".join(lines)


def _with_a_line(source: Random, text: str) -> str:
    lines = text.split("\n")
    lines.insert(source.randint(0, len(lines)), source.choice((*LINES, *lines)))
    return "\n".join(lines)


def _without_a_line(source: Random, text: str) -> str:
    lines = text.split("\n")
    del lines[source.randrange(len(lines))]
    return "\n".join(lines)


def _with_a_character(source: Random, text: str) -> str:
    place = source.randint(0, len(text))
    return text[:place] + source.choice(CHARACTERS) + text[place + 1 :]


def _cut(source: Random, text: str) -> str:
    return text[: source.randint(0, len(text))]
