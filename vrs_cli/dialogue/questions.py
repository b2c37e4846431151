"""What is asked of whoever drives a session, as values: `text` is what stands before the answer."""

from __future__ import annotations

from msgspec import Struct


class Confirmation(Struct, frozen=True):
    """`... (Y/N)?`: yes or no. Where nobody can answer, the answer is no."""

    text: str


class Parting(Struct, frozen=True):
    """`Leave ... (Y/N)?`: EXIT and Ctrl-D say yes too."""

    text: str


class Amendment(Struct, frozen=True):
    """`Change?`: the new numbers of a location; an empty line takes it as it is."""

    text: str


class LineWanted(Struct, frozen=True):
    """PROMPT, READ: a line for a program."""

    text: str


Question = Confirmation | Parting | Amendment | LineWanted
