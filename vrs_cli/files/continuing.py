"""Going on with a recorded trajectory: what an engine takes up, and the journal that it writes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

from vrs_cli.engine.book import Book, MemoryWindow, WindowSize
from vrs_cli.engine.engine import Bookmark, Engine
from vrs_cli.errors import UsageError
from vrs_cli.files.journal import Course, Journal, Taken
from vrs_cli.files.rebuild import history_of
from vrs_cli.files.trajectory_file import Recording
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.language.text.collector import pause_collector
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.wire.records import Form


@pause_collector()
def bookmark_of(path: str | Path, recording: Recording, engine: Engine) -> Bookmark:
    """The course of events of a file, with the settings that the engine has; the clock is at the end of the timeline.

    Raises UsageError where it is of another robot.
    """
    check_robot(path, recording.model, engine)
    book = Book(
        Timeline(recording.initial),
        recording.timeline,
        recording.deltas,
        history_of(recording.initial, recording.deltas),
        max((delta.motion.number for delta in recording.deltas), default=0),
    )
    return Bookmark(book, engine.settings, recording.timeline.end)


def _taken_up(it: Taken, engine: Engine) -> Bookmark | None:
    """Return the state with which the engine continues; None if the file is new. Raises UsageError."""
    found = it.resumed
    if found is None:
        return None if it.recording is None else bookmark_of(it.path, it.recording, engine)
    check_robot(it.path, found.model, engine)
    book = Book(Timeline(found.initial), found.timeline, found.deltas, found.history, found.number)
    return Bookmark(book, engine.settings, found.timeline.end)


def check_robot(path: str | Path, model: RobotModel, engine: Engine) -> None:
    """Raises UsageError where a file is of another robot than the engine's."""
    ours = engine.model
    theirs = replace(model, shapes=ours.shapes)  # how it looks makes no other robot
    if theirs == ours:
        return
    if theirs.name != ours.name:
        raise UsageError(f"{path} is of a {theirs.name}, this robot is a {ours.name}", "give --robot, or another file")
    raise UsageError(f"{path} is of a {theirs.name} with other figures than this one", "REPLAY plays it")


def keep_journal(
    it: Taken,
    engine: Engine,
    tell: Callable[[str], None] = print,
    *,
    durable: bool = True,
    together: bool = False,
    reach: WindowSize | None = None,
) -> Journal:
    """Write all that happens in the engine's book from now on to a file: a new one, or the one that was read, which the
    engine takes up. Each change is on the disk before it happens. `tell` says at once where the file is lost, and what
    becomes of it. `reach`: what is older leaves memory, and is read from the file. Raises FileError, UsageError, and
    gives the file back.
    """
    try:
        goes_on = _taken_up(it, engine)
        book = engine.book if goes_on is None else goes_on.book
        form = None if reach is None else Form.of(engine.arm)
        course = partial(_course, engine, book)
        journal = Journal(it, course, tell, durable=durable, together=together, read_back=form)
    except BaseException:
        it.close()
        raise
    if reach is not None and journal.past is not None:
        book.keep_short(MemoryWindow(journal, reach, it.resumed.version if it.resumed is not None else 0))
    if goes_on is not None:
        engine.take_up(goes_on)
    book.journal = journal
    return journal


def _course(engine: Engine, book: Book) -> Course:
    return Course(engine.model, book.initial, book.deltas)
