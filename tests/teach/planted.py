"""Faults planted in correct programs lose marks, correct programs lose none, and wrong submissions fail as they say.

`python -m tests.teach.planted COUNT [SEED]` plants COUNT random faults in the correct programs of the five exercises,
as many in each, and grades them, all correct programs and all wrong submissions. It prints each fault with the checks
that caught it. Fault number n of an exercise is that of SEED + n. A fault that is not caught is a gap in the checks, or
a change that the task allows: look at it. Status 1 where one was not caught, a correct program lost marks, or a wrong
submission failed other checks than it names.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from contextlib import chdir
from functools import cache
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from typing import NamedTuple

from tests.by_hand import command
from vrs_cli.teach.exercise import read_exercise
from vrs_cli.teach.grading import Grader, Submission

EXERCISES = Path(__file__).parents[2] / "programs" / "exercises"
CORRECT = Path(__file__).parent / "correct"
NAMES = tuple(sorted(path.name for path in EXERCISES.iterdir() if path.is_dir()))

Lines = list[str]


class Draft(NamedTuple):
    """The lines of a correct program for an exercise, and the random choices of the fault."""

    lines: Lines
    random: Random
    name: str


class Fault(NamedTuple):
    """A correct program with one fault. `where`: its file. `what`: a description."""

    where: str
    what: str
    text: str


def correct_programs(name: str) -> tuple[Path, ...]:
    """Return the model of an exercise, and other programs that do the same."""
    return (EXERCISES / name / "teacher" / "model.v2", *sorted((CORRECT / name).glob("*.v2")))


@cache
def grader(name: str) -> Grader:
    """Return the grader of an exercise."""
    return Grader(read_exercise(EXERCISES / name))


def graded(name: str, text: str) -> tuple[str, ...]:
    """Return the checks of an exercise that a program fails in some variant."""
    with TemporaryDirectory() as folder, chdir(folder):
        grading, _ = grader(name).runs(Submission("student", "student.v2", text))
    return tuple(mark.name for _, mark in grading.marks if not mark.passed)


def fault(name: str, seed: int) -> Fault:
    """Return a fault that a seed plants in one of the correct programs of an exercise."""
    random = Random(f"{name} {seed}")
    while True:
        path = random.choice(correct_programs(name))
        lines = path.read_text(encoding="utf-8").splitlines()
        plant = random.choice(PLANTS)
        before = list(lines)
        if (what := plant(Draft(lines, random, name))) and lines != before:
            return Fault(f"{name}/{path.name}", what, "\n".join(lines) + "\n")


# --- the faults: each changes lines, and returns what it did; "": there is nothing to do it to -------------------


def _places(lines: Lines, pattern: str) -> list[tuple[int, re.Match[str]]]:
    """Return the matches of a pattern in the code of lines."""
    found = []
    for number, line in enumerate(lines):
        code = line.split(";")[0]
        found += [(number, match) for match in re.finditer(rf"(?i){pattern}", code)]
    return found


def _replace(lines: Lines, at: tuple[int, re.Match[str]], new: str) -> str:
    number, match = at
    line = lines[number]
    lines[number] = line[: match.start()] + new + line[match.end() :]
    return f"{line.strip()} -> {lines[number].strip()}"


def _drop(lines: Lines, number: int) -> str:
    return f"without {lines.pop(number).strip()}"


def _without_step(it: Draft) -> str:
    """Omit a step that the task needs."""
    motion = r"MOVES? (p[123]|part|feeder|where|way\[i\]|place|m|target|slot\[i\])\b"
    found = _places(it.lines, rf"^\s*(TOOL \w+|CLOSEI|{motion}|SIGNAL -?1|CALL fetch|TYPE .*)\s*$")
    return _drop(it.lines, it.random.choice(found)[0]) if found else ""


def _last_open(it: Draft) -> str:
    """Omit the step that releases the part."""
    found = _places(it.lines, r"^\s*OPENI\s*$")
    return _drop(it.lines, found[-1][0]) if found else ""


def _copied(it: Draft) -> str:
    """Replace the name of a location by its numbers."""
    known = _given(it.name)
    found = [one for one in _places(it.lines, rf"\b({'|'.join(known)})\b") if _is_used(it.lines[one[0]])]
    if not found:
        return ""
    word = it.random.choice(found)[1][0].lower()
    numbers = ", ".join(known[word])
    what = ""
    for at in reversed([one for one in found if one[1][0].lower() == word]):
        what = _replace(it.lines, at, f"TRANS({numbers})")
    return what


def _other_place(it: Draft) -> str:
    """Use another of the given locations."""
    known = _given(it.name)
    found = [one for one in _places(it.lines, rf"\b({'|'.join(known)})\b") if _is_used(it.lines[one[0]])]
    if not found:
        return ""
    at = it.random.choice(found)
    return _replace(it.lines, at, it.random.choice([one for one in known if one != at[1][0].lower()]))


def _is_used(line: str) -> bool:
    return re.search(r"(?i)\b(MOVES?|APPROS?|SET|CALL|FRAME)\b", line) is not None


def _other_number(it: Draft) -> str:
    """Change a distance or a factor of a place."""
    found = [
        one
        for one in _places(it.lines, r"(?<=[\s(,*/])\d+(?=\s*[*,)]|$)")
        if re.search(r"(?i)\b(TRANS|SHIFT)\b", it.lines[one[0]]) and int(one[1][0]) not in (0, 1, 3)
    ]
    if not found:
        return ""
    at = it.random.choice(found)
    return _replace(it.lines, at, str(round(int(at[1][0]) * it.random.choice((0.5, 1.5, -1.0)))))


def _other_signal(it: Draft) -> str:
    """Use another signal."""
    found = _places(it.lines, r"(?<=SIGNAL )-?\d+|(?<=SIG\()\d+|(?<=REACT )\d+")
    if not found:
        return ""
    at = it.random.choice(found)
    number = int(at[1][0])
    return _replace(it.lines, at, str(number + 3 if number > 0 else number - 3))


def _other_text(it: Draft) -> str:
    """Type another text."""
    found = [one for one in _places(it.lines, r'"[^"]*"') if re.search(r"(?i)\bTYPE\b|\$\w+\[", it.lines[one[0]])]
    if not found:
        return ""
    at = it.random.choice(found)
    return _replace(it.lines, at, it.random.choice((at[1][0].upper().replace("IS", "SI"), '"ready"')))


def _other_loop(it: Draft) -> str:
    """Change the number of loop passes by one."""
    found = _places(it.lines, r"(?<=TO )\d+\s*$|(?<=<= )\d+|(?<=UNTIL row > )\d+|(?<=== )\d+\s*$")
    if not found:
        return ""
    at = it.random.choice(found)
    return _replace(it.lines, at, str(int(at[1][0]) + it.random.choice((-1, 1))))


def _other_frame(it: Draft) -> str:
    """Permute the points of FRAME."""
    found = _places(it.lines, r"FRAME\(corner, along, side, corner\)")
    orders = ("along, corner, side, along", "corner, side, along, corner", "side, along, corner, side")
    return _replace(it.lines, it.random.choice(found), f"FRAME({it.random.choice(orders)})") if found else ""


def _inverted(it: Draft) -> str:
    """Invert a condition."""
    found = [one for one in _places(it.lines, r"(?<=\bIF )[\w. ()\d]+(?= THEN)") if "column" not in one[1][0]]
    if not found:
        return ""
    at = it.random.choice(found)
    said = at[1][0]
    return _replace(it.lines, at, said.removeprefix("NOT ") if said.startswith("NOT ") else f"NOT {said}")


def _stop(it: Draft) -> str:
    """Stop after a place that the arm should pass."""
    found = _places(it.lines, r"^\s*MOVES (m|p[123]|way\[i\])\s*$")
    if not found:
        return ""
    number = it.random.choice(found)[0]
    it.lines.insert(number + 1, "    BREAK")
    return f"BREAK after {it.lines[number].strip()}"


def _curve(it: Draft) -> str:
    """Use joint interpolation instead of a straight line."""
    found = _places(it.lines, r"\bMOVES(?= (part|place|where|m|b|way\[i\]|p[1234])\s*$)")
    return _replace(it.lines, it.random.choice(found), "MOVE") if found else ""


def _hurry(it: Draft) -> str:
    """Move four times as fast."""
    found = _places(it.lines, r"(?<=SPEED )\d+(?= MMPS)")
    if not found or it.name == "pick":
        return ""
    at = it.random.choice(found)
    return _replace(it.lines, at, str(4 * int(at[1][0])))


def _low(it: Draft) -> str:
    """Approach a place from too low."""
    if it.name not in ("pick", "line", "pallet"):
        return ""
    found = _places(it.lines, r"(?<=APPRO part, )\d+|(?<=APPRO place, )\d+|(?<=APPRO a, )\d+|(?<=APPRO slot\[i\], )\d+")
    return _replace(it.lines, it.random.choice(found), "4") if found else ""


def _out_of_reach(it: Draft) -> str:
    """Move out of reach."""
    found = _places(it.lines, r"^\s*(MOVES?|APPROS?|DEPARTS) .*$")
    number = it.random.choice(found)[0]
    it.lines.insert(number + 1, "    MOVE TRANS(0, 1500, 0, 90, 90, 0)")
    return f"a place out of reach after {it.lines[number].strip()}"


def _misspelt(it: Draft) -> str:
    """Misspell a word."""
    at = it.random.choice(_places(it.lines, r"^\s*(MOVES?|READY|OPENI|SIGNAL|SET|TOOL)\b"))
    word = at[1][1]
    return _replace(it.lines, at, at[1][0].replace(word, word[:-1] + "QU"))


def _endless(it: Draft) -> str:
    """Repeat the program for ever."""
    end = next(number for number, line in enumerate(it.lines) if line.strip().upper() == ".END")
    first = next(number for number, line in enumerate(it.lines) if re.match(r"(?i)\s*READY\s*$", line))
    it.lines[first] = f" 99 {it.lines[first].strip()}"
    it.lines.insert(end, "    GOTO 99")
    return "GOTO the beginning, in the end"


PLANTS: tuple[Callable[[Draft], str], ...] = (
    _without_step,
    _last_open,
    _copied,
    _other_place,
    _other_number,
    _other_signal,
    _other_text,
    _other_loop,
    _other_frame,
    _inverted,
    _stop,
    _curve,
    _hurry,
    _low,
    _out_of_reach,
    _misspelt,
    _endless,
)


@cache
def _given(name: str) -> dict[str, list[str]]:
    """Return the given locations of an exercise, and the numbers of each."""
    rows = (line.split() for line in (EXERCISES / name / "exercise" / "given.v2").read_text().splitlines())
    return {row[0]: row[1:] for row in rows if len(row) == 7 and row[0] not in TOOLS}


TOOLS = ("gripper", "nozzle", "camera")  # the variants do not move these: their numbers may be written down


def main(count: int = 40, seed: int = 1) -> int:
    """Plant faults, grade them, and print the results."""
    failed = 0
    for name in NAMES:
        for path in correct_programs(name):
            if lost := graded(name, path.read_text(encoding="utf-8")):
                failed += 1
                print(f"CORRECT PROGRAM FAILS: {path}: {', '.join(lost)}", flush=True)
        for one in grader(name).exercise.wrong:
            if (lost := graded(name, one.text)) != one.fails:
                failed += 1
                print(f"OTHER CHECKS FAIL: {one.path}: {', '.join(lost)}", flush=True)
        for number in range(seed, seed + -(-count // len(NAMES))):
            planted = fault(name, number)
            lost = graded(name, planted.text)
            failed += not lost
            caught = f"caught by {', '.join(lost)}" if lost else "NOT CAUGHT"
            print(f"{planted.where} {number}: {planted.what}: {caught}", flush=True)
    print(f"{failed} of them wrong")
    return int(failed > 0)


if __name__ == "__main__":
    command(main)
