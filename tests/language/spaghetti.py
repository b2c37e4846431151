"""Random programs of every block, with labels on random lines and jumps from anywhere to anywhere."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TypeVar

from hypothesis import strategies as st

DEEPEST = 3
FIRST_LABEL = 100

T = TypeVar("T")


@dataclass
class Weaver:
    """Writes lines as it draws. A `?` stands for a label until all lines are there."""

    draw: st.DrawFn
    lines: list[str] = field(default_factory=list)

    def among(self, *choices: T) -> T:
        return self.draw(st.sampled_from(choices))

    def between(self, low: int, high: int) -> int:
        return self.draw(st.integers(low, high))

    def condition(self) -> str:
        return f"x MOD {self.between(2, 5)} {self.among('==', '<')} {self.between(0, 3)}"

    def block(self, depth: int) -> None:
        for _ in range(self.between(1, 3)):
            self.statement(depth)

    def statement(self, depth: int) -> None:
        simple = (self.plain, self.jump)
        if depth == DEEPEST or self.between(0, 2) == 0:
            self.among(*simple)()
        else:
            self.among(self.branch, self.loop, self.case)(depth + 1)

    def plain(self) -> None:
        self.lines += [f'TYPE "{len(self.lines)}"', f"x = x+{self.between(1, 3)}"]

    def jump(self) -> None:
        self.lines.append(self.among("GOTO ?", f"IF {self.condition()} GOTO ?"))

    def branch(self, depth: int) -> None:
        self.lines.append(f"IF {self.condition()} THEN")
        self.block(depth)
        if self.among(True, False):
            self.lines.append("ELSE")
            self.block(depth)
        self.lines.append("END")

    def loop(self, depth: int) -> None:
        first, last, step = self.between(-2, 3), self.between(-2, 3), self.among(1, 2, -1)
        opener, closer = self.among(
            (f"WHILE {self.condition()} DO", "END"),
            ("DO", f"UNTIL {self.condition()}"),
            (f"FOR {self.among('i', 'j')} = {first} TO {last} STEP {step}", "END"),
        )
        self.lines.append(opener)
        self.block(depth)
        self.lines.append(closer)

    def case(self, depth: int) -> None:
        self.lines.append(f"CASE x MOD {self.between(2, 4)} OF")
        parts = [f"VALUE {value},{value + 2}:" for value in range(self.between(0, 2))]
        for part in parts + ["ANY"] * self.between(0, 1):
            self.lines.append(part)
            self.block(depth)
        self.lines.append("END")

    def labelled(self) -> list[str]:
        """The lines with labels on some of them, each jump to one of those."""
        places = st.integers(0, len(self.lines) - 1)
        targets = self.draw(st.lists(places, min_size=1, max_size=4, unique=True))
        labels = {target: str(FIRST_LABEL + target) for target in targets}
        lines = [line.replace("?", self.among(*labels.values())) if "?" in line else line for line in self.lines]
        return [f"{labels[number]} {line}" if number in labels else line for number, line in enumerate(lines)]


@st.composite
def spaghetti(draw: st.DrawFn) -> list[str]:
    """The lines of a program that reads and writes x, i and j, and types which line it comes by."""
    weaver = Weaver(draw, ["x = x+0"])
    weaver.block(0)
    return weaver.labelled()
