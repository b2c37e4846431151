"""Write and read trajectory files (`.vrst`), in the format JSON Lines: a header, then one line for each timeline delta.
A journal (`files.journal`) appends lines. If the last line is incomplete, for example after a power failure, the reader
leaves it out.
"""

from __future__ import annotations

import os
from array import array
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import islice
from pathlib import Path
from typing import BinaryIO

from msgspec import Struct

from vrs_cli.errors import FileDamaged, FileError, NonexistentFile
from vrs_cli.files.atomic import atomically
from vrs_cli.files.opening import FREE, Folder, unreadable
from vrs_cli.files.rebuild import Fault, LoadedTimeline, OlderHand, check_order, faults, initial_timeline
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.model_data import from_dict
from vrs_cli.language.text.collector import pause_collector
from vrs_cli.trajectory.measured import MeasuredRecord, MeasuredTimeline
from vrs_cli.trajectory.segment import Segment
from vrs_cli.trajectory.timeline import PART, Timeline, TimelineDelta
from vrs_cli.version import __version__
from vrs_cli.wire import lines as wire
from vrs_cli.wire.codec import decode
from vrs_cli.wire.records import Form, Motions, RecordError, segments_of

EXTENSION = ".vrst"
REPAIR = "vrs replay --lenient plays what can be read of it"
MAX_FAULTS = 20  # maximum number of faults that a message lists
GUIDE = "a trajectory file is what SAVE or vrs run --save wrote"
GUIDE_IN_PYTHON = "a trajectory file is what Robot.save or vrs run --save wrote"
LINES_PER_PROGRESS = 512
MAX_HEADER_BYTES = 1 << 24  # [B] maximum size of a header; the header for a usual robot has about 2000 bytes


def write_trajectory(
    path: str | Path,
    model: RobotModel,
    initial: Iterable[Segment],
    deltas: Iterable[TimelineDelta],
    within: Folder = FREE,
    measured: MeasuredTimeline | None = None,
) -> None:
    """Write a trajectory to a file completely; if that fails, an existing file stays unchanged. `measured`: reports of
    the real arm to include. Raises FileError.
    """
    with atomically(path, within) as stream:
        stream.writelines(trajectory_lines(model, initial, deltas, measured))


def trajectory_lines(
    model: RobotModel,
    initial: Iterable[Segment],
    deltas: Iterable[TimelineDelta],
    measured: MeasuredTimeline | None = None,
    lines: wire.LineEncoder | None = None,
) -> Iterator[bytes]:
    """Yield the encoded lines of a trajectory file: the header, the deltas, and the reports of the real arm. `lines`:
    the encoder to use, which the caller can use for further lines.
    """
    lines = lines or wire.LineEncoder()
    yield lines.header(model, initial)
    yield from map(lines.delta, deltas)
    for columns, first, last in () if measured is None else measured.parts():
        yield lines.reports(columns, first, last)


# --- reading --------------------------------------------------------------------------------------------


class Recording(Struct, frozen=True):
    """The content of a trajectory file. `initial`: the timeline before all `deltas`; `timeline`: the timeline after
    them. `older_hand`: whether motions of the file open the hand (as in older files) and no delta after them has
    events. `warnings`: faults with their lines, in an older file or one that is read leniently. `dropped_tail`: whether
    an incomplete last line was left out. `size`: the size of all other lines [B]; `checksum`: the checksum of the last
    of them, None if the file has no checksums; both are needed to continue the file. `lines`: the line number of each
    delta; `places`: the file position of every PART-th delta. `laws`: the version of the motion laws of the vrs that
    began the file; motions are kept as they were planned then. `measured`: the reports of the real arm in the file.
    """

    arm: RobotArm
    timeline: Timeline
    deltas: tuple[TimelineDelta, ...]
    initial: Timeline
    older_hand: bool
    dropped_tail: bool
    warnings: tuple[str, ...]
    size: int
    checksum: int | None
    lines: Sequence[int]
    places: tuple[int, ...]
    laws: int
    measured: MeasuredTimeline

    @property
    def model(self) -> RobotModel:
        return self.arm.model


@pause_collector(lasting=True)
def read_trajectory(
    path: str | Path, progress: Callable[[float], None] | None = None, *, lenient: bool = False, within: Folder = FREE
) -> Recording:
    """Read a trajectory file, and check that its motion is continuous and within the limits. If it is not, raise
    FileDamaged; for an older file without checksums, add warnings to the recording instead. `lenient`: read as much as
    possible of a damaged file, and add warnings to the recording. `progress`: called with the fraction of the file that
    has been read, from 0 to 1. Raises NonexistentFile, FileError, and FileDamaged with the line number.
    """
    file = Path(path)
    try:
        with within.open_to_read(file) as stream:
            lines = _Lines(stream, progress)
            reader = _Reader(file, lines.first(file), lenient)
            for number, line in enumerate(lines, 2):
                if not reader.take(number, line, lines.whole - len(line)):
                    break
    except FileNotFoundError:
        raise NonexistentFile(str(path), GUIDE, in_python=GUIDE_IN_PYTHON) from None
    except IsADirectoryError:
        raise FileError(f"{path} is a folder", "name a trajectory file") from None
    except OSError as error:
        raise unreadable(file, error) from error
    return reader.check_recording(lines)


