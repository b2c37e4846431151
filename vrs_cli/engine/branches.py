"""What-if branches: other timelines of the same robot, tried, compared with each other, kept or dropped.

A branch begins as what is there: timeline, clock, settings, and what can be undone. It costs little, for timelines
share all that they have in common. `main` is the timeline that listeners hear of (the journal of a file, viewers): what
is tried on a branch reaches them with `merge` only, as deltas like any others.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import replace

from msgspec import Struct

from vrs_cli.engine.engine import Engine, Line
from vrs_cli.engine.history import Step
from vrs_cli.engine.planner import plan
from vrs_cli.engine.position import destination_at
from vrs_cli.engine.targets import aimed
from vrs_cli.errors import MotionError, UsageError
from vrs_cli.trajectory.delta import TimelineDelta
from vrs_cli.trajectory.motion import Motion, Start
from vrs_cli.trajectory.segment import Phase
from vrs_cli.trajectory.timeline import Timeline

MAIN = "main"


class Fork(Struct, frozen=True):
    """Where a branch left main: the timeline then, and the commands that held."""

    timeline: Timeline
    done: tuple[Step, ...]


class _Branch(Struct):
    """`fork` is None for main, `line` while the branch is the present one (the engine has it)."""

    name: str
    fork: Fork | None
    line: Line | None = None


class Branches:
    """The branches of one engine by name; the engine works on the `present` one. Names differ by more than case."""

    def __init__(self, engine: Engine) -> None:
        self.engine = engine
        self._all = {MAIN: _Branch(MAIN, None)}
        self._present = self._all[MAIN]

    # --- reading ---

    @property
    def names(self) -> tuple[str, ...]:
        """All names, main first."""
        return tuple(branch.name for branch in self._all.values())

    @property
    def present(self) -> str:
        return self._present.name

    @property
    def on_main(self) -> bool:
        return self._present.fork is None

    @property
    def main(self) -> Engine | Line:
        """What has the initial timeline and the deltas of main now."""
        return self._all[MAIN].line or self.engine

    def __contains__(self, name: str) -> bool:
        return name.lower() in self._all

    def spelled(self, name: str) -> str:
        """A name as it was given first. Raises UsageError for one that there is not."""
        return self._named(name).name

    def line(self, name: str) -> Line:
        """The state of a branch. Raises UsageError for a name that there is not."""
        return self._line(self._named(name))

    def _line(self, branch: _Branch) -> Line:
        return self.engine.line() if branch.line is None else branch.line

    def _named(self, name: str) -> _Branch:
        found = self._all.get(name.lower())
        if found is None:
            raise UsageError(f"there is no branch {name}", f"there are {', '.join(self.names)}")
        return found

    # --- changing over ---

    def make(self, name: str) -> None:
        """A branch of what is there, and change over to it. Raises UsageError for a name that there is already."""
        self._check_time()
        present = self._present
        fork = present.fork or Fork(self.engine.timeline, tuple(self.engine.history.done))
        self._add(_Branch(name, fork, self.engine.line()))
        self.change_over(name)

    def add(self, name: str, line: Line) -> None:
        """A branch that comes from elsewhere (a file) and has nothing of main. Raises UsageError as `make` does."""
        self._add(_Branch(name, Fork(line.initial, ()), line))

    def _add(self, branch: _Branch) -> None:
        if self.engine.realtime:
            raise UsageError("in real time there is one course of events", "without --realtime others can be tried")
        if branch.name in self:
            raise UsageError(f"there is a branch {branch.name} already", "take another name")
        self._all[branch.name.lower()] = branch

    def change_over(self, name: str) -> None:
        """Make another branch the present one; the engine is as it was when that was left."""
        branch = self._named(name)
        if branch is self._present:
            return
        self._check_time()
        self._present.line = self.engine.line()
        self.engine.take(self._line(branch), heard=branch.fork is None)
        branch.line = None
        self._present = branch

    def drop(self, name: str) -> None:
        """Forget a branch; from the present one back to main. Raises UsageError as `droppable` does."""
        if self.droppable(name) == self.present:
            self.change_over(MAIN)
        del self._all[name.lower()]

    def droppable(self, name: str) -> str:
        """The name, spelled. Raises UsageError for main, and for a name that there is not."""
        branch = self._named(name)
        if branch.fork is None:
            raise UsageError(f"{MAIN} cannot be deleted", "UNDO takes its commands back")
        return branch.name

    def _check_time(self) -> None:
        """Raises UsageError where the engine's clock keeps real time: what has happened is on all branches."""
        if getattr(self.engine, "realtime", False):
            raise UsageError("time is real here, and there is one course of events", "try it in a shell of its own")

    # --- merging ---

    def merge(self, name: str) -> int:
        """Make what a branch has become the main timeline, which is the present one then; the branch goes. How many
        commands were planned again.

        Where main has not changed since, it gets the branch to the bit, with clock and settings. Otherwise the
        commands of the branch are planned again on main, at their times or after its last motion, as they were
        given; main keeps its settings, and its clock goes on to that of the branch. Raises UsageError, MotionError,
        FileError; nothing is changed then.
        """
        branch = self._named(name)
        if branch.fork is None:
            raise UsageError(f"{MAIN} cannot be merged into itself", "MERGE branch")
        self._check_time()
        line, main = self._line(branch), self._line(self._all[MAIN])
        common = _common(main.deltas, line.deltas)
        if common == len(main.deltas) and line.initial == main.initial:
            again = 0
            self._carry_on(line, common)
        else:
            again = self._plan_again(branch, branch.fork, main, line)
        del self._all[branch.name.lower()]
        return again

    def _carry_on(self, line: Line, common: int) -> None:
        self.engine.record(line.deltas[common:])
        self.change_over(MAIN)
        self.engine.follow(line.deltas[common:])
        self.engine.take(line, heard=True)

    def _plan_again(self, branch: _Branch, fork: Fork, main: Line, line: Line) -> int:
        steps = _own_steps(branch.name, fork, line)
        planned = self._plans(branch.name, fork.timeline, main, steps)
        self.engine.record(planned)
        self.change_over(MAIN)
        engine = self.engine
        stood = line.clock >= line.timeline.end
        for step, delta in zip(steps, planned, strict=True):
            engine.commit(delta, engine.now, step.insert)
            if delta.motion.start is not Start.AT:
                engine.wait_for_rest()
            elif stood:  # as after motions in real time, each AT its instant: the clock goes on over them
                engine.clock.advance(engine.destination(delta.executed).time)
        engine.clock.advance(line.clock)
        return len(steps)

    def _plans(self, name: str, old: Timeline, main: Line, steps: Sequence[Step]) -> list[TimelineDelta]:
        """The steps of a branch that left main at `old`, planned one after another on what main is now."""
        timeline, deltas = main.timeline, list[TimelineDelta]()
        arm, slowest = self.engine.arm, main.settings.slowest
        for number, step in enumerate(steps, main.number + 1):
            motion = replace(step.delta.motion, number=number)
            when = _when(step.delta, old, timeline)
            try:
                before = destination_at(arm, timeline, when if motion.start is Start.AT else timeline.end)
                motion = aimed(arm, motion, before.joints)
                delta = plan(arm, timeline, motion, step.delta.issued, when, insert=step.insert, slowest=slowest)
            except MotionError as error:
                when_again = f"when {_said(motion)} of {name} is planned again on main"
                raise error.reworded(f"{when_again}: {error.detail}") from None
            deltas.append(delta)
            timeline, old = timeline.apply(delta), old.apply(replace(step.delta, version=old.version))
        return deltas


