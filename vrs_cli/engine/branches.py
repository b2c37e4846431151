"""Try other timelines of the same robot on what-if branches, which users can compare, merge or drop.

A branch begins as a copy of the timeline, clock, settings and undo history. The copy costs little, since timelines
share their common parts. The journal records only `main`. The changes of a branch are added to `main` only by `merge`,
as ordinary deltas.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import takewhile

from msgspec import Struct, structs

from vrs_cli.engine.book import Book, Parts, whole
from vrs_cli.engine.engine import Bookmark, Engine
from vrs_cli.engine.history import HistoryStep
from vrs_cli.engine.planner import plan
from vrs_cli.engine.position import destination_at
from vrs_cli.engine.targets import retarget
from vrs_cli.errors import MotionError, UsageError
from vrs_cli.trajectory.segment import Phase
from vrs_cli.trajectory.timeline import Cause, Timeline, TimelineDelta
from vrs_cli.values.commands import HAND, EventEdit, Motion, MotionKind, Start

MAIN = "main"


class Fork(Struct, frozen=True):
    """The state of main when a branch was made from it: the timeline, and the commands that were not undone."""

    timeline: Timeline
    done: tuple[HistoryStep, ...]

    def leaves(self, main: Book) -> bool:
        """Return whether main is unchanged since the branch left it. A branch that was read from a file counts as
        having left main before main's first change.
        """
        return self.timeline is main.timeline if main.deltas else self.timeline == main.initial


class _Branch(Struct):
    """A branch. `fork` is None for main. `left`: the state in which the branch was left; None for the current branch,
    whose state is in the engine.
    """

    name: str
    fork: Fork | None
    left: Bookmark | None = None


class Branches:
    """The branches of one engine by name; the engine works on the `present` (current) branch. Names that differ only in
    case are the same.

    All users share main; every other branch is visible only to the user who made it. `who`: the user whose request is
    being served; the engine works on the branch where this user last was.
    """

    def __init__(self, engine: Engine) -> None:
        self.engine = engine
        self.who: Hashable = None
        self._main = self._present = _Branch(MAIN, None)
        self._made: dict[tuple[Hashable, str], _Branch] = {}  # branches by user and name
        self._places: dict[Hashable, _Branch] = {}  # the branch of each user who is not on main

    # --- reading ---

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names of all branches that the current user can see, main first."""
        return (MAIN, *(branch.name for (who, _), branch in self._made.items() if who == self.who))

    @property
    def present(self) -> str:
        return self._present.name

    def __contains__(self, name: str) -> bool:
        return self._find(name) is not None

    def spelling(self, name: str) -> str:
        """Return a branch's name in the spelling of its creation. Raises UsageError for an unknown name."""
        return self._branch_named(name).name

    def book(self, name: str) -> Book:
        """Return the book of a branch. Raises UsageError for an unknown name."""
        return self.bookmark_of(name).book

    def bookmark_of(self, name: str) -> Bookmark:
        """Return the bookmark at which a branch was left; for the current branch, a bookmark of the current state.
        Raises UsageError for an unknown name.
        """
        return self._bookmark_of(self._branch_named(name))

    def _bookmark_of(self, branch: _Branch) -> Bookmark:
        """Return the bookmark at which a branch was left; for the current branch, a bookmark of the current state."""
        return self.engine.bookmark() if branch.left is None else branch.left

    def _find(self, name: str) -> _Branch | None:
        """Return a branch by its name; None if the current user has no such branch."""
        return self._main if name.lower() == MAIN else self._made.get((self.who, name.lower()))

    def _branch_named(self, name: str) -> _Branch:
        found = self._find(name)
        if found is None:
            raise UsageError(f"there is no branch {name}", f"there are {', '.join(self.names)}")
        return found

    # --- switching branches ---

    def make(self, name: str) -> None:
        """Make a branch from the current state, and switch to it. Raises UsageError for a name that is in use."""
        self.engine.book.end_stream()  # first: this changes the last command, which the branch shares with main
        here = self.engine.bookmark()
        fork = self._present.fork or Fork(here.book.timeline, tuple(here.book.history.done))
        self._add(_Branch(name, fork, structs.replace(here, book=here.book.copy())))
        self.change_over(name)

    def add(self, name: str, left: Bookmark) -> None:
        """Add a branch that was read from a file and shares no commands with main. Raises the same UsageError as
        `make`.
        """
        self._add(_Branch(name, Fork(left.book.initial, ()), left))

    def _add(self, branch: _Branch) -> None:
        self._check_time()
        if branch.name in self:
            raise UsageError(f"there is a branch {branch.name} already", "take another name")
        self._made[(self.who, branch.name.lower())] = branch

    def change_over(self, name: str) -> None:
        """Switch to another branch: the engine continues where that branch was left."""
        branch = self._branch_named(name)
        if branch is not self._present:
            self._check_time()
            self._change_over(branch)

    def _change_over(self, branch: _Branch) -> None:
        self._present.left = self.engine.bookmark()
        self.engine.take_up(self._bookmark_of(branch))
        self._present, branch.left = branch, None
        self._places[self.who] = branch

    def serve(self, who: Hashable, *, stay: bool = False) -> None:
        """Switch to the branch where a user was last; a new user is on main. `stay`: stay on the current branch,
        because a program or command runs on it.
        """
        self.who = who
        place = self._places.get(who, self._main)
        if place is not self._present and not stay:
            self._change_over(place)

    def is_at(self, who: Hashable) -> bool:
        """Return whether a user is on the current branch."""
        return self._places.get(who, self._main) is self._present

    @contextmanager
    def own_in_place(self) -> Iterator[None]:
        """Put the current user's own branch into the engine, only for reading, while a program or command runs on
        another branch. Listeners get no event.
        """
        there, place = self._present, self._places.get(self.who, self._main)
        there.left = self.engine.bookmark()
        self._put(place)
        try:
            yield
        finally:
            self._put(there)
            there.left = None

    def _put(self, branch: _Branch) -> None:
        """Put the book, settings and clock of a branch into the engine. Listeners get no event."""
        assert branch.left is not None
        mark, self._present = branch.left, branch
        self.engine.book, self.engine.settings = mark.book, mark.settings
        self.engine.clock.set(mark.clock)

    def seen_by(self, who: Hashable) -> tuple[Timeline, float]:
        """Return the timeline of a user's branch, and the time that its clock has reached [s]. Any thread may call
        it.
        """
        place, engine = self._places.get(who, self._main), self.engine
        while True:
            book, now = engine.book, engine.clock.reached
            left = place.left  # set before the engine leaves the branch, and deleted after it has returned
            if left is not None:
                return left.book.timeline, left.clock
            if engine.book is book:
                return book.timeline, now

    def forget(self, who: Hashable) -> None:
        """Remove a user who has left, and the branches of that user."""
        if self._places.get(who) is self._present:
            self._change_over(self._main)
        self._made = {key: branch for key, branch in self._made.items() if key[0] != who}
        self._places.pop(who, None)

    def drop(self, name: str) -> None:
        """Remove a branch; if it is the current branch, switch to main first. Raises the same UsageError as
        `droppable`.
        """
        if self.droppable(name) == self.present:
            self.change_over(MAIN)
        del self._made[(self.who, name.lower())]

    def droppable(self, name: str) -> str:
        """Return the name of a branch that may be dropped, in the spelling of its creation.

        Raises UsageError for main and for an unknown name.
        """
        branch = self._branch_named(name)
        if branch.fork is None:
            raise UsageError(f"{MAIN} cannot be deleted", "UNDO takes its commands back")
        return branch.name

    def _check_time(self) -> None:
        """Raise UsageError if the engine has a real-time clock, which does not allow branches."""
        if self.engine.realtime:
            raise UsageError("time is real here, and there is one course of events", "try it in a shell of its own")

    # --- merging ---

    def merge(self, name: str) -> int:
        """Merge a branch into main, switch to main, and delete the branch. Return how many commands were planned again.

        If main has not changed since the branch left it, main becomes an exact copy of the branch, with clock and
        settings. Otherwise the commands of the branch are planned again on main, as they were given, at their times or
        after the last motion of main; main keeps its settings, and its clock advances at least to the clock of the
        branch. Raises UsageError, MotionError, FileError; nothing is changed then.
        """
        return whole(self.merge_in_parts(name))

    def merge_in_parts(self, name: str) -> Parts[int]:
        """Do `merge` in parts. Also raises RequestRefused, if the robot was stopped between two parts."""
        branch = self._branch_named(name)
        if branch.fork is None:
            raise UsageError(f"{MAIN} cannot be merged into itself", "{MERGE branch}")
        self._check_time()
        left, main = self._bookmark_of(branch), self._bookmark_of(self._main)
        steps: Sequence[HistoryStep] = ()
        if branch.fork.leaves(main.book):
            yield from self._check_again(branch.fork, main, left.book)
            main.book.follow(left.book)
            merged = structs.replace(left, book=main.book)
        else:
            steps, timeline, clock = yield from self._plan_again(branch.name, branch.fork, main, left)
            main.book.commit(steps, timeline)
            merged = structs.replace(main, clock=clock)
        self.change_over(MAIN)
        self.engine.take_up(merged)
        del self._made[(self.who, name.lower())]
        return sum(not step.is_record for step in steps)

    def _check_again(self, fork: Fork, main: Bookmark, other: Book) -> Parts[None]:
        """Run the engine's checks on the commands of a branch (the book `other`), with the settings of main."""
        other.end_stream()
        begun, timeline = (main.book.timeline, other.timeline), main.book.timeline
        done, known = other.history.done, fork.done
        same = sum(1 for _ in takewhile(lambda pair: pair[0] is pair[1], zip(done, known, strict=False)))
        for step in reversed(known[same:]):  # commands of main that the branch has undone
            timeline = timeline.apply(step.taking_back(timeline.version))
        for step in done[same:]:
            delta = step.present(timeline.version)
            self.engine.check(timeline, delta, main.settings)
            timeline = timeline.apply(delta)
            yield
            main.book.check_same(begun[0])
            other.check_same(begun[1])

    def _plan_again(
        self, name: str, fork: Fork, main: Bookmark, left: Bookmark
    ) -> Parts[tuple[list[HistoryStep], Timeline, float]]:
        """Plan the commands of a branch again, in order, on main as it is now. Return the commands, and the timeline
        and clock of main after them.
        """
        begun, timeline = (main.book.timeline, left.book.timeline), main.book.timeline
        old, clock = fork.timeline, main.clock
        arm, slowest = self.engine.arm, main.settings.slowest
        stood, planned = left.clock >= left.book.timeline.end, list[HistoryStep]()
        done, known = left.book.history.done, fork.done
        if len(done) < len(known) or any(a is not b for a, b in zip(done, known, strict=False)):
            undone = f"{name} has undone commands of {MAIN}, which has changed since"
            raise UsageError(undone, f"{{UNDO}} them on {MAIN}, or {{DELETEB {name}}}")
        numbers: dict[int, int] = {}  # number of a command on the branch => its number on main
        for number, step in enumerate(done[len(known) :], main.book.number + 1):
            motion = structs.replace(step.delta.motion, number=number)
            numbers[step.delta.motion.number] = number
            if motion.kind in (MotionKind.EVENT, MotionKind.RECORDED):
                delta = _set_again(step.delta, motion, old, timeline, numbers)
                self.engine.check(timeline, delta, main.settings)
                planned.append(HistoryStep.of(timeline, delta, clock, step.insert))
                timeline, old = timeline.apply(delta), old.apply(step.present(old.version))
                continue
            when = _when(step.delta, old, timeline)
            try:
                before = destination_at(arm, timeline, when if motion.start is Start.AT else timeline.end)
                motion, edit = retarget(arm, motion, before.joints), step.delta.events
                own = HAND, step.delta.motion.number  # the event of the hand that accompanies the motion
                events = [one for one in edit.events if (one.channel, one.number) == own] if edit else []
                event = events[0]._replace(number=number) if events else None
                issued, insert = step.delta.issued, step.insert
                delta = plan(arm, timeline, motion, issued, when, insert=insert, slowest=slowest, event=event)
            except MotionError as error:
                what = f"when {motion.text or 'a motion'} of {name} is planned again on main"
                raise error.reworded(f"{what}: {error.detail}") from None
            self.engine.check(timeline, delta, main.settings)
            planned.append(HistoryStep.of(timeline, delta, clock, step.insert))
            timeline, old = timeline.apply(delta), old.apply(step.present(old.version))
            if motion.start is not Start.AT:
                clock = max(clock, timeline.end)
            elif stood:  # the clock does not wait for a motion with a time stamp, unless the branch had finished
                clock = max(clock, destination_at(arm, timeline, delta.executed).time)
            yield
            main.book.check_same(begun[0])
            left.book.check_same(begun[1])
        return planned, timeline, max(clock, left.clock)


