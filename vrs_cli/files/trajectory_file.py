"""The trajectory file and journal (`.vrst`): JSON Lines, a header and then one line per timeline delta.

Writing appends whole lines and syncs them, so that the file holds every delta up to some moment;
a line that was being written when the power failed is recognised when the file is read, and left out.
"""

from __future__ import annotations

import gc
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from types import TracebackType
from typing import Self

import msgspec

from vrs_cli import __version__
from vrs_cli.errors import FileDamaged, FileError, NonexistentFile
from vrs_cli.files.atomic import Beside, atomically, create_beside, reason, sync, writing
from vrs_cli.files.rebuild import Rebuilding
from vrs_cli.files.records import (
    FORMAT,
    UNITS,
    DeltaRecord,
    HeaderRecord,
    Motions,
    RecordError,
    delta_of,
    delta_record,
    segment_records,
    segments_of,
)
from vrs_cli.kinematics.model import RobotModel, from_dict, to_dict
from vrs_cli.trajectory.delta import TimelineDelta
from vrs_cli.trajectory.segment import Segment
from vrs_cli.trajectory.timeline import Timeline

EXTENSION = ".vrst"
REPAIR = "what is before that line can be read when it and all after it are deleted"
GUIDE = "a trajectory file is what SAVE or vrs run --save wrote"
LONGEST_HEADER = 1 << 24  # bytes; a robot takes two thousand

UNREADABLE = (msgspec.DecodeError, UnicodeDecodeError, RecursionError)

_encoder = msgspec.json.Encoder()
_header_decoder = msgspec.json.Decoder(HeaderRecord)
_delta_decoder = msgspec.json.Decoder(DeltaRecord)


# --- lines ----------------------------------------------------------------------------------------------


def encode_header(model: RobotModel, initial: Iterable[Segment], motions: Motions) -> bytes:
    """The first line. `initial`: the timeline of version 0 (s_0: where the robot stands at first)."""
    segments = segment_records(initial, motions, None)
    return _line(HeaderRecord(FORMAT, __version__, UNITS, to_dict(model), segments))


def encode_delta(delta: TimelineDelta, motions: Motions) -> bytes:
    """One line; `motions` are those that the lines before describe. The same bytes for the same values."""
    return _line(delta_record(delta, motions))


def decode_delta(line: bytes, motions: Motions, joint_count: int) -> TimelineDelta:
    """The delta of a line. Raises msgspec.DecodeError for what is no record, RecordError for a wrong one."""
    return delta_of(_delta_decoder.decode(line), motions, joint_count)


def _line(record: msgspec.Struct) -> bytes:
    return _encoder.encode(record) + b"\n"


# --- writing --------------------------------------------------------------------------------------------


class TrajectoryWriter:
    """A journal: the file holds every delta as soon as `append` returns.

    The header replaces an older file at once. `durable=False` leaves the syncing to `close` (batch).
    Every method raises FileError.
    """

    def __init__(
        self, path: str | Path, model: RobotModel, initial: Iterable[Segment], *, durable: bool = True
    ) -> None:
        self.path = Path(path)
        self._durable = durable
        self._motions = Motions()
        with writing(self.path):
            beside = create_beside(self.path)
        try:
            self._begin(beside, encode_header(model, initial, self._motions))
        except BaseException:
            beside.discard()
            raise

    def _begin(self, beside: Beside, header: bytes) -> None:
        with writing(self.path):
            beside.stream.write(header)
            beside.commit()
            self._stream = beside.stream

    def append(self, delta: TimelineDelta) -> None:
        """Add one delta."""
        line = encode_delta(delta, self._motions)
        with writing(self.path):
            self._stream.write(line)
            if self._durable:
                sync(self._stream)

    def close(self) -> None:
        """Everything is on the disk afterwards; closing twice is closing once."""
        if self._stream.closed:
            return
        with writing(self.path), self._stream:
            sync(self._stream)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def write_trajectory(
    path: str | Path, model: RobotModel, initial: Iterable[Segment], deltas: Iterable[TimelineDelta]
) -> None:
    """Save a trajectory: the whole file or, when that fails, what was there before. Raises FileError."""
    motions = Motions()
    with atomically(path) as stream:
        stream.write(encode_header(model, initial, motions))
        for delta in deltas:
            stream.write(encode_delta(delta, motions))


# --- reading --------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Header:
    """What the first line says: the form of the file, and the vrs that wrote it."""

    format: int
    vrs: str
    units: dict[str, str]