def _common(a: Sequence[TimelineDelta], b: Sequence[TimelineDelta]) -> int:
    """How many deltas two branches have in common: from the first on, until they part for good."""
    return bisect_left(range(min(len(a), len(b))), True, key=lambda index: a[index] is not b[index])


def _own_steps(name: str, fork: Fork, line: Line) -> Sequence[Step]:
    """What a branch did since it left main. Raises UsageError where it also took commands of main back."""
    done, known = line.history.done, fork.done
    if len(done) < len(known) or any(a is not b for a, b in zip(done, known, strict=False)):
        raise UsageError(
            f"{name} has undone commands of {MAIN}, which has changed since", f"UNDO them on {MAIN}, or DELETEB {name}"
        )
    return done[len(known) :]


def _when(delta: TimelineDelta, old: Timeline, new: Timeline) -> float:
    """When a command of the old timeline begins on the new one: at its own time, or behind the last motion as before.

    `Start.AFTER` keeps its pause, `Start.BLEND` its place in the deceleration where there is one.
    """
    start, last = delta.motion.start, new[-1]
    if start is Start.AT:
        return delta.executed
    if start is Start.BLEND and last.phase is Phase.DECELERATE:
        return min(last.start + max(delta.executed - old[-1].start, 0.0), new.end)
    return new.end + max(delta.executed - old.end, 0.0)


def _said(motion: Motion) -> str:
    return motion.text or "a motion"
