"""The journal: a trajectory file that grows while the robot moves. What cannot be written down does not happen.

A change is written, and on the disk, before it happens. The file is looked at before and after: where it is not the
one that was written so far (removed, replaced, cut short), a fresh one beside it takes the whole course of events, and
that is told before the command is answered.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Sequence
from contextlib import ExitStack, suppress
from itertools import count
from pathlib import Path

from msgspec import Struct

from vrs_cli.errors import FileError
from vrs_cli.files.atomic import create_beside, writing
from vrs_cli.files.growing import GrowingFile
from vrs_cli.files.lock import Hold, hold, is_special
from vrs_cli.files.opening import reason
from vrs_cli.files.trajectory_file import Recording, read_trajectory, trajectory_lines
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.trajectory.segment import Segment
from vrs_cli.trajectory.timeline import TimelineDelta
from vrs_cli.values.motion import Motion
from vrs_cli.wire.lines import LineEncoder

CHUNK = 1 << 16  # bytes that a journal which is not durable writes at once
TRIES = 3  # files for one change
NOT_DONE = "what cannot be written down is not done: make room, and give it again"
ANYWAY = "what stops the robot is done all the same, and is written as soon as it can be"


class Course(Struct, frozen=True):
    """All that a journal is to hold: the robot, its first timeline, and every change since."""

    model: RobotModel
    initial: Iterable[Segment]
    deltas: Sequence[TimelineDelta]

    def motions(self) -> dict[int, Motion]:
        """What the lines describe, by its number."""
        known = {segment.motion.number: segment.motion for segment in self.initial}
        for delta in self.deltas:
            for motion in (delta.motion, *(segment.motion for segment in delta.segments)):
                known[motion.number] = motion
        return known


class Taken(Struct, frozen=True):
    """A file that is ours to write, until `close`. `file` and `recording`: a trajectory that is to go on."""

    path: Path
    held: Hold
    file: GrowingFile | None = None
    recording: Recording | None = None

    def close(self) -> None:
        if self.file is not None:
            self.file.close()
        self.held.release()


def take(path: Path) -> Taken:
    """Take a file for a journal, which takes the place of what is there. Raises FileError."""
    with writing(path):
        return Taken(path, hold(path))


def take_up(path: Path, progress: Callable[[float], None] | None = None) -> Taken:
    """Take a file for a journal that goes on with it, or begins it. It is read when nobody else may write it any more.

    Raises FileError, and what `read_trajectory` does.
    """
    if is_special(path):
        raise FileError(f"{path} is a pipe or a device", "a session is recorded in a file")
    it = take(path)
    try:
        with writing(path):
            if path.exists():
                return _read(path, it.held, progress)
            create_beside(path, it.held).close()  # so that it can be made
            return it
    except BaseException:
        it.close()
        raise


def _read(path: Path, held: Hold, progress: Callable[[float], None] | None) -> Taken:
    file = GrowingFile(path)
    try:
        recording = read_trajectory(path, progress)
        if what := file.changed():
            raise FileError(f"{path} {what} while it was read", "try again")
    except BaseException:
        file.close()
        raise
    return Taken(path, held, file, recording)


class _Before(Struct, frozen=True):
    """What there was before a change was written down, which made it `version`: that the change is taken back to
    where it does not happen."""

    version: int
    size: int
    owed: bytes
    checksum: int | None


class Journal:
    """Every change of one robot's timeline, in a file that is locked until `close`.

    `path`: the file that it is in now; `sound`: it is the one that was asked for, and nothing is missing. `course`
    gives all that has happened, `tell` takes what the user has to know before the next answer. `durable=False` (batch)
    writes when there is enough, and at the end. `together`: what is written goes to the disk when `settle` says so, and
    nobody is answered before. Raises FileError.
    """

    def __init__(
        self,
        it: Taken,
        course: Callable[[], Course],
        tell: Callable[[str], None],
        *,
        durable: bool = True,
        together: bool = False,
    ) -> None:
        self.sound = True
        self.unsettled, self._together = False, together
        self._doubtful = False  # whether what was to be settled is on the disk
        self._asked, self._durable, self._course, self._tell = it.path, durable, course, tell
        self._owed = b""  # lines of what has happened that are to be written yet
        self._before: _Before | None = None
        self._held, self._closed = it.held, False
        with writing(it.path):
            if it.file is None or it.recording is None:
                self._file, self._lines = self._begun(it.path, it.held)
            else:
                self._file, self._lines = self._gone_on(it.file, it.recording)

    @property
    def path(self) -> Path:
        return self._file.path

    def _begun(self, path: Path, held: Hold) -> tuple[GrowingFile, LineEncoder]:
        """A new file with all that has happened, in the place of an older one at once."""
        beside, lines, course = create_beside(path, held), LineEncoder(), self._course()
        try:
            beside.stream.writelines(trajectory_lines(course.model, course.initial, course.deltas, lines))
            beside.commit()
        finally:
            beside.close()
        return GrowingFile(path), lines

    def _gone_on(self, file: GrowingFile, recording: Recording) -> tuple[GrowingFile, LineEncoder]:
        """What was read, without a last line that was torn."""
        if file.size > recording.size:
            file.cut(recording.size)
        if not file.ends_line():
            file.add(b"\n", durable=True)
        return file, LineEncoder(self._course().motions(), recording.checksum)

    # --- writing ---

    def record(self, deltas: Sequence[TimelineDelta], *, happens: bool = False) -> None:
        """Write down what is about to happen. Where that fails it must not happen; but what `happens` all the same is
        told then, and written with what comes next."""
        if self._before is not None and deltas[0].version <= self._before.version:
            self._take_back()  # Ctrl-C came between the writing and the change
        try:
            self._write(deltas)
        except FileError as error:
            if not happens:
                raise
            self._take_back()
            self._owed += b"".join(map(self._lines.delta, deltas))
            self._tell(f"{error}; {ANYWAY}")

    def settle(self) -> None:
        """All that is written is on the disk; in a fresh file where this one cannot keep it."""
        if not self.unsettled:
            return
        self._doubtful = True  # a system may forget what it could not keep, and say so once only
        try:
            with writing(self.path):
                self._file.sync()
        except FileError as error:
            self._move(f"does not keep what is written ({error.detail})")
        self.unsettled = self._doubtful = False

    def _write(self, deltas: Sequence[TimelineDelta]) -> None:
        if self._doubtful:
            self._move("has not kept what was written")
            self.unsettled = self._doubtful = False
        for _ in range(TRIES):
            self._before = _Before(deltas[0].version, self._file.size, self._owed, self._lines.checksum)
            data = self._owed + b"".join(map(self._lines.delta, deltas))
            if not self._durable and len(data) < CHUNK:
                self._owed = data
                return
            if not self._moved():
                self._add(data)
                if not self._moved():
                    return
        raise FileError(f"{self.path} is changed by others again and again", "name another place")

    def _add(self, data: bytes) -> None:
        with writing(self.path, NOT_DONE):
            self._file.add(data, durable=self._durable and not self._together)
        self._owed, self.unsettled = b"", self._together

    def _take_back(self) -> None:
        """What was written down last did not happen."""
        before, self._before = self._before, None
        if before is None:
            return
        self._owed = before.owed
        self._lines = LineEncoder(self._course().motions(), before.checksum)
        if self._file.size > before.size:
            with suppress(OSError):  # the file knows then that it is torn, and is left
                self._file.cut(before.size)

    def close(self) -> None:
        """All is on the disk, and others may write the file. Closing twice is closing once."""
        if self._closed:
            return
        self._closed = True
        try:
            if not self._moved():
                with writing(self.path):
                    for line in self._owed.splitlines(keepends=True):  # as many as there is room for
                        self._file.add(line, durable=False)
                    self._file.add(b"", durable=True)
                self._owed = b""
                self._moved()
        except FileError:
            self.sound = False
            raise
        finally:
            self._file.close()
            self._held.release()

    # --- a fresh file ---

    def _moved(self) -> bool:
        """Whether the file is not ours any more; all that has happened is in a fresh one then."""
        what = self._file.changed()
        if what:
            self._move(what)
        return bool(what)

    def _move(self, what: str) -> None:
        old, path = self._file, self._free()
        self.sound = False
        try:
            with ExitStack() as failed:
                held = hold(path)
                failed.callback(held.release)
                self._file, self._lines = self._begun(path, held)
                failed.pop_all()
        except OSError as error:
            raise FileError(f"{old.path} {what}, and {path} cannot be written: {reason(error)}", NOT_DONE) from error
        old.close()
        self._held.release()
        self._held = held
        self._owed, self._before = b"", None
        self._tell(f"*File error* {old.path} {what}: all of it goes on in {path}")

    def _free(self) -> Path:
        """A name beside the first one that nothing has, or had just now: day-2.vrst."""
        names = (self._asked.with_stem(f"{self._asked.stem}-{number}") for number in count(2))
        return next(name for name in names if name != self.path and not os.path.lexists(name))
