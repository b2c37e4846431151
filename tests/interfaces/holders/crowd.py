"""Many threads at one robot, with faults thrown in: what each of them was told, and whether all agree in the end."""

from __future__ import annotations

import errno
import os
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from threading import Thread
from typing import Any

import pytest

from tests.engine.mirror import mirrored
from tests.interfaces.holders.holder import Holder
from tests.interfaces.terminals import RecordingTerminal
from tests.live import PATIENCE
from vrs_cli.engine.engine import TimelineChange
from vrs_cli.engine.feed import MissedEvents, Subscription
from vrs_cli.errors import RequestRefused, VrsError
from vrs_cli.files.journal import Journal, keep_journal, take
from vrs_cli.files.trajectory_file import read_trajectory
from vrs_cli.interfaces.dialogue import Ticket
from vrs_cli.interfaces.session.session import Session
from vrs_cli.trajectory.timeline import Cause, Timeline, TimelineDelta
from vrs_cli.values.questions import Question
from vrs_cli.values.replies import Reply

PROGRAMS = """\
.PROGRAM swing
FOR i = 1 TO 20
DRIVE 1, 5, 100
DRIVE 1, -5, 100
END
.END
.PROGRAM endless
DO
k = k+1
DRIVE 2, 1, 100
DRIVE 2, -1, 100
UNTIL FALSE
.END
"""
LINES = (
    *("MOVE #PPOINT({0}, -90, 90, 0, {1}, 0)", "MOVE #PPOINT({0}, -80, 80, 0, 10, 0)", "DRIVE 1, {1}, 100") * 3,
    *("MOVE #PPOINT({0}, -90, 90, 0, {1}, 0) AT {2}", "DRIVE 6, {0} IN 0.1", "DELAY 0.1", "OPENI", "CLOSEI") * 2,
    *("UNDO", "UNDO 2", "REDO", "BRANCH a", *["BRANCH main"] * 4, "MERGE a", "DELETEB a", "COMPARE main, a"),
    *("SPEED {2}", "WHERE", "WHERE AT {2}", "STATUS", "x = {0}", "LISTR x", "HERE p{2}", "TIMELINE", "SIGNAL {2}"),
    *("EXECUTE swing", "EXECUTE endless", "PCEXECUTE swing", "PCABORT", "KILL 1", "ABORT", "ABORT", "PROCEED", "RETRY"),
    *("MOVEE x", "MOVE nowhere", "DRIVE 1, 4000", "DELETEP swing", "EDIT e{2}", "E", "TYPE x", "KILL", "MOVES p{2}"),
)


RUNNING = ("EXECUTE", "PROCEED", "RETRY")  # those may take for ever


