"""What is asked of people, as values: `text` is what stands before the answer, `id` says which of one robot it is."""

from __future__ import annotations

from vrs_cli.dialogue.spoken import Spoken


class Asking(Spoken, frozen=True, kw_only=True):
    """`id` is given when it is put to somebody: an answer names it, and is for no other question."""

    id: int = 0


class Confirmation(Asking, frozen=True):
    """`... (Y/N)?`: whether it is to be done. Where nobody answers, it is not."""

    text: str


class Parting(Asking, frozen=True):
    """`Leave ... (Y/N)?`: EXIT and Ctrl-D say yes too, and so does nobody. `about`: what is told before."""

    text: str
    about: str = ""


class Amendment(Asking, frozen=True):
    """`Change?`: the new numbers of a location; an empty line takes it as it is. Where nobody answers, it is left."""

    text: str


class LineWanted(Asking, frozen=True):
    """PROMPT, READ, GETC: a line for a program; `wrong`: what is wrong with the line before, if it is asked again."""

    text: str
    wrong: str = ""


Question = Confirmation | Parting | Amendment | LineWanted
Answer = bool | str | None
