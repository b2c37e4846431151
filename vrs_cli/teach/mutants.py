"""Mutants of a model solution: the same program with one mistake, as students make them."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import islice
from typing import NamedTuple

from vrs_cli.kinematics.transform import Transform
from vrs_cli.language.run.variables import Item, subscript
from vrs_cli.language.text import ast
from vrs_cli.language.text.ast import Program, Step
from vrs_cli.language.text.parser import parse_file
from vrs_cli.language.words.values import numbers_of, plain
from vrs_cli.values.dialect import Dialect
from vrs_cli.values.numbers import Value

MAX_MUTANTS = 80
SHIFT_MM = 50  # by which a location is wrong
MOTIONS = ("MOVE", "MOVES", "APPRO", "APPROS", "DEPART", "DEPARTS", "DRIVE", "READY")
OTHER_WORD = {"MOVES": "MOVE", "MOVE": "MOVES", "APPROS": "APPRO", "APPRO": "APPROS", "DEPARTS": "DEPART"}
ANYWHERE = "MOVE TRANS(99999)"  # a place that no arm reaches


class Mutant(NamedTuple):
    """A program with one mistake, and which one it is in words."""

    what: str
    text: str


def mutants_of(text: str, dialect: Dialect, locations: Mapping[Item, Value]) -> list[Mutant]:
    """Return mutants of the first program of a text and of those behind it, at most MAX_MUTANTS. `locations`: those
    that the exercise gives, which are shifted in turn.
    """
    file, _ = parse_file(text, dialect)
    programs = [part for part in file.parts if isinstance(part, Program)]
    if not programs:
        return []
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    whole = (*_ends(lines, programs[0]), *_begins(lines, programs[0], locations), *_stops(lines, programs))
    found = [*whole, *(mutant for program in programs for step in program.steps for mutant in _of_step(lines, step))]
    if len(found) > MAX_MUTANTS:  # some of each part of the program
        found = [found[k * len(found) // MAX_MUTANTS] for k in range(MAX_MUTANTS)]
    return found


def _of_step(lines: Sequence[str], step: Step) -> Iterator[Mutant]:
    """Yield mutants of one line."""
    it, number = step.statement, step.span.line
    if not isinstance(it, ast.Instruction | ast.Assignment) or (
        isinstance(it, ast.Instruction) and it.word in ("AUTO", "LOCAL", "GLOBAL")
    ):
        return
    source = lines[number - 1].split(";")[0].strip()
    label = f"{step.label} " if step.label is not None else ""
    yield Mutant(f"without line {number}, {source}", _with_line(lines, number, label))
    if not isinstance(it, ast.Instruction):
        return
    if (other := OTHER_WORD.get(it.word)) is not None:
        changed = re.sub(r"(?i)\b[A-Z.]+\b", other, source.removeprefix(label), count=1)
        yield Mutant(f"with {changed} in line {number}", _with_line(lines, number, label + changed))
    if it.word == "SIGNAL":
        yield Mutant(f"with SIGNAL reversed in line {number}", _with_line(lines, number, _reversed(source)))


def _reversed(source: str) -> str:
    """Return a SIGNAL that does the opposite."""

    def other(found: re.Match[str]) -> str:
        return found[1] if found[0].startswith("-") else f"-{found[1]}"

    return re.sub(r"-?\s*\b(\d+)\b", other, source, count=1)


def _begins(lines: Sequence[str], main: Program, locations: Mapping[Item, Value]) -> Iterator[Mutant]:
    """Yield mutants that begin otherwise: a location that is shifted, another speed."""
    first = main.span.line
    for (name, index), value in locations.items():
        if isinstance(value, Transform):
            place = name if index is None else f"{name}[{subscript(index)}]"
            line = f"SET {place} = SHIFT({place} BY {SHIFT_MM}, 0, 0)"
            yield Mutant(f"with {place} shifted by {SHIFT_MM} mm", _after(lines, first, line))
    for line in ("SPEED 5 ALWAYS", "SPEED 100 ALWAYS", "PARAMETER HAND.TIME = 3"):
        yield Mutant(f"with {line} at the beginning", _after(lines, first, line))
    without = [line for line in lines if not re.match(r"(?i)\s*SPEED\b", line)]
    if len(without) < len(lines):
        yield Mutant("without any SPEED", "\n".join(without))
    slower = [re.sub(r"(?i)^(\s*SPEED\s+)[\d.]+", r"\g<1>7", line) for line in lines]
    faster = [re.sub(r"(?i)^(\s*SPEED\s+)[\d.]+(?!.*(?:MMPS|IPS))", r"\g<1>100", line) for line in lines]
    quick = [re.sub(r"(?i)^(\s*SPEED\s+)([\d.]+)(?=.*(?:MMPS|IPS))", r"\g<1>3*\g<2>", line) for line in faster]
    for what, changed in (("7 %", slower), ("its most", quick)):
        if changed != list(lines):
            yield Mutant(f"with SPEED {what} throughout", "\n".join(changed))


def _ends(lines: Sequence[str], main: Program) -> Iterator[Mutant]:
    """Yield mutants that end otherwise, or do nothing."""
    last = max((step.span.line for step in main.steps), default=main.span.line)
    for what, line in (
        ("a motion out of reach", ANYWHERE),
        ("a pause of 20 s", "TIMER 1 = 0\nWAIT TIMER(1) > 20"),
        ("one more motion", "DEPART 30"),
        ("the hand opened", "OPENI"),
        ("the hand closed", "CLOSEI"),
        ("one more line", 'TYPE "more"'),
        ("a word of V+", "x = 2**3"),
        ("all outputs switched off", "RESET"),
        ("outputs 1 to 3 switched on", "SIGNAL 1, 2, 3"),
    ):
        yield Mutant(f"with {what} at the end", _after(lines, last, line))
    yield Mutant("with a motion out of reach at the beginning", _after(lines, main.span.line, ANYWHERE))
    kept = [line for number, line in enumerate(lines, 1) if not main.span.line < number <= last]
    yield Mutant("without a step", "\n".join(kept))


def _stops(lines: Sequence[str], programs: Iterable[Program]) -> Iterator[Mutant]:
    """Yield mutants with a stop after each motion, with none, and with another way of all motions."""
    motions = {
        step.span.line
        for program in programs
        for step in program.steps
        if isinstance(step.statement, ast.Instruction) and step.statement.word in MOTIONS
    }
    stopped = [f"{line}\nBREAK" if number in motions else line for number, line in enumerate(lines, 1)]
    yield Mutant("with BREAK after each motion", "\n".join(stopped))
    without = [line for line in lines if not re.match(r"(?i)\s*BREAK\b", line)]
    if len(without) < len(lines):
        yield Mutant("without any BREAK", "\n".join(without))
    for word, other in (("S", ""), ("", "S")):
        pattern = re.compile(rf"(?i)^(\s*(?:\d+\s+)?(?:MOVE|APPRO|DEPART)){word}\b")
        changed = [pattern.sub(rf"\g<1>{other}", line) for line in lines]
        if changed != list(lines):
            yield Mutant(f"with all motions {'straight' if other else 'joint-interpolated'}", "\n".join(changed))


def copied_numbers(text: str, dialect: Dialect, locations: Mapping[Item, Value]) -> Mutant | None:
    """Return the program with the numbers of given locations copied into it; None where it has no program."""
    file, _ = parse_file(text, dialect)
    main = next((part for part in file.parts if isinstance(part, Program)), None)
    if main is None:
        return None
    copies = []
    for (name, index), value in locations.items():
        if isinstance(value, Transform):
            place = name if index is None else f"{name}[{subscript(index)}]"
            copies.append(f"SET {place} = TRANS({', '.join(map(plain, numbers_of(value)))})")
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    return Mutant("with the numbers of the given locations copied", _after(lines, main.span.line, "\n".join(copies)))


def _after(lines: Sequence[str], number: int, more: str) -> str:
    """Return a text with more lines behind one of its lines, counted from 1."""
    return "\n".join([*lines[:number], more, *lines[number:]])


def _with_line(lines: Sequence[str], number: int, other: str) -> str:
    """Return a text with another line in place of one."""
    return "\n".join([*lines[: number - 1], other, *islice(lines, number, None)])
