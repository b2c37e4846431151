"""Encode and decode the lines of a trajectory file: JSON, a header and then one record for each timeline delta, each
line with its checksum.

A journal may have further lines that repeat the content of lines above, so that a reader need not begin at the first
line: rows of segments and of events, and checkpoints. Other lines hold reports of the measured robot.
"""

from __future__ import annotations

import re
import zlib
from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import Annotated, Any

import msgspec

from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.model_data import to_dict
from vrs_cli.trajectory.laws.law import VERSION
from vrs_cli.trajectory.reports import ReportColumns
from vrs_cli.trajectory.segment import Segment
from vrs_cli.trajectory.timeline import PART, TimelineDelta
from vrs_cli.values.commands import Event, Motion
from vrs_cli.version import __version__
from vrs_cli.wire import records
from vrs_cli.wire.codec import decode
from vrs_cli.wire.reports import ReportsRecord, columns_of, reports_record

FORMAT = 1
UNITS = {"length": "m", "angle": "rad", "time": "s"}

START = 0  # value from which the checksum of the first line is computed
KEY = b',"crc":"'
SEALED = KEY + b'%08x"}'
LENGTH = len(SEALED % START)
_SAID = re.compile(rb',"crc":"([0-9a-f]{8})"}$')


class Checksums:
    """Computes the checksums of a file's lines, in order. `last`: the checksum of the last line; None if the lines have
    no checksums, as in older files.
    """

    def __init__(self, last: int | None = START) -> None:
        self.last = last

    def seal(self, record: bytes) -> bytes:
        """Add the checksum to the next line; `record` is one non-empty JSON object."""
        if self.last is None:
            return record
        self.last = zlib.crc32(record[:-1], self.last)
        return record[:-1] + SEALED % self.last

    def open(self, line: bytes) -> bytes:
        """Remove the checksum from the next line, which may end with a newline. Raises RecordError if the checksum is
        wrong."""
        if self.last is None:
            return line
        line = line.removesuffix(b"\n")
        body = line[:-LENGTH]
        due = zlib.crc32(body, self.last)
        if line[-LENGTH:] != SEALED % due:
            raise records.RecordError("its checksum does not fit: it is not the line that was written here")
        self.last = due
        return body + b"}"

    @classmethod
    def after(cls, line: bytes) -> Checksums:
        """Return the checksums for the lines that follow this line: they continue from the checksum that it states.
        Raises RecordError if the line has no checksum."""
        if (said := _SAID.search(line.removesuffix(b"\n"))) is None:
            raise records.RecordError("a line without a checksum")
        return cls(int(said[1], 16))

    def skip(self, line: bytes) -> bytes:
        """Remove a wrong checksum; the next line is checked against the checksum that this line states."""
        line = line.removesuffix(b"\n")
        if (said := _SAID.search(line)) is None:
            return line
        self.last = int(said[1], 16)
        return line[: said.start()] + b"}"


class HeaderRecord(msgspec.Struct, frozen=True, omit_defaults=True):
    """The first line of a file; unknown keys of later versions are ignored. `laws`: the version of the motion laws with
    which the file was begun, 1 in older files. `crc`: every line has its checksum, which `Checksums` adds and
    removes."""

    vrst: records.Count
    vrs: str
    units: dict[str, str]
    robot: dict[str, Any]
    initial: tuple[records.SegmentRecord, ...]
    laws: records.Count = 1
    crc: str | None = None


class RowRecord(records.StrictRecord, frozen=True):
    """Consecutive segments of a timeline, with all their motions."""

    row: Annotated[tuple[records.SegmentRecord, ...], msgspec.Meta(min_length=1)]


class EventRowRecord(records.StrictRecord, frozen=True):
    """Consecutive events of a timeline."""

    events: Annotated[tuple[records.EventRecord, ...], msgspec.Meta(min_length=1)]


class PartRecord(records.StrictRecord, frozen=True, array_like=True):
    """A slice of a row. `place`: the file position [bytes] at which the row's line begins; `count`: the number of
    segments in the row. The slice has the segments from `first` up to, but not including, `last`. `begin`, `end` [s]:
    their times in the row; in the timeline they are `offset` later."""

    place: records.Count
    count: records.Count
    first: records.Count
    last: records.Count
    begin: records.Time
    end: records.Time
    offset: records.Time


