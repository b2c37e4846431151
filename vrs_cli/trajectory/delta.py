"""The timeline delta: the one form in which a change of the timeline exists.

It is what the planner f returns, what a timeline applies, a line of the trajectory file, the message of a stream, and
what undo takes back.
"""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple

from vrs_cli.trajectory.motion import Motion
from vrs_cli.trajectory.segment import Segment


class Cause(Enum):
    COMMAND = "command"
    UNDO = "undo"
    REDO = "redo"


class TimelineDelta(NamedTuple):
    """Turns timeline `version` into `version + 1`.

    The first `keep` segments stay; if the last of them ends after `cut` [s] it is truncated there. The next `drop`
    segments go. `segments` come in their place. All segments after them are shifted by `shift` [s], their paths
    untouched to the bit. `motion` is the motion that caused it, `issued` and `executed` its issue and execution time.
    """

    version: int
    cause: Cause
    motion: Motion
    issued: float
    executed: float
    cut: float
    keep: int
    drop: int
    shift: float
    segments: tuple[Segment, ...]
