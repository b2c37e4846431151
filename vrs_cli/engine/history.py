"""What can be taken back and done again: the motion commands of one robot, and the list of those that were undone.

A step holds the delta that took place and the one that takes it back, not the timelines between them: a day of
commands costs what its deltas cost. Where even that is too much, the steps of old changes are forgotten.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import islice
from math import inf
from typing import TypeVar

from msgspec import Struct, structs

from vrs_cli.engine.settings import Altered
from vrs_cli.errors import UsageError
from vrs_cli.trajectory.instant import shown
from vrs_cli.trajectory.row import Row
from vrs_cli.trajectory.timeline import Cause, Timeline, TimelineDelta
from vrs_cli.values.motion import Start
from vrs_cli.values.results import CommandRecord

_S = TypeVar("_S")

WIDE = 64  # segments that a step drops: taking back a wider one is prepared when it is asked for


class HistoryStep(Struct, frozen=True):
    """A command that took place: its delta, the inverse of it, the clock before it [s], the policy INSERT, and what
    ALTER has displaced with it.

    `back` is the inverse of the delta, or the timeline before it where the inverse would be long.
    """

    delta: TimelineDelta
    back: TimelineDelta | Timeline
    clock: float
    insert: bool = True
    altered: Altered | None = None

    @staticmethod
    def of(
        before: Timeline, delta: TimelineDelta, clock: float, insert: bool, altered: Altered | None = None
    ) -> HistoryStep:
        return HistoryStep(delta, before if delta.drop > WIDE else before.inverse(delta), clock, insert, altered)

    def taking_back(self, version: int) -> TimelineDelta:
        """The delta that undoes it, for the timeline of that version."""
        back = self.back.inverse(self.delta) if isinstance(self.back, Timeline) else self.back
        return back._replace(version=version)


class Undone(Struct, frozen=True):
    """A step that was taken back, and the clock before that [s]."""

    step: HistoryStep
    clock: float


class History:
    """`done`: the steps that hold, oldest first, but for `forgotten` ones before them. `undone`: those that were taken
    back, the next to redo last; None for one that is not known.
    """

    def __init__(
        self, done: Iterable[HistoryStep] = (), undone: Iterable[Undone | None] = (), forgotten: int = 0
    ) -> None:
        self.done = list(done)
        self.undone = list(undone)
        self.forgotten = forgotten

    @property
    def commands(self) -> int:
        """The number of commands in force."""
        return self.forgotten + len(self.done)

    def copy(self) -> History:
        return History(self.done, self.undone, self.forgotten)

    def forget(self, version: int) -> None:
        """Forget the commands that were given before that version: they cannot be taken back or done again any more."""
        old = 0
        while old < len(self.done) and self.done[old].delta.version < version:
            old += 1
        if old:
            del self.done[:old]
            self.forgotten += old
        if self.undone and ((last := self.undone[-1]) is None or last.step.delta.version < version):
            self.undone.clear()

    def add(self, step: HistoryStep) -> None:
        """Add a new command: what was undone before it cannot be done again."""
        self.done.append(step)
        self.undone.clear()

    def last_done(self, count: int) -> Sequence[HistoryStep]:
        """The steps that UNDO takes back, the last one first. Raises UsageError where there are not so many."""
        older = "what is older cannot be taken back any more" if self.forgotten else ""
        return _last(self.done, count, "undo", older)

    def last_undone(self, count: int) -> Sequence[Undone]:
        """The steps that REDO does again, the next one first. Raises UsageError where there are not so many."""
        known = [one for one in self.undone if one is not None]
        return _last(known, count, "redo", "REDO follows UNDO; a new motion ends it")

    def take_back(self, clock: float) -> None:
        """Undo the last step, which may be forgotten; `clock` is the time now [s]. Raises UsageError for none."""
        if self.forgotten and not self.done:
            self.forgotten -= 1
            self.undone.append(None)
            return
        self.last_done(1)
        self.undone.append(Undone(self.done.pop(), clock))

    def do_again(self) -> None:
        """Let the step that was taken back last hold again. Raises UsageError where there is none."""
        if self.undone and self.undone[-1] is None:
            self.undone.pop()
            self.forgotten += 1
            return
        self.last_undone(1)
        last = self.undone.pop()
        assert last is not None
        self.done.append(last.step)

    def lengthen_last(self, timeline: Timeline) -> None:
        """End the stream of targets that is the last command: UNDO takes back all that stands since it began."""
        if not self.done:  # it is forgotten: it began too long ago
            return
        step = self.done[-1]
        segments, back = Row(islice(timeline, step.delta.keep, None)), step.back
        if isinstance(back, TimelineDelta):
            back = back._replace(drop=back.drop + len(segments) - len(step.delta.segments))
        self.done[-1] = structs.replace(step, delta=step.delta._replace(segments=segments), back=back)


def _last(steps: Sequence[_S], count: int, what: str, hint: str = "") -> Sequence[_S]:
    if not steps:
        raise UsageError(f"there is no motion to {what}", hint)
    if not 0 < count <= len(steps):
        raise UsageError(f"there are not {count} motions to {what}", f"at most {what.upper()} {len(steps)}")
    return steps[: -count - 1 : -1]


def held(deltas: Iterable[TimelineDelta]) -> Sequence[TimelineDelta]:
    """The deltas of the commands that hold after a row of deltas, without their segments."""
    done: list[TimelineDelta] = []
    undone: list[TimelineDelta] = []
    for delta in deltas:
        if delta.cause is Cause.UNDO:
            undone.append(done.pop())
        elif delta.cause is Cause.REDO:
            done.append(undone.pop())
        elif not done or delta.motion.number != done[-1].motion.number:  # else one more target of a stream
            done.append(delta._replace(segments=()))
            undone.clear()
    return done


def records(timeline: Timeline, commands: Sequence[TimelineDelta]) -> tuple[CommandRecord, ...]:
    """The commands that deltas are of, with the times of their motions on a timeline."""
    begins: dict[int, float] = {}
    ends: dict[int, float] = {}
    for block in timeline.blocks(-inf, inf) if commands else ():
        numbers = [motion.number for motion in block.row.motions[block.first : block.last]]
        starts, finishes = block.times()
        for number, start in zip(numbers, starts, strict=True):
            begins.setdefault(number, start)
        ends.update(zip(numbers, finishes, strict=True))
    found = []
    for delta in commands:
        motion, executed = delta.motion, shown(delta.executed)
        begin, end = begins.get(motion.number), ends.get(motion.number)
        times = executed if begin is None else shown(begin), None if end is None else shown(end)
        asked = executed if motion.start is Start.AT else None
        found.append(CommandRecord(motion.number, motion.text, shown(delta.issued), *times, asked))
    return tuple(found)
