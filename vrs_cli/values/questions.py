"""Define questions to users, and the state that a front end shows around the input line. `text`: the prompt before the
answer; `id` numbers the questions of one robot."""

from __future__ import annotations

from msgspec import Struct

from vrs_cli.errors import EndOfInput
from vrs_cli.kinematics.joints import JointUnits
from vrs_cli.values.diagnostics import Dialect
from vrs_cli.values.results import TaggedValue


class Asking(TaggedValue, frozen=True, kw_only=True):
    """A question. `id` is set when the question is asked; an answer carries the `id` of its question."""

    id: int = 0


class Confirmation(Asking, frozen=True):
    """A yes-or-no question before an action: `... (Y/N)?`. No answer means no."""

    text: str


class Parting(Asking, frozen=True):
    """The question that EXIT and Ctrl-D ask: `Leave ... (Y/N)?`. No answer means yes. `about`: text shown before the
    question."""

    text: str
    about: str = ""


class Amendment(Asking, frozen=True):
    """The question `Change?` for new numbers of a location. An empty line or no answer leaves the location
    unchanged."""

    text: str


class LineWanted(Asking, frozen=True):
    """A program's request for a line of input (PROMPT, READ, GETC). `wrong`: the mistake in the previous answer, if the
    question is repeated."""

    text: str
    wrong: str = ""


# --- full screens: the answer is None if the terminal has no full screen ---------------------------------------------


class Editing(Asking, frozen=True):
    """SEE: edit the whole text of a program; the cursor is in line `row` (counted from 0)."""

    name: str
    text: str
    row: int
    dialect: Dialect = Dialect.VPLUS


class Jogging(Asking, frozen=True):
    """JOG: move an arm with `joints` joints by keys, initially at `speed` [%]."""

    joints: int
    units: JointUnits
    speed: float


class Playing(Asking, frozen=True):
    """REPLAY: play a recorded trajectory."""

    path: str


class Watching(Asking, frozen=True):
    """SHOW: show the arm while it moves."""


OnScreen = Editing | Jogging | Playing | Watching
Question = Confirmation | Parting | Amendment | LineWanted | OnScreen
Answer = bool | str | None


def end_of_input(question: Question) -> EndOfInput:
    """Return the error for a question asked after the end of the input."""
    text = question.text if isinstance(question, LineWanted) else ""
    return EndOfInput(
        f"PROMPT {text!r} has nothing more to read",
        "give the input one more line",
        in_python="answers=[...] has one for each PROMPT",
    )


class Pace(Struct, frozen=True):
    """The rate of the robot clock: seconds of robot time per second of real time."""

    rate: float
    paused: bool = False


class PromptStatus(Struct, frozen=True):
    """The state shown around the input line. `prompt`: the text before the next line; `indent`: the blanks at its
    start. `in_program`: the line belongs to a program; `typed`: the program has unsaved lines. `asked`: the question of
    a program that waits for an answer from any user. `hidden`: constants (HAND, TIME) hidden by variables of the same
    name. `clock`, `end`: the robot clock and the end of the timeline [s]; `pace` is None in virtual time. `tool`: the
    tool's position in the world [m]."""

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
    """A completion: `text` replaces the last `length` characters; `meta` explains it."""

    text: str
    length: int
    meta: str = ""