def _set_again(
    delta: TimelineDelta, motion: Motion, old: Timeline, new: Timeline, numbers: Mapping[int, int]
) -> TimelineDelta:
    """Return the delta that repeats on main (`new`) a command of a branch (`old`) that sets channels.

    The time of the event is the same. If the event is tied to a motion, it stays at the same point of that motion.
    `numbers`: the numbers on main of the branch's motions.
    """
    assert delta.events is not None
    t = delta.executed
    if delta.events.events[0].tied:
        segment = old[old.index_at(t)]
        same = numbers.get(segment.motion.number, segment.motion.number)
        there = next((one for one in reversed(new) if one.motion.number == same), None)
        if there is not None:
            t = (
                max(t + there.finish - segment.finish, 0.0)
                if t > segment.finish
                else min(t - segment.start + there.start, there.finish)
            )
    events = tuple(event._replace(time=t, number=motion.number) for event in delta.events.events)
    edit = EventEdit(new.events_by(t), events=events)
    return structs.replace(
        delta,
        version=new.version,
        motion=motion,
        executed=t,
        cut=new.end,
        keep=len(new),
        cause=Cause.COMMAND,
        events=edit,
    )


def _when(delta: TimelineDelta, old: Timeline, new: Timeline) -> float:
    """Return when a command of the old timeline begins on the new timeline [s]: at its own time, or after the last
    motion.

    A `Start.AFTER` command keeps its pause. A `Start.BLEND` command begins at the same point of the deceleration, if
    the last motion decelerates.
    """
    start, last = delta.motion.start, new[-1]
    if start is Start.AT:
        return delta.executed
    if start is Start.BLEND and last.phase is Phase.DECELERATE:
        return min(last.start + max(delta.executed - old[-1].start, 0.0), new.end)
    return new.end + max(delta.executed - old.end, 0.0)
