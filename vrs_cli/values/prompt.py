"""The state that a front end shows around the line that is typed: prompt, toolbar, suggestions."""

from __future__ import annotations

from msgspec import Struct


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
