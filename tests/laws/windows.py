"""A book of which only the end is in memory is the same book, and comes back as the same after a kill.

`python -m tests.laws.windows COUNT [FIRST]` edits so many robots at random, each twice: with all in memory, and with a
small window and a journal. It prints the seed of each that differs; status 1 then.
"""

from __future__ import annotations

import shutil
import tempfile
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from random import Random

import pytest
from msgspec import structs

from tests.by_hand import command
from tests.net.edits import Edits
from vrs_cli.engine import book
from vrs_cli.engine.book import WindowSize
from vrs_cli.engine.branches import Branches
from vrs_cli.engine.engine import Engine
from vrs_cli.engine.history import HistoryStep
from vrs_cli.errors import VrsError
from vrs_cli.files import journal as journals
from vrs_cli.files import past, trajectory_file
from vrs_cli.files.journal import Journal, keep_journal, take_up
from vrs_cli.files.trajectory_file import read_trajectory
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.trajectory import timeline
from vrs_cli.wire import lines

EDITS = 150


class Robot:
    """A robot that is edited, with its journal; `reach`: how much of it is in memory, None for all."""

    def __init__(self, folder: Path, name: str, seed: int, reach: WindowSize | None) -> None:
        self.folder, self.name, self.reach, self.lives = folder, name, reach, 0
        self.edits = Edits(seed)
        self.edits.engine = Engine(load_robot("puma560"))
        self.begin()

    @property
    def engine(self) -> Engine:
        return self.edits.engine

    @property
    def path(self) -> Path:
        return self.folder / f"{self.name}-{self.lives}.vrst"

    def begin(self) -> None:
        changes = None if self.reach is None else self.reach.changes
        taken = take_up(self.path, changes=changes)
        self.resumed = taken.resumed is not None
        self.journal: Journal = keep_journal(taken, self.engine, pytest.fail, together=True, reach=self.reach)
        self.edits.branches = Branches(self.engine)
        self.edits._session.engine = self.engine

    def kill(self, torn: bytes) -> None:
        """Go on in another process, with a last line that was not written to its end."""
        self.journal.settle()
        old = self.path
        self.lives += 1
        shutil.copy(old, self.path)
        self.path.open("ab").write(torn)
        self.journal.close()
        self.edits.engine = Engine(load_robot("puma560"))
        self.begin()

    def edit(self, kind: str, count: int) -> str:
        """What comes of an edit."""
        try:
            if kind == "undo":
                return str(self.engine.undo(count))
            if kind == "redo":
                return str(self.engine.redo(count))
            getattr(self.edits, kind)()
        except VrsError as error:
            return str(error)
        return ""


KINDS = {"move": 70, "undo": 14, "redo": 10, "stop": 2, "steer": 8, "branch": 5, "merge": 4, "kill": 3}


def check_window(seed: int, folder: Path, edits: int = EDITS) -> int:
    """Edit a robot with a window and one without; how often it was read from a checkpoint."""
    random, resumed = Random(seed), 0
    reach = WindowSize(random.choice((6, 16, 40)), random.choice((1, 8, 40)), random.choice((8, 24)))
    short, whole = (Robot(folder, name, seed, one) for name, one in (("short", reach), ("whole", None)))
    for number in range(edits):
        (kind,) = random.choices(list(KINDS), list(KINDS.values()))
        if kind == "kill":
            torn = random.choice((b"", b"", b'{"version":12,"mot', b'{"checkpoint":'))
            short.kill(torn)
            whole.kill(torn)
            resumed += short.resumed
        else:
            count = random.choice((1, 1, 2, 3))
            if kind in ("undo", "redo"):
                count = min(count, _depth(short, whole, reach, undo=kind == "undo"))
            if count:
                assert short.edit(kind, count) == whole.edit(kind, count), (number, kind)
        _check_same(short, whole, random, thorough=kind == "kill" or not number % 25)
    _check_file(short)
    short.journal.close()
    whole.journal.close()
    return resumed


def _depth(short: Robot, whole: Robot, reach: WindowSize, *, undo: bool) -> int:
    """How many commands both can take back, or do again: all of the last changes at least."""
    ours, theirs = short.engine.book.history, whole.engine.book.history
    if not undo:
        known = ours.undone if len(ours.undone) == len(theirs.undone) and None not in ours.undone else []
        return len(known)
    if short.edits.branches.present != "main":
        return len(ours.done)
    oldest = short.engine.timeline.version - reach.changes
    recent = [step for step in theirs.done if step.delta.version >= oldest]
    assert list(map(_said, ours.done)) == list(map(_said, recent))
    return len(ours.done)


def _said(step: HistoryStep) -> str:
    """All of a step."""
    both = (structs.replace(step.delta, segments=tuple(step.delta.segments)), step.taking_back(0))
    return repr((both, step.clock, step.insert, step.altered))


def _check_same(short: Robot, whole: Robot, random: Random, *, thorough: bool) -> None:
    a, b = short.engine, whole.engine
    assert (a.timeline.version, len(a.timeline), a.end, a.now, a.book.number, a.book.history.commands) == (
        *(b.timeline.version, len(b.timeline), b.end, b.now, b.book.number, b.book.history.commands),
    )
    for t in [random.uniform(-1.0, b.end + 1.0) for _ in range(3)]:
        assert repr(a.position(t)) == repr(b.position(t))  # to the sign of a zero
        assert a.timeline.index_at(t) == b.timeline.index_at(t)
    if thorough:
        assert repr(list(a.timeline)) == repr(list(b.timeline))
        assert a.book.all_records()() == b.book.all_records()()
        assert len(a.book.deltas) == len(b.book.deltas)
        replayed = a.book.initial
        for delta in a.book.deltas:
            replayed = replayed.apply(delta)
        assert replayed == a.timeline


def _check_file(short: Robot) -> None:
    """Who reads all of it finds the same."""
    short.journal.settle()
    recording = read_trajectory(short.path)
    main = short.edits.branches.book("main")
    assert recording.timeline == main.timeline
    assert len(recording.deltas) == len(main.deltas)


@contextmanager
def small_parts() -> Iterator[None]:
    """Parts of few deltas, and rows of few segments."""
    with pytest.MonkeyPatch.context() as patch:
        for module in (timeline, lines, journals, past, book, trajectory_file):
            patch.setattr(module, "PART", 4)
        patch.setattr(book, "ROW_LENGTH", 6)
        yield


def main(count: int, first: int = 0) -> int:
    faults = resumed = 0
    for seed in range(first, first + count):
        try:
            with tempfile.TemporaryDirectory() as folder, small_parts():
                resumed += check_window(seed, Path(folder))
        except Exception:
            faults += 1
            print(f"--- seed {seed}\n{traceback.format_exc()}", flush=True)
    print(f"{count} robots, {resumed} times read from a checkpoint, {faults} faults", flush=True)
    return 1 if faults else 0


if __name__ == "__main__":
    command(main)