@dataclass
class Disk:
    """It is full now and then: a write takes only a part, an fsync does not go through."""

    random: Random
    share: float
    faults: int = 0
    asked: int = 0

    def fails(self) -> bool:
        self.asked += 1
        failed = self.asked == 3 or self.random.random() < self.share  # how often it is asked depends on the threads
        self.faults += failed
        return failed

    @contextmanager
    def faulty(self) -> Iterator[None]:
        write = os.write

        def limited(handle: int, data: bytes) -> int:
            if not self.fails():
                return write(handle, data)
            if len(data) > 1:
                write(handle, bytes(data)[: len(data) // 2])
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

        def sync(_handle: int) -> None:
            if self.fails():
                raise OSError(errno.EIO, os.strerror(errno.EIO))

        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(os, "write", limited)
            patch.setattr(os, "fsync", sync)
            yield


@dataclass
class Watcher:
    """Somebody who hears of every change in a thread of its own, or takes what there is now and then, or raises."""

    events: Subscription[TimelineChange]
    raises_after: int | None = None
    heard: int = 0
    missed: int = 0
    timeline: Timeline | None = None

    def watch(self) -> None:
        for event in self.events:
            self.hear(event)
            if self.heard == self.raises_after:
                raise ZeroDivisionError

    def hear(self, event: TimelineChange | MissedEvents) -> None:
        self.heard += 1
        if isinstance(event, MissedEvents):
            self.missed += event.count
        self.timeline = mirrored([event], self.timeline) if not isinstance(event, MissedEvents) else self.timeline

    def catch_up(self) -> None:
        for event in self.events.take_all():
            self.hear(event)


@dataclass
class Crowd:
    """`lines` lines from `threads` threads, from a seed."""

    seed: int
    threads: int
    lines: int
    folder: Path
    full: float = 0.02  # share of the calls of the disk that fail
    together: bool = False
    done: int = 0
    refused: int = 0
    overtaken: int = 0
    left: int = 0
    wrong: list[str] = field(default_factory=list)
    running: list[tuple[str, Ticket[None]]] = field(default_factory=list)

    def run(self) -> None:
        session = Session(RecordingTerminal())
        session.load_text(PROGRAMS)
        self.told: list[str] = []
        path = self.folder / "day.vrst"
        journal = keep_journal(take(path), session.engine, self.told.append, together=self.together)
        disk = Disk(Random(self.seed), self.full)
        events = session.engine.events
        quick, late = Watcher(events.subscribe()), Watcher(events.subscribe(20))
        raising = Watcher(events.subscribe(), raises_after=50)
        events.subscribe()  # and is gone
        watching = [Thread(target=quick.watch), Thread(target=_quietly, args=(raising.watch,))]
        holding = [Thread(target=self._hold, args=(session, number)) for number in range(self.threads)]
        with disk.faulty():
            session.actor.serve()
            for thread in watching + holding:
                thread.start()
            for thread in holding:
                thread.join(3600.0)
                assert not thread.is_alive(), "a holder was never answered"
            Holder(session).stop().result(PATIENCE)
            for line, ticket in self.running:
                self._ended(line, ticket)
            session.actor.close()
        quick.events.end()
        for thread in watching:
            raising.events.end()
            thread.join(PATIENCE)
            assert not thread.is_alive(), "a watcher still reads"
        late.catch_up()
        self.faults = disk.faults
        assert not self.wrong, self.wrong[:3]
        assert not session.actor.internal_errors, session.actor.internal_errors
        self._agree(session, journal, (quick, late))
        assert late.missed > 0, "so few lines are not too many for anybody"

    def _hold(self, session: Session, number: int) -> None:
        random = Random(f"{self.seed} {number}")
        holder = Holder(session)
        for _ in range(self.lines // self.threads):
            line = random.choice(LINES).format(
                random.randint(-150, 150), random.randint(-30, 30), random.randint(1, 60)
            )
            chance = random.random()
            ticket = holder.stop() if chance < 0.005 else holder.ask(line, yes if number % 2 == 0 else no)
            if 0.005 <= chance < 0.02:
                holder.leave()
                holder, self.left = Holder(session), self.left + 1
                continue
            if holder.now < 0.0 or holder.timeline.end < 0.0:
                self.wrong.append("a reader saw a time that there is not")
            if line.startswith(RUNNING):
                self.running.append((line, ticket))
                continue
            self._ended(line, ticket)

    def _ended(self, line: str, ticket: Ticket[None]) -> None:
        try:
            ticket.result(PATIENCE)
            self.done += 1
        except RequestRefused:
            self.overtaken += 1
        except VrsError:
            self.refused += 1
        except BaseException as error:
            self.wrong.append(f"{line}: {error!r}")

    def _agree(self, session: Session, journal: Journal, watchers: tuple[Watcher, ...]) -> None:
        """Timeline, deltas, history, the journal read back, and all who watched."""
        engine = session.engine
        for watcher in watchers:
            assert watcher.timeline is not None
            assert bits(watcher.timeline) == bits(engine.timeline)
        for name in session.branches.names:
            book = session.branches.book(name)
            book.end_stream()
            replayed = book.initial
            for delta in book.deltas:
                replayed = replayed.apply(delta)
            assert bits(replayed) == bits(book.timeline)
            assert len(book.deltas) == book.timeline.version
            assert [step.delta for step in book.history.done] == in_force(book.deltas)
        main = session.branches.book("main")
        journal.close()
        recording = read_trajectory(journal.path)
        assert bits(recording.timeline) == bits(main.timeline)
        assert list(map(repr, recording.deltas)) == list(map(repr, main.deltas))


def in_force(deltas: Iterable[TimelineDelta]) -> list[TimelineDelta]:
    """The commands that hold, by what was commanded, undone and done again."""
    done: list[TimelineDelta] = []
    undone: list[TimelineDelta] = []
    for delta in deltas:
        if delta.cause is Cause.UNDO:
            undone.append(done.pop())
        elif delta.cause is Cause.REDO:
            done.append(undone.pop())
        else:
            done.append(delta)
            undone = []
    return done


def yes(ticket: Ticket[Any], said: Reply | Question | None) -> None:
    if isinstance(said, Question):
        ticket.answer(said.id, True)


def no(ticket: Ticket[Any], said: Reply | Question | None) -> None:
    if isinstance(said, Question):
        ticket.answer(said.id, False)


def _quietly(act: Callable[[], None]) -> None:
    try:
        act()
    except ZeroDivisionError:
        return


def bits(timeline: Timeline) -> str:
    return repr((timeline.version, list(timeline)))
