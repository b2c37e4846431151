"""Going on with a recorded trajectory: what an engine takes up, and the journal that it writes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from vrs_cli.engine.book import Book
from vrs_cli.engine.engine import Bookmark, Engine
from vrs_cli.errors import UsageError
from vrs_cli.files.journal import Course, Journal, Taken
from vrs_cli.files.rebuild import history_of
from vrs_cli.files.trajectory_file import Recording
from vrs_cli.language.text.collector import pause_collector
from vrs_cli.trajectory.timeline import Timeline


@pause_collector()
def bookmark_of(path: str | Path, recording: Recording, engine: Engine) -> Bookmark:
    """The course of events of a file, with the settings that the engine has; the clock is at the end of the timeline.

    Raises UsageError where it is of another robot.
    """
    check_robot(path, recording, engine)
    book = Book(
        Timeline(recording.initial),
        recording.timeline,
        recording.deltas,
        history_of(recording.initial, recording.deltas),
        max((delta.motion.number for delta in recording.deltas), default=0),
    )
    return Bookmark(book, engine.settings, recording.timeline.end)


def check_robot(path: str | Path, recording: Recording, engine: Engine) -> None:
    """Raises UsageError where a file is of another robot than the engine's."""
    ours = engine.model
    theirs = replace(recording.model, shapes=ours.shapes)  # how it looks makes no other robot
    if theirs == ours:
        return
    if theirs.name != ours.name:
        raise UsageError(f"{path} is of a {theirs.name}, this robot is a {ours.name}", "give --robot, or another file")
    raise UsageError(f"{path} is of a {theirs.name} with other figures than this one", "REPLAY plays it")


def keep_journal(
    it: Taken, engine: Engine, tell: Callable[[str], None] = print, *, durable: bool = True, together: bool = False
) -> Journal:
    """Write all that happens in the engine's book from now on to a file: a new one, or the one that was read, which the
    engine takes up. Each change is on the disk before it happens. `tell` says at once where the file is lost, and what
    becomes of it. Raises FileError, UsageError, and gives the file back."""
    try:
        goes_on = None if it.recording is None else bookmark_of(it.path, it.recording, engine)
        book = engine.book if goes_on is None else goes_on.book
        journal = Journal(
            it, lambda: Course(engine.model, book.initial, book.deltas), tell, durable=durable, together=together
        )
    except BaseException:
        it.close()
        raise
    if goes_on is not None:
        engine.take_up(goes_on)
    book.journal = journal
    return journal
