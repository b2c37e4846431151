"""Questions to people, as values: `text` is what stands before the answer, `id` says which of one robot it is."""

from __future__ import annotations

from msgspec import Struct

from vrs_cli.errors import EndOfInput
from vrs_cli.kinematics.joints import JointUnits
from vrs_cli.values.diagnostics import Dialect
from vrs_cli.values.tagged import Spoken


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


# --- what fills a screen, until its user leaves: the answer is None where there is no screen for it -----------------


class Editing(Asking, frozen=True):
    """SEE: a program as a text, the cursor in line `row` (from 0)."""

    name: str
    text: str
    row: int
    dialect: Dialect = Dialect.VPLUS


class Jogging(Asking, frozen=True):
    """JOG: keys that move an arm of so many joints, at first with `speed` [%]."""

    joints: int
    units: JointUnits
    speed: float


class Playing(Asking, frozen=True):
    """REPLAY: the trajectory of a file."""

    path: str


class Watching(Asking, frozen=True):
    """SHOW: the arm, as long as it moves."""


OnScreen = Editing | Jogging | Playing | Watching
Question = Confirmation | Parting | Amendment | LineWanted | OnScreen
Answer = bool | str | None


def end_of_input(question: Question) -> EndOfInput:
    """The input has ended where a line is asked for."""
    text = question.text if isinstance(question, LineWanted) else ""
    return EndOfInput(
        f"PROMPT {text!r} has nothing more to read",
        "give the input one more line",
        in_python="answers=[...] has one for each PROMPT",
    )


class Pace(Struct, frozen=True):
    """A clock on the wall: so many seconds of the robot in one second."""

    rate: float
    paused: bool = False


class PromptStatus(Struct, frozen=True):
    """`prompt` stands before the next line, `indent` in it; `in_program`: that line is one of a program, and `typed`
    says whether something would be lost if it were left now. `asked`: what a program asks, whose question nobody has
    before him. `hidden`: the words (HAND, TIME) that are names of variables here.

    `clock`, `end` [s] of the timeline; `pace` is None where time is the robot's own. `tool` [m] in the world.
    """

    prompt: str = "."
    indent: str = ""
    in_program: bool = False
    typed: bool = False
    running: bool = False
    asked: str = ""
    hidden: tuple[str, ...] = ()
    clock: float = 0.0
    end: float = 0.0
    pace: Pace | None = None
    tool: tuple[float, float, float] = (0.0, 0.0, 0.0)
    monitor_speed: float = 100.0
    speed: float = 100.0
    speed_unit: str = "%"
    configuration: str = ""
    branch: str = ""
    driver: str = ""


class Suggestion(Struct, frozen=True):
    """`text` takes the place of the last `length` characters; `meta` explains it."""

    text: str
    length: int
    meta: str = ""
