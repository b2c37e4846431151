"""Keep the motion commands of one robot for UNDO, and the undone commands for REDO.

A step holds a delta and the inverse delta, not the timelines between them, so a day of commands needs only the memory
for its deltas. To save more memory, the steps of old changes can be forgotten.

Recorded events (inputs from outside, observations of programs) are steps but not commands. In virtual time UNDO takes
recorded events back together with the command that precedes them. In real time UNDO keeps them, since they have
happened, and takes back only the commands.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterable, Sequence
from itertools import islice
from math import inf

from msgspec import Struct, structs

from vrs_cli.engine.settings import Altered
from vrs_cli.errors import TooLate, UsageError
from vrs_cli.trajectory.instant import round_to_ns
from vrs_cli.trajectory.row import Row
from vrs_cli.trajectory.segment import PackedMotion
from vrs_cli.trajectory.timeline import Cause, DeltaColumns, Timeline, TimelineDelta
from vrs_cli.values.commands import EventEdit, Motion, MotionKind, Start
from vrs_cli.values.results import CommandRecord

EVENT_KINDS = (MotionKind.EVENT, MotionKind.RECORDED)  # commands that change only events
WIDE_DROP = 64  # number of dropped segments above which the inverse of a step is made only on demand


class HistoryStep(Struct, frozen=True, gc=False):
    """A command that took effect: its delta, the inverse delta, the clock before the command [s], whether it inserted
    its motion (parameter INSERT), and the displacement of ALTER.

    `_source` is the delta, or the packed deltas that contain the delta at `_index`. `_back` is the inverse of the
    delta, or the packed deltas that contain the inverse at `_index`; or, if the inverse would be long, the timeline
    before the delta; or None if the delta only adds events, or segments at the end. `earlier`: the number of events
    that were later inserted before the events of this step. `is_record`: the step records events and is not a command.
    """

    _source: TimelineDelta | DeltaColumns
    _back: TimelineDelta | DeltaColumns | Timeline | None
    clock: float
    insert: bool = True
    altered: Altered | None = None
    earlier: int = 0
    is_record: bool = False
    _index: int = 0

    @staticmethod
    def of(
        before: Timeline, delta: TimelineDelta, clock: float, insert: bool, altered: Altered | None = None
    ) -> HistoryStep:
        if delta.motion.kind in EVENT_KINDS:
            adds = delta.events is not None and delta.events.adds
        else:
            alone = delta.events is None or delta.events.adds
            adds = alone and (delta.keep, delta.drop, delta.shift, delta.cut) == (len(before), 0, 0.0, before.end)
        inverse = None if adds else before if delta.drop > WIDE_DROP else before.inverse(delta)
        return HistoryStep(delta, inverse, clock, insert, altered, is_record=delta.motion.kind is MotionKind.RECORDED)

    @property
    def delta(self) -> TimelineDelta:
        """The delta of the command; it is made on demand if it is packed."""
        return self._source[self._index] if isinstance(self._source, DeltaColumns) else self._source

    @property
    def back(self) -> TimelineDelta | Timeline | None:
        """The inverse of the delta, made on demand if it is packed; or what `_back` has in its place."""
        return self._back[self._index] if isinstance(self._back, DeltaColumns) else self._back

    @property
    def number(self) -> int:
        """The number of the motion of the command."""
        source = self._source
        return (source.motion(self._index) if isinstance(source, DeltaColumns) else source.motion).number

    @property
    def version(self) -> int:
        """The version of the timeline before the command."""
        return self._source.version + self._index

    def taking_back(self, version: int) -> TimelineDelta:
        """Return the delta that undoes this command, to be applied to the timeline with the number `version`."""
        back, delta, edit = self.back, self.delta, self.delta.events
        if back is None:
            events = edit and EventEdit(edit.keep, len(edit.events))
            back = structs.replace(delta, cause=Cause.UNDO, drop=len(delta.segments), segments=(), events=events)
        elif isinstance(back, Timeline):
            back = back.inverse(delta)
        return structs.replace(back, version=version, events=self._present(back.events))

    def present(self, version: int) -> TimelineDelta:
        """Return the delta of this command, to be applied to the timeline with the number `version`."""
        return structs.replace(self.delta, version=version, events=self._present(self.delta.events))

    def _present(self, edit: EventEdit | None) -> EventEdit | None:
        """Return an edit of events whose index also counts the events that were later inserted before it."""
        return edit and structs.replace(edit, keep=edit.keep + self.earlier)

    def passed_by(self, record: HistoryStep, *, undone: bool) -> tuple[HistoryStep, HistoryStep] | None:
        """Swap this step with a later recorded step: return both as if the recorded step had come first. `undone`: this
        step was already undone when the recorded step came. Return None if that is impossible because the recorded step
        came after this step had begun.
        """
        edit, events = self.delta.events, record.delta.events
        if record.delta.executed > begins(self.delta):
            return None
        if edit is None or events is None:
            return self, record
        place = events.keep + record.earlier - edit.keep - self.earlier
        if place <= 0:
            return structs.replace(self, earlier=self.earlier + len(events.events)), record
        here, there = (edit.drop, len(edit.events)) if undone else (len(edit.events), edit.drop)
        if place < here or edit.shift:
            return None
        return self, structs.replace(record, earlier=record.earlier + there - here)


def begins(delta: TimelineDelta) -> float:
    """Return the first time [s] at which a command changes what the robot does."""
    return delta.executed if delta.motion.kind is MotionKind.EVENT else delta.cut


class Undone(Struct, frozen=True):
    """A step that was undone, and the clock before the undo [s]."""

    step: HistoryStep
    clock: float


class History:
    """The steps of one robot. `done`: the steps that are not undone, oldest first; the oldest ones may be missing, and
    `forgotten` is the number of commands among the missing steps. `undone`: the steps that were undone, the next step
    of REDO last; None for a forgotten step.
    """

    def __init__(
        self, done: Iterable[HistoryStep] = (), undone: Iterable[Undone | None] = (), forgotten: int = 0
    ) -> None:
        self.done = list(done)
        self.undone = list(undone)
        self.forgotten = forgotten

    @property
    def known_commands(self) -> list[HistoryStep]:
        """The commands that are neither undone nor forgotten, oldest first."""
        return [step for step in self.done if not step.is_record]

    @property
    def commands(self) -> int:
        """The number of commands that are not undone, including the forgotten ones."""
        return self.forgotten + len(self.known_commands)

    def copy(self) -> History:
        """Return a history with the same steps, whose later changes are separate."""
        return History(self.done, self.undone, self.forgotten)

    def forget(self, version: int) -> None:
        """Forget the commands that were given before timeline `version`. They can no longer be undone or redone."""
        old = 0
        while old < len(self.done) and self.done[old].version < version:
            old += 1
        if old:
            self.forgotten += sum(not step.is_record for step in self.done[:old])
            del self.done[:old]
        if self.undone and ((last := self.undone[-1]) is None or last.step.version < version):
            self.undone.clear()

    def share(self, columns: DeltaColumns, deltas: Sequence[TimelineDelta], motions: dict[int, PackedMotion]) -> None:
        """Make the steps of packed deltas refer to the columns instead of the deltas, which saves memory, and pack
        their inverses too. `motions`: as for `Row.pack_motions`.
        """
        first = bisect_left(self.done, columns.version, key=lambda step: step.version)
        found = {step.version - columns.version: step for step in self.done[first : first + len(deltas)]}
        steps = [(at, found[at]) for at, delta in enumerate(deltas) if at in found and found[at].delta is delta]
        inverses = {at: step.back for at, step in steps if isinstance(step.back, TimelineDelta)}
        # deltas without segments fill the places of other steps, so that one index serves for both columns
        backs = [
            inverses.get(at) or structs.replace(delta, segments=(), events=None) for at, delta in enumerate(deltas)
        ]
        packed = DeltaColumns(backs, None, motions) if inverses else None
        for at, step in steps:
            # change the step in place, because branches compare steps by identity; other threads may read it
            structs.force_setattr(step, "_index", at)
            structs.force_setattr(step, "_source", columns)
            if at in inverses:
                structs.force_setattr(step, "_back", packed)

    def add(self, step: HistoryStep) -> None:
        """Add a new command, after which earlier undone commands cannot be redone. After a recorded event they can
        still be redone, if the event can be placed before all of them.
        """
        self.done.append(step)
        if not self.undone:
            return
        undone: list[Undone | None] = []
        for one in reversed(self.undone if step.is_record else ()):
            passed = None if one is None else one.step.passed_by(step, undone=True)
            if one is None or passed is None:
                undone.clear()
                break
            undone.append(Undone(passed[0], one.clock))
            step = passed[1]
        self.undone = undone[::-1]

    def last_done(self, count: int, *, leaves_recorded: bool = False) -> Sequence[HistoryStep]:
        """Return the steps that UNDO takes back, the last step first: `count` commands and the recorded events after
        them; the recorded events stay if UNDO `leaves_recorded`. Raises UsageError if there are fewer commands, TooLate
        for a command that began before recorded events that stay.
        """
        known = len(self.known_commands)
        older = "what is older cannot be taken back any more" if self.forgotten else ""
        _check_count(known, count, "undo", f"at most {{UNDO {known}}}", older)
        taken: list[HistoryStep] = []
        stay: list[HistoryStep] = []
        for step in reversed(self.done):
            if step.is_record and leaves_recorded:
                stay.insert(0, step)
                continue
            alone, stay = _swap_with_records(step, stay)
            taken.append(alone)
            count -= not step.is_record
            if not count:
                break
        return taken

    def last_undone(self, count: int) -> Sequence[Undone]:
        """Return the steps that REDO repeats, the next step first: `count` commands, and the recorded events that were
        undone with them. Raises UsageError if there are fewer commands.
        """
        known = [one for one in reversed(self.undone) if one is not None]
        commands = [place for place, one in enumerate(known) if not one.step.is_record]
        never = "{REDO} follows {UNDO}; a new motion ends it"
        _check_count(len(commands), count, "redo", f"at most {{REDO {len(commands)}}}", never)
        return known[: (*commands, len(known))[count]]

    def take_back(self, clock: float, motion: Motion | None = None) -> None:
        """Move the step of a motion (default: the last step), even a forgotten one, to the undone steps; `clock` is the
        current time [s]. Raises UsageError if there is no step.
        """
        place = len(self.done) - 1
        while motion is not None and place >= 0 and self.done[place].number != motion.number:
            place -= 1
        if place >= 0:
            step, stay = _swap_with_records(self.done[place], self.done[place + 1 :])
            self.done[place:] = stay
            self.undone.append(Undone(step, clock))
        elif self.forgotten:
            self.forgotten -= motion is None or motion.kind is not MotionKind.RECORDED
            self.undone.append(None)
        else:
            _check_count(0, 1, "undo", "", "")

    def do_again(self, motion: Motion | None = None) -> None:
        """Move the step that was undone last back to the done steps. Raises UsageError if there is no such step.
        `motion`: the motion of the step, in case the step is forgotten.
        """
        if not self.undone:
            self.last_undone(1)
        last = self.undone.pop()
        if last is not None:
            self.done.append(last.step)
        elif motion is None or motion.kind is not MotionKind.RECORDED:
            self.forgotten += 1

    def lengthen_last(self, timeline: Timeline) -> None:
        """Complete the last command, which is a stream of targets: its step gets all segments since it began, so that
        UNDO takes them back together.
        """
        if not self.done:  # the command is already forgotten
            return
        step = self.done[-1]
        delta, back = step.delta, step.back
        segments = Row(islice(timeline, delta.keep, None))
        if isinstance(back, TimelineDelta):
            back = structs.replace(back, drop=back.drop + len(segments) - len(delta.segments))
        self.done[-1] = structs.replace(step, _source=structs.replace(delta, segments=segments), _back=back, _index=0)


def _swap_with_records(step: HistoryStep, behind: Sequence[HistoryStep]) -> tuple[HistoryStep, list[HistoryStep]]:
    """Swap a step with the recorded steps after it: return them as if the recorded steps had come first. Raises
    TooLate.
    """
    stay: list[HistoryStep] = []
    for record in behind:
        passed = step.passed_by(record, undone=False)
        if passed is None:
            text = step.delta.motion.text or "the last command"
            raise TooLate(f"{text} has begun before what was recorded since", "{ABORT} stops the motion")
        step = passed[0]
        stay.append(passed[1])
    return step, stay


def _check_count(known: int, count: int, what: str, most: str, none: str) -> None:
    """Raise UsageError if `count` commands cannot be undone or redone."""
    if not known:
        raise UsageError(f"there is no motion to {what}", none)
    if not 0 < count <= known:
        raise UsageError(f"there are not {count} motions to {what}", most)


def commands_in_force(deltas: Iterable[TimelineDelta]) -> Sequence[TimelineDelta]:
    """Return the deltas of the commands that are still in force (not undone) after a sequence of deltas. The returned
    deltas have no segments."""
    done: list[TimelineDelta] = []
    undone: list[TimelineDelta] = []
    for delta in deltas:
        if delta.motion.kind is MotionKind.RECORDED:
            continue
        if delta.cause is Cause.UNDO:
            undone.append(done.pop())
        elif delta.cause is Cause.REDO:
            done.append(undone.pop())
        # deltas with the same number are one stream of targets
        elif not done or delta.motion.number != done[-1].motion.number:
            done.append(structs.replace(delta, segments=()))
            undone.clear()
    return done


def records(timeline: Timeline, commands: Sequence[TimelineDelta]) -> tuple[CommandRecord, ...]:
    """Return a record of the command of each delta, with the times of its motion on the timeline."""
    commands = [delta for delta in commands if delta.motion.kind is not MotionKind.RECORDED]
    begins: dict[int, float] = {}
    ends: dict[int, float] = {}
    for block in timeline.blocks(-inf, inf) if commands else ():
        numbers = [motion.number for motion in block.row.motions[block.first : block.last]]
        starts, finishes = block.times()
        for number, start in zip(numbers, starts, strict=True):
            begins.setdefault(number, start)
        ends.update(zip(numbers, finishes, strict=True))
    if any(delta.motion.kind is MotionKind.EVENT for delta in commands):
        alone = {event.number: event.time for event in timeline.events if event.number not in begins}
        begins, ends = {**begins, **alone}, {**ends, **alone}
    found = []
    for delta in commands:
        motion, executed = delta.motion, round_to_ns(delta.executed)
        begin, end = begins.get(motion.number), ends.get(motion.number)
        times = executed if begin is None else round_to_ns(begin), None if end is None else round_to_ns(end)
        asked = executed if motion.start is Start.AT else None
        found.append(CommandRecord(motion.number, motion.text, round_to_ns(delta.issued), *times, asked))
    return tuple(found)