@dataclass(frozen=True, slots=True)
class Recording:
    """A trajectory file as read: `timeline` is tau after all `deltas`, `initial` the segments of tau[0].

    `dropped_tail`: a last line that had not been written to its end was left out.
    """

    model: RobotModel
    timeline: Timeline
    deltas: tuple[TimelineDelta, ...]
    initial: tuple[Segment, ...]
    header: Header
    dropped_tail: bool


@contextmanager
def _collector_paused() -> Iterator[None]:
    """A file is many values and no cycles: the garbage collector would walk them all again and again."""
    running = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if running:
            gc.enable()


@_collector_paused()
def read_trajectory(path: str | Path) -> Recording:
    """Read a trajectory file. Raises NonexistentFile, FileError, or FileDamaged, which names the line."""
    file = Path(path)
    lines, dropped = _whole_lines(_read(file))
    header, model, initial, motions = _header(file, lines)
    deltas = tuple(_deltas(file, lines, motions, model.joint_count))
    timeline = _rebuilt(file, initial, deltas)
    return Recording(model, timeline, deltas, initial, header, dropped)


def _read(path: Path) -> bytes:
    try:
        with path.open("rb") as stream:
            first = stream.readline(LONGEST_HEADER)
            if len(first) == LONGEST_HEADER:
                raise _no_header(path)
            return first + stream.read()
    except FileNotFoundError:
        raise NonexistentFile(str(path), GUIDE) from None
    except IsADirectoryError:
        raise FileError(f"{path} is a folder", "name a trajectory file") from None
    except OSError as error:
        raise FileError(f"{path} cannot be read: {reason(error)}", "check its permissions") from error


def _whole_lines(data: bytes) -> tuple[list[bytes], bool]:
    """The lines, and whether a last one was left out: it has no line end and is no whole record."""
    lines = data.split(b"\n")
    last = lines.pop()
    if not last.strip():
        return lines, False
    if _is_whole(last):
        return [*lines, last], False
    return lines, bool(lines)


def _is_whole(line: bytes) -> bool:
    try:
        msgspec.json.decode(line, type=dict)
    except UNREADABLE:
        return False
    return True


def _header(path: Path, lines: Sequence[bytes]) -> tuple[Header, RobotModel, tuple[Segment, ...], Motions]:
    record = _header_record(path, lines)
    model = from_dict(record.robot, f"{path}, line 1: robot")
    motions = Motions()
    try:
        initial = segments_of(record.initial, motions, None, model.joint_count)
    except RecordError as error:
        raise _damaged(path, 1, str(error)) from None
    if not initial:
        raise _damaged(path, 1, "the initial timeline has no segment")
    return Header(record.vrst, record.vrs, record.units), model, initial, motions


class _Marks(msgspec.Struct):
    """What tells a trajectory file from others, whatever its version."""

    vrst: int
    vrs: str = ""


def _header_record(path: Path, lines: Sequence[bytes]) -> HeaderRecord:
    if not lines:
        raise FileDamaged(f"{path} has no whole first line", GUIDE)
    try:
        marks = msgspec.json.decode(lines[0], type=_Marks)
    except UNREADABLE:
        raise _no_header(path) from None
    if marks.vrst != FORMAT:
        writer = f" of vrs {marks.vrs}" if marks.vrs else ""
        raise FileDamaged(
            f"{path}, line 1: version {marks.vrst} of the file format{writer}",
            f"this vrs {__version__} reads version {FORMAT}",
        )
    try:
        return _header_decoder.decode(lines[0])
    except UNREADABLE as error:
        raise _damaged(path, 1, str(error)) from None


def _deltas(path: Path, lines: Sequence[bytes], motions: Motions, joint_count: int) -> Iterator[TimelineDelta]:
    for number, line in enumerate(islice(lines, 1, None), 2):
        try:
            yield decode_delta(line, motions, joint_count)
        except (*UNREADABLE, RecordError) as error:
            raise _damaged(path, number, str(error)) from None


def _rebuilt(path: Path, initial: Iterable[Segment], deltas: Iterable[TimelineDelta]) -> Timeline:
    rebuilding = Rebuilding(initial)
    for number, delta in enumerate(deltas, 2):
        try:
            rebuilding.add(delta)
        except RecordError as error:
            raise _damaged(path, number, str(error)) from None
    return rebuilding.timeline()


def _no_header(path: Path) -> FileDamaged:
    return FileDamaged(f"{path}, line 1: no header of a trajectory file", GUIDE)


def _damaged(path: Path, number: int, what: str) -> FileDamaged:
    return FileDamaged(f"{path}, line {number}: {what}", REPAIR)