class _Reader:
    """Collects the content of a trajectory file line by line."""

    def __init__(self, path: Path, first: bytes, lenient: bool) -> None:
        self._path, self._lenient, self._faults = path, lenient, list[Fault]()
        record = _header_record(path, first)
        self._laws = record.laws
        self._checksums = wire.Checksums(None if record.crc is None else wire.START)
        self._motions, self._deltas = Motions(), list[TimelineDelta]()
        self._numbers, self._places = array("L"), list[int]()
        try:
            self._open_line(1, first)
            self._arm = arm_for(from_dict(record.robot, f"{path}, line 1: robot"))
            self._form = Form.of(self._arm)
            self._initial = segments_of(record.initial, self._motions, None, self._form)
            check_order(self._initial)
        except RecordError as error:
            raise _damage_error(path, 1, str(error)) from None
        if not self._initial:
            raise _damage_error(path, 1, "the initial timeline has no segment")
        self._hand, self._measured = OlderHand(self._motions), MeasuredRecord(self._form.joint_count)
        self._begin = initial_timeline(self._initial)
        self._timeline = LoadedTimeline(self._begin)

    def take(self, number: int, line: bytes, place: int) -> bool:
        """Read the next line, with this line number, which begins at the file position `place`. Return False if this
        line and all later lines must be ignored. Raises FileDamaged.
        """
        try:
            record = self._open_line(number, line)
            if not wire.has_delta(record):
                if wire.has_reports(record):
                    self._measured.add_columns(wire.decode_reports(record, self._form))
                return True
            delta = self._hand.read(self._timeline, wire.decode_delta(record, self._motions, self._form))
            self._timeline.apply(delta)
        except RecordError as error:
            if not self._lenient:
                raise _damage_error(self._path, number, str(error)) from None
            self._faults.append(Fault(number, f"{error}; it is left out, and all after it"))
            return False
        if not len(self._deltas) % PART:
            self._places.append(place)
        self._deltas.append(delta)
        self._numbers.append(number)
        return True

    def _open_line(self, number: int, line: bytes) -> bytes:
        try:
            return self._checksums.open(line)
        except RecordError as error:
            if not self._lenient:
                raise
            self._faults.append(Fault(number, str(error)))
            return self._checksums.skip(line)

    def check_recording(self, lines: _Lines) -> Recording:
        """Check that the motion of the whole file is continuous and within the limits, and return the recording. Raises
        FileDamaged.
        """
        sealed = self._checksums.last is not None and not self._lenient
        timeline = self._timeline.timeline()
        for fault in islice(faults(self._arm, timeline, self._deltas, self._numbers), MAX_FAULTS):
            if sealed:
                raise _damage_error(self._path, fault.line, fault.what)
            self._faults.append(fault)
        return Recording(
            arm=self._arm,
            timeline=timeline,
            deltas=tuple(self._deltas),
            initial=self._begin,
            older_hand=self._hand.found,
            dropped_tail=lines.torn,
            warnings=tuple(map(str, self._faults)),
            size=lines.whole,
            checksum=self._checksums.last,
            lines=self._numbers,
            places=tuple(self._places),
            laws=self._laws,
            measured=self._measured.view,
        )


class _Lines:
    """Reads the complete lines of a file. `whole`: the size of the lines read so far [B]. `torn`: whether the last line
    was left out because it has no line end and is not a complete record.
    """

    def __init__(self, stream: BinaryIO, progress: Callable[[float], None] | None) -> None:
        self._stream, self._progress = stream, progress
        self._size = os.fstat(stream.fileno()).st_size or 1
        self.whole, self.torn = 0, False

    def first(self, path: Path) -> bytes:
        """Read and return the first line, the header. Raises FileDamaged if the file is of another kind; a large file
        is then not read completely.
        """
        line = self._stream.readline(MAX_HEADER_BYTES)
        if len(line) == MAX_HEADER_BYTES:
            raise _no_header(path)
        if not line.endswith(b"\n") and not wire.is_object(line):
            raise FileDamaged(f"{path} has no whole first line", GUIDE, in_python=GUIDE_IN_PYTHON)
        self.whole = len(line)
        return line

    def __iter__(self) -> Iterator[bytes]:
        for number, line in enumerate(self._stream):
            if not line.endswith(b"\n") and not wire.is_object(line):
                self.torn = bool(line.strip())
                return
            self.whole += len(line)
            yield line
            if self._progress is not None and not number % LINES_PER_PROGRESS:
                self._progress(min(self.whole / self._size, 1.0))


def _header_record(path: Path, line: bytes) -> wire.HeaderRecord:
    try:
        marks = decode(line, wire.Marks)
    except RecordError:
        raise _no_header(path) from None
    if marks.vrst != wire.FORMAT:
        writer = f" of vrs {marks.vrs}" if marks.vrs else ""
        raise FileDamaged(
            f"{path}, line 1: version {marks.vrst} of the file format{writer}",
            f"this vrs {__version__} reads version {wire.FORMAT}",
        )
    try:
        return decode(line, wire.HeaderRecord)
    except RecordError as error:
        raise _damage_error(path, 1, str(error)) from None


def _no_header(path: Path) -> FileDamaged:
    return FileDamaged(f"{path}, line 1: no header of a trajectory file", GUIDE, in_python=GUIDE_IN_PYTHON)


def _damage_error(path: Path, number: int, what: str) -> FileDamaged:
    return FileDamaged(f"{path}, line {number}: {what}", REPAIR if number > 1 else GUIDE)
