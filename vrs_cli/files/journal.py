"""Keep a journal: a trajectory file that grows while the robot moves. A change of the timeline is written and synced
before it takes effect; if it cannot be written, it does not take effect. The file is checked before and after each
write: if somebody has removed, replaced or shortened it, all events from the start are written to a new file in the
same folder, and the user is told before the command is answered.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Sequence
from contextlib import ExitStack, closing, suppress
from itertools import count
from math import inf
from pathlib import Path

from msgspec import Struct, structs

from vrs_cli.engine.book import Book, MemoryWindow, WindowSize
from vrs_cli.engine.engine import Bookmark, Engine
from vrs_cli.errors import FileError, UsageError
from vrs_cli.files.atomic import HeldLock, as_file_error, create_beside, hold, is_special
from vrs_cli.files.opening import reason
from vrs_cli.files.past import GrowingFile, KeptRow, Past, Resumed, part_record, resume_journal
from vrs_cli.files.rebuild import history_of
from vrs_cli.files.trajectory_file import Recording, read_trajectory, trajectory_lines
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.language.text.collector import pause_collector
from vrs_cli.trajectory.measured import MeasuredTimeline
from vrs_cli.trajectory.reports import CHUNK_REPORTS as CHUNK_REPORTS
from vrs_cli.trajectory.reports import ReportColumns
from vrs_cli.trajectory.row import EventRow, Row
from vrs_cli.trajectory.segment import Segment
from vrs_cli.trajectory.timeline import PART, Timeline, TimelineDelta
from vrs_cli.values.commands import Motion
from vrs_cli.values.measured import Report
from vrs_cli.wire.lines import CheckpointRecord, LineEncoder
from vrs_cli.wire.records import Form

CHUNK = 1 << 16  # [B] a journal that is not durable collects this much before it writes
TRIES = 3  # the journal tries to write a change to at most this many files, one after the other
REPORT_SECONDS = 1.0  # [s] reports of the real arm are collected for this time and written together
RETRY_SECONDS = 10.0  # [s] after a failed write, reports are collected for this time before the next attempt
NOT_DONE = "what cannot be written down is not done: make room, and give it again"
ANYWAY = "what stops the robot is done all the same, and is written as soon as it can be"


class Course(Struct, frozen=True):
    """The content of a journal: the robot, the first segments of its timeline, all changes, and the reports of the real
    arm.
    """

    model: RobotModel
    initial: Iterable[Segment]
    deltas: Sequence[TimelineDelta]
    measured: MeasuredTimeline

    def motions(self) -> dict[int, Motion]:
        """Return the motions that the next lines may refer to by number: those described in the lines since the last
        multiple of PART changes.
        """
        known = {} if self.deltas else {segment.motion.number: segment.motion for segment in self.initial}
        for delta in self.deltas[len(self.deltas) // PART * PART :]:
            for motion in (delta.motion, *(segment.motion for segment in delta.segments)):
                known[motion.number] = motion
        return known


class Taken(Struct, frozen=True):
    """A file that is locked for a journal until `close`. `file`: the open file to continue; None for a new journal.
    `recording`: the content of the file if it was read completely; `resumed`: its content if it was read from a
    checkpoint.
    """

    path: Path
    held: HeldLock
    file: GrowingFile | None = None
    recording: Recording | None = None
    resumed: Resumed | None = None

    @property
    def has_torn_line(self) -> bool:
        """Return whether the last line of the file is incomplete; it will be ignored."""
        if self.resumed is not None:
            return self.resumed.past.file.size > self.resumed.size
        return self.recording is not None and self.recording.dropped_tail

    def close(self) -> None:
        if self.file is not None:
            self.file.close()
        self.held.release()


def take(path: str | Path) -> Taken:
    """Lock a file that a new journal will replace. Raises FileError."""
    path = Path(path)
    with as_file_error(path):
        return Taken(path, hold(path))


def take_up(path: Path, progress: Callable[[float], None] | None = None, changes: int | None = None) -> Taken:
    """Lock a file that a journal will continue, or create if it does not exist. The file is read completely, or, if
    `changes` is given, from a checkpoint with at least that many changes after it. Raises FileError, and the errors of
    `read_trajectory`.
    """
    if is_special(path):
        raise FileError(f"{path} is a pipe or a device", "a session is recorded in a file")
    it = take(path)
    try:
        with as_file_error(path):
            if path.exists():
                return _read(path, it.held, progress, changes)
            create_beside(path, it.held).close()  # check that the file can be created
            return it
    except BaseException:
        it.close()
        raise


def _read(path: Path, held: HeldLock, progress: Callable[[float], None] | None, changes: int | None) -> Taken:
    file = GrowingFile(path)
    try:
        if changes is not None and (found := resume_journal(file, changes)) is not None:
            return Taken(path, held, file, resumed=found)
        recording = read_trajectory(path, progress)
        if what := file.find_change():
            raise FileError(f"{path} {what} while it was read", "try again")
    except BaseException:
        file.close()
        raise
    return Taken(path, held, file, recording)


class _Before(Struct, frozen=True):
    """The state of a journal before it writes a change, restored if the change does not take effect. `version`: the
    version of the timeline that is changed. `size`: the size of the file [B]. `owed`: lines not written yet.
    """

    version: int
    size: int
    owed: bytes
    checksum: int | None
    parts: int  # number of file positions in `Journal._places`


class Journal:
    """Writes every change of a robot's timeline to a file, which is locked until `close`.

    `path`: the current file; `sound`: whether it is the requested file and complete. `course`: a function that returns
    everything the journal must contain up to now. `tell`: a function that shows a message to the user before the next
    answer. `durable=False` (for batch runs): collect changes until they fill a large block before they are written;
    the rest is written at the end. `together`: do not sync each change; `settle` syncs several changes together, before
    any of them is answered. `past`: reads older parts from the file if they are dropped from memory. Raises FileError.
    """

    def __init__(
        self,
        it: Taken,
        course: Callable[[], Course],
        tell: Callable[[str], None],
        *,
        durable: bool = True,
        together: bool = False,
        read_back: Form | None = None,
    ) -> None:
        self.sound = True
        self.unsettled, self._together = False, together
        self._doubtful = False  # whether a sync of the file has failed
        self._asked, self._durable, self._course, self._tell = it.path, durable, course, tell
        self._owed = b""  # lines of earlier changes that have not been written yet
        self._before: _Before | None = None
        self._held, self._closed = it.held, False
        # reports of the real arm that have not been written yet; `_reports_due`: the time at which to write them
        self._reports: list[Report] = []
        self._reports_due = -inf
        self._places: list[int] = []  # file position of every PART-th delta
        self.past = it.resumed.past if it.resumed is not None else None
        with as_file_error(it.path):
            if it.file is None:
                self._file, self._lines = self._begin(it.path, it.held)
            else:
                self._file, self._lines = self._continue(it.file, it.resumed or it.recording)
        if self.past is not None:
            self._places = self.past.places
        elif read_back is not None and self._lines.checksum is not None:
            self.past = Past(self._file, read_back, ())
            self.past.places = self._places

    @property
    def path(self) -> Path:
        return self._file.path

    def _begin(self, path: Path, held: HeldLock) -> tuple[GrowingFile, LineEncoder]:
        """Write all events so far to a new file, which replaces an existing file at this path."""
        lines, course, size = LineEncoder(), self._course(), 0
        with closing(create_beside(path, held)) as beside:
            self._places.clear()
            written = trajectory_lines(course.model, course.initial, course.deltas, course.measured, lines)
            for number, line in enumerate(written, -1):
                if not number % PART and 0 <= number < len(course.deltas):
                    self._places.append(size)
                beside.stream.write(line)
                size += len(line)
            beside.commit()
        return GrowingFile(path), lines

    def _continue(self, file: GrowingFile, read: Resumed | Recording | None) -> tuple[GrowingFile, LineEncoder]:
        """Prepare the file that was read for appending: remove an incomplete last line, or add a missing newline."""
        assert read is not None, "the file was read"
        if file.size > read.size:
            file.cut(read.size)
        if file.read(file.size - 1, 1) != b"\n":
            file.add(b"\n", durable=True)
        if isinstance(read, Recording):
            self._places.extend(read.places)
        return file, LineEncoder(self._course().motions(), read.checksum)

    # --- writing ---

    def record(self, deltas: Sequence[TimelineDelta], *, happens: bool = False) -> None:
        """Write changes before they take effect; if FileError is raised, they must not take effect. `happens`: the
        changes take effect even if they cannot be written. The user is then told, and the changes are written together
        with the next ones.
        """
        if self._before is not None and deltas[0].version <= self._before.version:
            self._take_back()  # the previous change was written but did not take effect, because of Ctrl-C
        try:
            self._write(deltas[0].version, lambda: self._encode(deltas))
        except FileError as error:
            if not happens:
                raise
            self._take_back()
            self._owed += self._encode(deltas)
            self._tell(f"{error}; {ANYWAY}")

    def settle(self) -> None:
        """Sync all written lines to the disk. If the sync fails, write all events to a new file."""
        if not self.unsettled:
            return
        # set before syncing: if this sync fails, a later one may still report success, so the file is doubtful until
        # this sync has succeeded
        self._doubtful = True
        try:
            with as_file_error(self.path):
                self._file.sync()
        except FileError as error:
            self._move(f"does not keep what is written ({error.detail})")
        self.unsettled = self._doubtful = False

    def _write(self, version: int, lines: Callable[[], bytes]) -> None:
        if self._doubtful:
            self._move("has not kept what was written")
            self.unsettled = self._doubtful = False
        for _ in range(TRIES):
            before = self._before = _Before(
                version, self._file.size, self._owed, self._lines.checksum, len(self._places)
            )
            data = self._owed + lines()
            if not self._durable and len(data) < CHUNK:
                self._owed = data
                return
            if not self._leave_if_changed(before):
                with as_file_error(self.path, NOT_DONE):
                    self._file.add(data, durable=self._durable and not self._together)
                self._owed, self.unsettled = b"", self._together
                if not self._leave_if_changed(before):
                    return
        raise FileError(f"{self.path} is changed by others again and again", "name another place")

    def _encode(self, deltas: Sequence[TimelineDelta]) -> bytes:
        """Encode changes as the lines that follow those not written yet, and note the file positions of every PART-th
        delta.
        """
        data, place = b"", self._file.size + len(self._owed)
        for delta in deltas:
            if not delta.version % PART:
                self._places.append(place + len(data))
            data += self._lines.delta(delta)
        return data

    def add_reports(self, reports: Sequence[Report]) -> None:
        """Collect reports of the real arm, and write those of about one second together. If that fails, tell the user,
        and try again later.
        """
        if self._closed:
            return
        if not self._reports:
            self._reports_due = reports[0].t + REPORT_SECONDS
        self._reports += reports
        if reports[-1].t >= self._reports_due:
            try:
                self._write_reports()
            except FileError as error:
                self._reports_due = reports[-1].t + RETRY_SECONDS
                self._tell(f"{error}; the measured reports wait in memory")

    def _write_reports(self) -> None:
        """Write the collected reports. Raises FileError."""
        version = len(self._course().deltas)
        if self._before is not None and version <= self._before.version:
            self._take_back()  # the previous change was written but did not take effect, because of Ctrl-C
        reports = sorted(self._reports, key=lambda report: report.t)
        columns = ReportColumns(len(reports[0].joints), len(reports))
        for report in reports:
            columns.put(report)
        blocks = [(first, min(first + CHUNK_REPORTS, len(reports))) for first in range(0, len(reports), CHUNK_REPORTS)]
        try:
            self._write(version, lambda: b"".join([self._lines.reports(columns, *block) for block in blocks]))
        except FileError:
            self._take_back()
            raise
        self._before = None
        self._reports = []

    def _take_back(self) -> None:
        """Remove the last written change from the file, because it did not take effect."""
        before, self._before = self._before, None
        if before is None:
            return
        self._owed = before.owed
        del self._places[before.parts :]
        self._lines = LineEncoder(self._course().motions(), before.checksum)
        if self._file.size > before.size:
            with suppress(OSError):  # if this fails, the file is marked as torn and will be replaced by a new one
                self._file.cut(before.size)

    def close(self) -> None:
        """Write all lines not written yet, sync the file, and release it. A second call has no effect."""
        if self._closed:
            return
        self._closed = True
        if self._reports:
            try:
                self._write_reports()
            except FileError as error:
                self.sound = False
                self._tell(f"{error}; the last measured reports are lost")
        try:
            if not self._leave_if_changed() or self._owed:
                with as_file_error(self.path):
                    for line in self._owed.splitlines(
                        keepends=True
                    ):  # write line by line, so that a nearly full disk still gets some of them
                        self._file.add(line, durable=False)
                    self._file.add(b"", durable=True)
                self._owed = b""
                self._leave_if_changed()
        except FileError:
            self.sound = False
            raise
        finally:
            self._file.close()
            self._held.release()

    # --- parts that are dropped from memory ---

    def read_deltas(self, first: int, last: int) -> Sequence[TimelineDelta]:
        assert self.past is not None, "it is kept to be read back"
        return self.past.read_deltas(first, last)

    def keep_row(self, row: Row) -> KeptRow | None:
        """Write a row (sequence) of segments, so that it can be dropped from memory. Return its place in the file;
        None if it cannot be written now.
        """
        assert self.past is not None, "it is kept to be read back"
        place = self._repeat(lambda: self._lines.row(row))
        return None if place is None else KeptRow(self.past, place)

    def keep_events(self, row: EventRow) -> int | None:
        """Write a row (sequence) of events, so that it can be dropped from memory. Return its file position; None if it
        cannot be written now.
        """
        return self._repeat(lambda: self._lines.events(row))

    def keep_checkpoint(self, timeline: Timeline, commands: int, number: int) -> bool:
        """Write a checkpoint: the file positions of all rows of a timeline, which must already be in the file.
        `commands`: the number of commands; `number`: the number of the last motion. Return whether the checkpoint was
        written.
        """
        assert self.past is not None, "it is kept to be read back"
        parts = tuple(part_record(offset, leaf) for _, offset, leaf in timeline.parts())
        events = tuple(part_record(offset, leaf) for _, offset, leaf in timeline.event_parts())
        places, before = tuple(self._places), self.past.checkpoint
        record = CheckpointRecord(timeline.version, number, commands, parts, places, before, events)
        place = self._repeat(lambda: self._lines.checkpoint(record))
        if place is not None:
            self.past.checkpoint = place
        return place is not None

    def _repeat(self, line: Callable[[], bytes]) -> int | None:
        """Append a line that repeats earlier content (a row or checkpoint). Return its file position; None if it cannot
        be written now. Such a line may be lost without harm.
        """
        if self._owed or self._doubtful or self._file.find_change():
            return None
        place, checksum = self._file.size, self._lines.checksum
        try:
            self._file.add(line(), durable=False)
        except OSError:
            self._lines = LineEncoder(self._course().motions(), checksum)
            return None
        self._before = None
        return place

    # --- a new file ---

    def _leave_if_changed(self, before: _Before | None = None) -> bool:
        """Return whether somebody else has changed the file. If so, continue in a new file that has all events before
        the change that is being written.
        """
        what = self._file.find_change()
        if what:
            self._move(what, before)
        return bool(what)

    def _move(self, what: str, before: _Before | None = None) -> None:
        # choose an unused name in the folder of the requested file, such as day-2.vrst
        names = (self._asked.with_stem(f"{self._asked.stem}-{number}") for number in count(2))
        path = next(name for name in names if name != self.path and not os.path.lexists(name))
        old = self._file
        self.sound = False
        try:
            with ExitStack() as failed:
                held = hold(path)
                failed.callback(held.release)
                if self.past is None:
                    self._file, self._lines = self._begin(path, held)
                    self._owed = b""
                else:
                    self.past.file = self._file = self._copy_file(path, held, before)
                failed.pop_all()
        except OSError as error:
            raise FileError(f"{old.path} {what}, and {path} cannot be written: {reason(error)}", NOT_DONE) from error
        old.close()
        self._held.release()
        self._held = held
        self._before = None
        self._tell(f"*File error* {old.path} {what}: all of it goes on in {path}")

    def _copy_file(self, path: Path, held: HeldLock, before: _Before | None) -> GrowingFile:
        """Copy the lines of the current file to a new file; leave out those written since `before`. Raises OSError."""
        old, size = self._file, self._file.size if before is None else before.size
        with closing(create_beside(path, held)) as beside:
            for place in range(0, size, CHUNK_REPORTS):
                data = old.read(place, min(CHUNK_REPORTS, size - place))
                if not data:
                    raise OSError(0, "what it has lost is nowhere else")
                beside.stream.write(data)
            beside.commit()
        if before is not None:
            self._owed = before.owed
            del self._places[before.parts :]
            self._lines = LineEncoder(self._course().motions(), before.checksum)
        return GrowingFile(path)


# --- the journal of an engine ---------------------------------------------------------------------------------------


@pause_collector()
def bookmark_of(path: str | Path, recording: Recording, engine: Engine) -> Bookmark:
    """Return the state that a recorded file gives the engine: the events of the file, the engine's settings, and the
    clock at the end of the timeline. Raises UsageError if the file belongs to another robot.
    """
    check_robot(path, recording.model, engine)
    book = Book(
        recording.initial,
        recording.timeline,
        recording.deltas,
        history_of(recording.initial, recording.deltas),
        max((delta.motion.number for delta in recording.deltas), default=0),
    )
    book.marks_events = recording.older_hand
    return Bookmark(book, engine.settings, recording.timeline.last)


def check_robot(path: str | Path, model: RobotModel, engine: Engine) -> None:
    """Check that a file was written for the engine's robot. Raises UsageError."""
    ours = engine.model
    # robots that differ only in their shapes count as equal
    theirs = structs.replace(model, shapes=ours.shapes, collision=ours.collision)
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
    """Create a journal that writes all changes of the engine's timeline to the locked file `it`. If this file was read,
    the engine first takes over its events. `tell`: shows a message to the user, for example that the file was lost.
    `durable`, `together`: see `Journal`. `reach`: how much stays in memory; older parts are dropped, and read from the
    file when needed. Raises FileError, UsageError; the file is then released.
    """
    try:
        found, goes_on = it.resumed, None
        if found is not None:
            check_robot(it.path, found.model, engine)
            goes_on = Bookmark(found.book, engine.settings, found.book.timeline.last)
        elif it.recording is not None:
            goes_on = bookmark_of(it.path, it.recording, engine)
        book = engine.book if goes_on is None else goes_on.book
        form = None if reach is None else Form.of(engine.arm)
        journal = Journal(
            it,
            lambda: Course(engine.model, book.initial, book.deltas, engine.measured.view),
            tell,
            durable=durable,
            together=together,
            read_back=form,
        )
    except BaseException:
        it.close()
        raise
    if reach is not None and journal.past is not None:
        book.keep_short(MemoryWindow(journal, reach, 0 if found is None else found.version))
    if goes_on is not None:
        engine.take_up(goes_on)
    read = it.resumed or it.recording
    if read is not None:
        engine.measured.take(read.measured)
    engine.measured.listeners.append(journal.add_reports)
    book.journal = journal
    return journal
