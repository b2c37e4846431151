"""Cells changed at random: each is read, or refused with the lines of its mistakes.

For longer: python -m tests.fuzz.cells 100000 [SEED]
"""

from __future__ import annotations

import random
import re
import time
from collections import Counter
from pathlib import Path

from tests.by_hand import command
from vrs_cli.errors import FileDamaged
from vrs_cli.files.cell_file import parse_cell

PROGRAMS = Path(__file__).parents[2] / "programs"
PATH = str(PROGRAMS / "cell.toml")  # meshes are looked for beside it
LONGEST = 2.0  # [s] of process time for one cell
MORE = """
floor = -600
[signals]
part.there = 1003
[[follow]]
when = 3
set = "part.there"
after = 0.8
lasting = 0.5
variables = ["found.x", "$kind"]
rows = [[400, "nut"], [420.5, "bolt"]]
again = true
[[sensor]]
name = "gate"
signal = 1001
kind = "beam"
from = [250, 350, -200]
to = [250, 550, -200]
[[sensor]]
name = "near"
signal = -1002
kind = "proximity"
at = [0, 0, 0]
direction = [0, 0, -2]
range = 12
[[sink]]
when = -3
at = [0, 0, 0, 90, 0, 0]
size = [1, 2, 3]
[[part]]
name = "mesh"
shape = "mesh"
file = "none.stl"
at = [0, 0, 0]
[[fixture]]
name = "ball"
shape = "sphere"
radius = 3
at = [1, 2, 3]
colour = [0.1, 0.2, 0.3]
"""
VALUES = (
    *("0", "-1", "1e400", "-1e-400", "nan", "inf", "-inf", "9" * 400, "1e99", "0x7f", "true", "1979-05-27", '""', "[]"),
    *("{}", '"\\u0000"', "[[[]]]", "{a = 1}", '"-"', "[1, 2]", "[1, 2, 3, 4, 5, 6]", "512", "1512", "2512", "1_0"),
    *('"../../etc"', '"a" ', "-0.0", '"\U0001f916"', '"' + "x" * 3000 + '"', "[" * 50 + "]" * 50, "'''a\nb'''"),
    *('"box"', '"mesh"', '"cylinder"'),
)
WORDS = re.compile(r"[\w.]+|\"[^\"]*\"|-?[\d.]+|\S")


def texts() -> list[str]:
    return [path.read_text(encoding="utf-8") for path in sorted(PROGRAMS.glob("*.toml"))] + [MORE]


def changed(text: str, R: random.Random) -> str:
    """A text with some changes: of values, lines, words and characters."""
    for _ in range(R.choice((1, 1, 2, 5))):
        lines, kind = text.split("\n"), R.randrange(7)
        at = R.randrange(len(lines))
        if kind == 0 and "=" in lines[at]:
            lines[at] = f"{lines[at].split('=')[0]}= {R.choice(VALUES)}"
        elif kind == 1:
            del lines[at]
        elif kind == 2:
            lines.insert(R.randrange(len(lines)), lines[at])
        elif kind == 3:
            words = WORDS.findall(lines[at])
            R.shuffle(words)
            lines[at] = " ".join(words)
        elif kind == 4 and lines[at]:
            place = R.randrange(len(lines[at]))
            lines[at] = lines[at][:place] + chr(R.choice((*range(32, 127), 0, 9, 233, 0x3000))) + lines[at][place + 1 :]
        elif kind == 5:
            lines = lines[:at]
        else:
            first, last = sorted((at, R.randrange(len(lines))))
            lines[at:at] = lines[first : last + 1]
        text = "\n".join(lines) or "a"
    return text


def trial(seed: int) -> str:
    """Read one changed cell. Return what came of it; raises AssertionError for a message without its line."""
    R = random.Random(seed)
    text = changed(R.choice(texts()), R)
    begun = time.process_time()
    try:
        parse_cell(text, PATH)
        result = "read"
    except FileDamaged as error:
        result = "refused"
        for line in error.detail.split("\n"):
            assert line.startswith(PATH), line
            assert re.match(r":[0-9]+: \S|: .*(line [0-9]+|end of document)|: there are more", line[len(PATH) :]), line
            assert len(line) < 1000, line
    assert time.process_time() - begun < LONGEST, f"seed {seed} takes long"
    return result


def main(count: int, first: int = 0) -> None:
    counts = Counter[str]()
    for seed in range(first, first + count):
        try:
            counts[trial(seed)] += 1
        except Exception as error:
            counts[f"{type(error).__name__}"] += 1
            print(f"seed {seed}: {type(error).__name__}: {str(error)[:300]}", flush=True)
    print(dict(counts))


if __name__ == "__main__":
    command(main)
