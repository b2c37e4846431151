"""A second, slow implementation of the flow of a program, straight from its definition, to compare the compiler with.

It walks the steps one by one and keeps nothing but what the definition speaks of: the variables, and for each FOR the
limit and the step that were evaluated when it was carried out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

OPENERS = ("IF", "WHILE", "DO", "FOR", "CASE")


@dataclass
class Outcome:
    """What was typed; whether the end was reached; whether a loop was entered past its FOR."""

    typed: list[str] = field(default_factory=list)
    ended: bool = False
    fault: bool = False


def partners(lines: Sequence[str]) -> dict[int, list[int]]:
    """For each line of a block all lines of that block in order: opener, ELSE / VALUE / ANY ..., closer."""
    stack: list[list[int]] = []
    blocks: dict[int, list[int]] = {}
    for number, line in enumerate(map(bare, lines)):
        word = line.split(" ")[0]
        if word in OPENERS and " GOTO " not in line:
            stack.append([number])
        elif word in ("ELSE", "VALUE", "ANY"):
            stack[-1].append(number)
        elif word in ("END", "UNTIL"):
            block = [*stack.pop(), number]
            blocks.update(dict.fromkeys(block, block))
    return blocks


def bare(line: str) -> str:
    """A line without its label."""
    first, _, rest = line.partition(" ")
    return rest if first.isdigit() else line


def label(line: str) -> str | None:
    first = line.partition(" ")[0]
    return first if first.isdigit() else None


class Interpreter:
    """Understands the small programs that the tests make: `x = x+n`, `TYPE "text"`, conditions `x MOD a == b`."""

    def __init__(self, lines: Sequence[str]) -> None:
        self.lines = [bare(line) for line in lines]
        self.labels = {name: number for number, line in enumerate(lines) if (name := label(line))}
        self.blocks = partners(lines)
        self.variables: dict[str, float] = {}
        self.limits: dict[int, tuple[float, float]] = {}
        self.outcome = Outcome()

    def run(self, first: int, most: int) -> Outcome:
        at = first
        for _ in range(most):
            if at >= len(self.lines):
                self.outcome.ended = True
                break
            after = self.step(at)
            if after is None:
                self.outcome.fault = True
                break
            at = after
        return self.outcome

    def step(self, at: int) -> int | None:
        """Carry out a line; the next one, or None for a fault."""
        words = self.lines[at].split(" ")
        block = self.blocks.get(at, [at])
        closer = block[-1]
        match words[0]:
            case "TYPE":
                self.outcome.typed.append(words[1].strip('"'))
            case "x":
                self.variables["x"] = self.variables.get("x", 0.0) + float(words[2].removeprefix("x+"))
            case "GOTO":
                return self.labels[words[1]]
            case "IF" if "GOTO" in words:
                return self.labels[words[-1]] if self.holds(words[1:-2]) else at + 1
            case "IF":
                return at + 1 if self.holds(words[1:-1]) else (block[1] + 1 if len(block) == 3 else closer)
            case "ELSE" | "VALUE" | "ANY":
                return closer + 1
            case "WHILE":
                return at + 1 if self.holds(words[1:-1]) else closer + 1
            case "UNTIL":
                return at + 1 if self.holds(words[1:]) else block[0]
            case "CASE":
                return self.choose(block, self.variables["x"] % int(words[3]))
            case "FOR":
                return self.begin_for(at, words, closer)
            case "END":
                return self.end(block, at)
        return at + 1

    def holds(self, words: list[str]) -> bool:
        _, _, modulus, relation, value = words
        left = self.variables["x"] % int(modulus)
        return left == int(value) if relation == "==" else left < int(value)

    def choose(self, block: list[int], subject: float) -> int:
        for middle in block[1:-1]:
            line = self.lines[middle]
            if line == "ANY" or subject in [float(v) for v in line[6:-1].split(",")]:
                return middle + 1
        return block[-1] + 1

    def begin_for(self, at: int, words: list[str], closer: int) -> int:
        """`FOR i = a TO b STEP c`"""
        name, first, last, step = words[1], float(words[3]), float(words[5]), float(words[7])
        self.variables[name] = first
        self.limits[at] = (last, step)
        return at + 1 if self.inside(first, last, step) else closer + 1

    def inside(self, value: float, last: float, step: float) -> bool:
        return value <= last if step > 0 else value >= last

    def end(self, block: list[int], at: int) -> int | None:
        opener = block[0]
        word = self.lines[opener].split(" ")
        if word[0] == "WHILE":
            return opener
        if word[0] != "FOR":
            return at + 1
        if opener not in self.limits or word[1] not in self.variables:
            return None
        last, step = self.limits[opener]
        self.variables[word[1]] += step
        return opener + 1 if self.inside(self.variables[word[1]], last, step) else at + 1