class CheckpointRecord(records.StrictRecord, frozen=True):
    """The state after the lines above.

    `checkpoint`: the version of the timeline; `number`: the number of the last motion; `commands`: the number of
    commands in effect; `deltas`: the file positions [bytes] at which the lines of every PART-th delta begin; `before`:
    the file position of the previous checkpoint. `parts`: the slices of rows with the segments; `events`: the slices
    with the events.
    """

    checkpoint: records.Count
    number: records.Count
    commands: records.Count
    parts: Annotated[tuple[PartRecord, ...], msgspec.Meta(min_length=1)]
    deltas: tuple[records.Count, ...]
    before: records.Count | None = None
    events: tuple[PartRecord, ...] = ()


OTHER_LINES = b'{"row":', b'{"events":', b'{"checkpoint":', b'{"reports":'  # the first bytes of lines without a delta
_, _, CHECKPOINT, REPORTS = OTHER_LINES


class Marks(msgspec.Struct):
    """The keys of the first line that distinguish a trajectory file of any version from other files."""

    vrst: records.Count
    vrs: Annotated[str, msgspec.Meta(max_length=40)] = ""


_encoder = msgspec.json.Encoder()


# --- writing --------------------------------------------------------------------------------------------


class LineEncoder:
    """Encodes the lines of one file. It remembers the motions and the checksum of the lines already written.

    Equal values give equal bytes.
    """

    def __init__(self, motions: Mapping[int, Motion] = MappingProxyType({}), checksum: int | None = START) -> None:
        self._motions, self._checksums = records.Motions(motions), Checksums(checksum)

    @property
    def checksum(self) -> int | None:
        """Return the checksum of the last line; None if lines have no checksums."""
        return self._checksums.last

    def header(self, model: RobotModel, initial: Iterable[Segment]) -> bytes:
        """Encode the first line. `initial`: the timeline of version 0, which holds the position of the robot at the
        start."""
        segments = records.segment_records(initial, self._motions, None)
        return self._line(HeaderRecord(FORMAT, __version__, UNITS, to_dict(model), segments, VERSION))

    def delta(self, delta: TimelineDelta) -> bytes:
        """Encode a delta. Every PART-th delta describes its motions again, so that a reader can begin there."""
        if not delta.version % PART:
            self._motions.clear()
        return self._line(records.delta_record(delta, self._motions))

    def row(self, segments: Iterable[Segment]) -> bytes:
        """Encode a row of segments."""
        return self._line(RowRecord(records.segment_records(segments, records.Motions(), None)))

    def events(self, events: Iterable[Event]) -> bytes:
        """Encode a row of events."""
        return self._line(EventRowRecord(records.event_records(events)))

    def checkpoint(self, record: CheckpointRecord) -> bytes:
        """Encode a checkpoint."""
        return self._line(record)

    def reports(self, columns: ReportColumns, first: int, last: int) -> bytes:
        """Encode the reports from `first` up to, but not including, `last`."""
        return self._line(reports_record(columns, first, last))

    def _line(self, record: msgspec.Struct) -> bytes:
        return self._checksums.seal(_encoder.encode(record)) + b"\n"


# --- reading --------------------------------------------------------------------------------------------


def decode_delta(line: bytes, motions: records.Motions, form: records.Form) -> TimelineDelta:
    """Decode a line without its checksum as a delta. Raises RecordError."""
    return records.delta_of(decode(line, records.DeltaRecord), motions, form)


def decode_row(line: bytes, form: records.Form) -> tuple[Segment, ...]:
    """Decode a line without its checksum as a row of segments. Raises RecordError."""
    return records.segments_of(decode(line, RowRecord).row, records.Motions(), None, form)


def decode_events(line: bytes) -> tuple[Event, ...]:
    """Decode a line without its checksum as events. Raises RecordError."""
    return records.events_of(decode(line, EventRowRecord).events)


def decode_reports(line: bytes, form: records.Form) -> ReportColumns:
    """Decode a line without its checksum as reports. Raises RecordError."""
    return columns_of(decode(line, ReportsRecord), form.joint_count)


def has_reports(line: bytes) -> bool:
    """Return whether a line holds reports of the measured robot."""
    return line.startswith(REPORTS)


def has_delta(line: bytes) -> bool:
    """Return whether a line after the header is a delta; other lines repeat earlier content or hold reports."""
    return not line.startswith(OTHER_LINES)


def is_object(line: bytes) -> bool:
    """Return whether a line is one whole JSON object."""
    try:
        decode(line, dict[str, msgspec.Raw])
    except records.RecordError:
        return False
    return True
