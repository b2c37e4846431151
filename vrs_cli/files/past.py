"""Read earlier parts of a journal from its growing file, and resume a journal from a checkpoint."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from threading import Lock
from typing import NamedTuple, TypeVar

from msgspec import Struct

from vrs_cli.engine.book import Book
from vrs_cli.engine.history import History
from vrs_cli.errors import FileError, FileOpened, VrsError
from vrs_cli.files.atomic import claim, is_special, sync_handle
from vrs_cli.files.opening import reason
from vrs_cli.files.rebuild import initial_timeline, loaded_forward
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.model_data import from_dict
from vrs_cli.trajectory.measured import MeasuredRecord, MeasuredTimeline
from vrs_cli.trajectory.rope import Leaf, OffsetNode
from vrs_cli.trajectory.row import EventRow, Row
from vrs_cli.trajectory.timeline import PART, DeltaLog, Timeline, TimelineDelta
from vrs_cli.wire import lines as wire
from vrs_cli.wire.codec import decode
from vrs_cli.wire.records import Form, Motions, RecordError, segments_of

ADDING = os.O_RDWR | os.O_APPEND | getattr(os, "O_BINARY", 0)


class GrowingFile:
    """An existing file to which data is appended; `size`: its expected size [B]. On a device or a pipe nothing can be
    read back. Methods raise OSError; the constructor raises FileOpened if another writer uses the file under another
    name.
    """

    def __init__(self, path: Path) -> None:
        self.path, self._handle = path, os.open(path, ADDING)
        self.size = os.fstat(self._handle).st_size
        self._special = is_special(path)
        self._torn = False  # true while an incomplete line is being removed, and afterwards if the removal has failed
        self._reading = Lock()
        if not self._special and not claim(self._handle):
            self.close()
            raise FileOpened(f"{path} is being written by another vrs", "end that one, or name another file")

    def find_change(self) -> str:
        """Return words that say how somebody else has changed the file (such as "was removed"); "" if nobody has
        changed it.
        """
        if self._special:
            return ""
        try:
            there, here = os.stat(self.path), os.fstat(self._handle)
        except FileNotFoundError:
            return "is gone"
        except OSError as error:
            return f"cannot be found: {reason(error)}"
        if not os.path.samestat(there, here):
            return "is another file now"
        if self._torn:
            return "has a torn line that could not be taken away"
        if here.st_size != self.size:
            return "has been cut short" if here.st_size < self.size else "has been written by others"
        if not os.access(self.path, os.R_OK | os.W_OK):
            return "can no longer be read and written"
        return ""

    def add(self, data: bytes, *, durable: bool) -> None:
        """Append data. After an error or Ctrl-C, remove the part of the data that was already written. `durable`: also
        sync the file.
        """
        try:
            rest = memoryview(data)
            while rest:
                rest = rest[os.write(self._handle, rest) :]  # the system may write fewer bytes than requested
            if durable:
                self.sync()
            if not self._special:
                self.size += len(data)
        except BaseException:
            with suppress(OSError):
                self.cut(self.size)
            raise

    def read(self, place: int, size: int) -> bytes:
        """Read `size` bytes that begin at the file position `place`; fewer at the end of the file. Any thread may call
        this.
        """
        with self._reading:
            # this does not affect writing: because of O_APPEND the system always writes at the end
            os.lseek(self._handle, place, os.SEEK_SET)
            return os.read(self._handle, size)

    def sync(self) -> None:
        """Sync all appended data."""
        sync_handle(self._handle)

    def cut(self, size: int) -> None:
        """Truncate the file to `size` bytes, and sync it."""
        if self._special:
            return
        self._torn = True
        os.ftruncate(self._handle, size)
        sync_handle(self._handle)
        self.size, self._torn = size, False

    def close(self) -> None:
        """Close the file. A second call has no effect."""
        handle, self._handle = self._handle, -1
        if handle >= 0:
            os.close(handle)


# --- earlier parts ---------------------------------------------------------------------------------------------------


CHUNK = 1 << 16  # [B] amount that is read at a time
CACHED_ROWS = 32  # maximum number of rows, and of parts of deltas, that are cached after reading
HAND_KEY = b'"hand":'  # key of the hand's opening in a motion's record, which only older files have
MAX_CHECKSUM_BYTES = 64  # [B] maximum length of the checksum at the end of a line
V = TypeVar("V")


class JournalLine(NamedTuple):
    """The record of a line (the line without its checksum), and the file positions of the line's start and end."""

    record: bytes
    place: int
    end: int


class Past:
    """Reads earlier parts of a journal back into memory. `places`: the file position of every PART-th delta;
    `checkpoint`: the file position of the last checkpoint. If the journal continues in a new file, `file` becomes this
    file, which has the same lines.
    """

    def __init__(
        self, file: GrowingFile, form: Form, places: Iterable[int] = (), checkpoint: int | None = None
    ) -> None:
        self.file, self.form, self.places, self.checkpoint = file, form, list(places), checkpoint
        # for an older file: number of deltas read from the start, and the motions described in them
        self._read_to, self._motions = 0, Motions()

    @lru_cache(CACHED_ROWS)  # noqa: B019 (closed journals are few, and other entries soon replace theirs)
    def row(self, place: int) -> Row:
        """Read the row of segments whose line begins at the file position `place`. Raises FileError."""
        return self._read(lambda: Row(wire.decode_row(_line(self.file, place).record, self.form)))

    @lru_cache(CACHED_ROWS)  # noqa: B019
    def read_deltas(self, first: int, last: int) -> Sequence[TimelineDelta]:
        """Read the deltas from number `first` (a multiple of PART) to `last`, exclusive. Raises FileError."""
        return self._read(lambda: self._read_deltas(first, last))

    def _read(self, read: Callable[[], V]) -> V:
        """Call a function that reads from the file; if it fails because the journal has moved to a new file meanwhile,
        call it again. Raises FileError.
        """
        file = self.file
        try:
            return read()
        except (OSError, RecordError) as error:
            if self.file is not file:  # the journal has moved to a new file meanwhile
                return self._read(read)
            what = f"{self.file.path}: what it has of earlier times cannot be read ({error})"
            raise FileError(what, "a copy of the file helps, if there is one") from error

    def _read_deltas(self, first: int, last: int) -> Sequence[TimelineDelta]:
        try:
            return list(self._deltas(first, last, Motions()))
        # in a file of an older vrs, lines may refer to motions that are described before this part: read from the start
        except RecordError:
            if self._read_to != first:
                self._read_to, self._motions = 0, Motions()
                for _ in self._deltas(0, first, self._motions):
                    pass
            found = list(self._deltas(first, last, self._motions))
            self._read_to = last
            return found

    def _deltas(self, first: int, last: int, motions: Motions) -> Iterator[TimelineDelta]:
        """Yield the deltas from number `first` to `last`, exclusive. `motions`: the motions that earlier lines
        describe. Raises RecordError.
        """
        number = first
        for line in lines(self.file, self.places[first // PART]) if first < last else ():
            if wire.has_delta(line.record):
                yield wire.decode_delta(line.record, motions, self.form)
                number += 1
                if number == last:
                    return
        if number < last:
            raise RecordError("it is cut short")


class KeptRow(Struct, frozen=True):
    """A row of segments that is stored in a journal at the file position `place`, and not in memory."""

    past: Past
    place: int

    def read(self) -> Row:
        return self.past.row(self.place)


def lines(file: GrowingFile, place: int) -> Iterator[JournalLine]:
    """Yield the lines of a file that begin at the file position `place` or later; the line before it must have a
    checksum. An incomplete last line is left out. Raises RecordError if a checksum is wrong.
    """
    checksums = _checksums(file, place)
    data, begin = b"", place
    while chunk := file.read(begin + len(data), CHUNK):
        *whole, data = (data + chunk).split(b"\n")
        for line in whole:
            end = begin + len(line) + 1
            yield JournalLine(checksums.open(line), begin, end)
            begin = end
    if data and wire.is_object(data):
        yield JournalLine(checksums.open(data), begin, begin + len(data))


def _line(file: GrowingFile, place: int) -> JournalLine:
    """Return the line that begins at the file position `place`. Raises RecordError."""
    line = next(lines(file, place), None)
    if line is None:
        raise RecordError("it is cut short")
    return line


def _checksums(file: GrowingFile, place: int) -> wire.Checksums:
    """Return an object that checks the checksums of the lines that begin at the file position `place` or later. Raises
    RecordError if the line before has no checksum.
    """
    return wire.Checksums.after(file.read(max(place - MAX_CHECKSUM_BYTES, 0), min(place, MAX_CHECKSUM_BYTES)))


# --- resuming ---------------------------------------------------------------------------------------------------


class Resumed(Struct, frozen=True):
    """The content of a journal that was resumed from a checkpoint and can be continued. `size`: the size of all
    complete lines [B]; `checksum`: the checksum of the last of them. `version`: the timeline version of the checkpoint;
    `measured`: all reports of the real arm.
    """

    model: RobotModel
    book: Book
    past: Past
    size: int
    checksum: int | None
    version: int
    measured: MeasuredTimeline


def resume_journal(file: GrowingFile, changes: int) -> Resumed | None:
    """Read a journal from the last checkpoint that has at least `changes` changes after it. Return None if there is no
    such checkpoint, or it cannot be read; the caller must then read the whole file.
    """
    try:
        place = _last_checkpoint(file)
        after = 0 if place is None else sum(wire.has_delta(line.record) for line in lines(file, place))
        version = None  # timeline version of the next later checkpoint
        while place is not None:
            record = decode(_line(file, place).record, wire.CheckpointRecord)
            after += 0 if version is None else version - record.checkpoint
            if after >= changes:
                return None if not record.events and _has_older_hand(file) else _resume_at(file, place, record)
            place, version = record.before, record.checkpoint
    except (OSError, ValueError, LookupError, VrsError):
        pass
    return None


def _last_checkpoint(file: GrowingFile) -> int | None:
    """Search a file backwards for the last complete checkpoint. Return its file position, or None if the file has no
    such checkpoint.
    """
    mark, begin, overlap, last_end = b"\n" + wire.CHECKPOINT, file.size, b"", -1
    while begin:
        size = min(begin, CHUNK)
        begin -= size
        data = file.read(begin, size) + overlap
        if last_end < 0 and (at := data.rfind(b"\n")) >= 0:
            last_end = begin + at
        found = data.rfind(mark)
        if begin + found == last_end:  # the line of this checkpoint is incomplete, so search for the one before it
            found = data.rfind(mark, 0, found)
        if found >= 0:
            return begin + found + 1
        overlap = data[: len(mark)]
    return None


def _has_older_hand(file: GrowingFile) -> bool:
    """Return whether a journal may be an older file, in which motions contain the opening of the hand."""
    begin, overlap, is_header = 0, b"", True
    while chunk := file.read(begin, CHUNK):
        begin += len(chunk)
        if is_header:
            _, end, chunk = chunk.partition(b"\n")
            is_header = not end
        if HAND_KEY in overlap + chunk:
            return True
        overlap = chunk[-len(HAND_KEY) :]
    return False


def _resume_at(file: GrowingFile, place: int, record: wire.CheckpointRecord) -> Resumed:
    data = b""
    while b"\n" not in data and (chunk := file.read(len(data), CHUNK)):
        data += chunk
    header = decode(data[: data.index(b"\n")], wire.HeaderRecord)
    model = from_dict(header.robot, f"{file.path}, line 1: robot")
    form = Form.of(arm_for(model))
    past, motions, measured = Past(file, form, record.deltas, place), Motions(), MeasuredRecord(form.joint_count)
    known, new, size = list[TimelineDelta](), list[TimelineDelta](), 0
    parts, more = divmod(record.checkpoint, PART)
    begin = past.places[parts] if more else place
    for reports in _reports_before(file, begin):
        measured.add_columns(wire.decode_reports(reports, form))
    for line in lines(file, begin):
        size = line.end
        if line.record.startswith(wire.CHECKPOINT):
            past.checkpoint = line.place
        elif wire.has_reports(line.record):
            measured.add_columns(wire.decode_reports(line.record, form))
        elif wire.has_delta(line.record):
            delta = wire.decode_delta(line.record, motions, form)
            (known if line.place < place else new).append(delta)
            if line.place > place and not delta.version % PART:
                past.places.append(line.place)
    # placeholders for commands before the checkpoint that were undone, since REDO after it may repeat them
    unknown = [None] * len(new)
    history = History(undone=unknown, forgotten=record.commands)
    timeline = Timeline.of_parts(_parts(record, past), record.checkpoint, _event_parts(record, file))
    book = Book(
        initial_timeline(segments_of(header.initial, Motions(), None, form)),
        loaded_forward(history, timeline, new, record.number),
        DeltaLog.after(past, parts, [*known, *new]),
        history,
        max([record.number, *(delta.motion.number for delta in new)]),
    )
    book.marks_events = bool(record.events) and not any(delta.events for delta in new)
    return Resumed(
        model=model,
        book=book,
        past=past,
        size=size,
        checksum=_checksums(file, size).last,
        version=record.checkpoint,
        measured=measured.view,
    )


def _reports_before(file: GrowingFile, end: int) -> Iterator[bytes]:
    """Yield the lines of reports that begin before the file position `end`, without checking other lines. Raises
    RecordError.
    """
    mark, begin = b"\n" + wire.REPORTS, 0
    while begin < end:
        found = file.read(begin, CHUNK + len(mark)).find(mark)
        if found < 0:
            begin += CHUNK
            continue
        for line in lines(file, begin + found + 1):
            if line.place >= end or not wire.has_reports(line.record):
                break
            begin = line.end - 1  # step back to the newline before the next line, because the mark begins with it
            yield line.record
        else:
            return
        if line.place >= end:
            return


def _parts(record: wire.CheckpointRecord, past: Past) -> Iterator[OffsetNode[Row]]:
    rows: dict[int, Row] = {}
    for it in record.parts:
        row = rows.get(it.place)
        if row is None:
            row = rows[it.place] = Row.in_store(KeptRow(past, it.place), it.count)
        yield OffsetNode(it.offset, Leaf(row, it.first, it.last, it.begin, it.end))


def _event_parts(record: wire.CheckpointRecord, file: GrowingFile) -> Iterator[OffsetNode[EventRow]]:
    """Read all events of a checkpoint, which stay in memory. Raises RecordError."""
    rows: dict[int, EventRow] = {}
    for it in record.events:
        row = rows.get(it.place)
        if row is None:
            row = rows[it.place] = EventRow(wire.decode_events(_line(file, it.place).record))
            row.closed, row.stored_at = True, it.place
        if len(row) != it.count:
            raise RecordError("a row of events is not as long as it was")
        yield OffsetNode(it.offset, Leaf(row, it.first, it.last, it.begin, it.end))


def part_record(offset: float, leaf: Leaf[Row] | Leaf[EventRow]) -> wire.PartRecord:
    """Return the journal record of a leaf (a part of a stored row of segments or events). `offset` [s] is added to the
    times in the row to get the times in the timeline.
    """
    kept = leaf.row.stored_at
    place = kept.place if isinstance(kept, KeptRow) else kept
    assert isinstance(place, int), "the row is in a journal"
    return wire.PartRecord(place, len(leaf.row), leaf.first, leaf.last, leaf.begin, leaf.end, offset)
