"""Play scripts of peers (other programs on TCP and serial lines), for tests and batch runs; record real peers.

    {"time": 0.5, "device": "TCP:11000", "event": "opened", "handle": 1}
    {"in": 0.1, "data": "J 0 -90 90 0 0 0\\r\\n"}
    {"after": "done\\r\\n", "event": "closed"}

A line without device or handle takes them from the previous line. `time`: the time by the robot's clock [s]; `in`: the
delay after the previous line, or after `after` [s]; `after`: a string that the program must write first. Blank lines
and lines that begin with # are skipped.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from math import inf, isfinite
from pathlib import Path
from typing import BinaryIO

from msgspec import Struct, field, structs

from vrs_cli.devices.arrivals import Address, Arrival, DeviceEvent
from vrs_cli.devices.outside import SERIAL, TCP, Outside, check_known
from vrs_cli.engine.clock import RobotClock
from vrs_cli.errors import DeviceNotReady, FileDamaged, FileError, PortTaken, VrsError
from vrs_cli.files.opening import text_at
from vrs_cli.trajectory.instant import LATEST, TICK, on_grid
from vrs_cli.wire.codec import decode, to_json
from vrs_cli.wire.records import RecordError

SENT, OPEN = "sent", "open"  # further events in a recording: text that the program wrote, and the outcome of opening
EVENTS = {event.value: event for event in DeviceEvent}
# the errors that the code of an OPEN line can stand for
FAULTS: dict[int, type[VrsError]] = {error.code: error for error in (DeviceNotReady, PortTaken)}


class UnitLine(Struct, frozen=True, omit_defaults=True, forbid_unknown_fields=True, rename={"within": "in"}):
    """A line of a script: an event on a device. It happens at `time` by the robot's clock [s], or `within` seconds
    after the previous line, or after the program has written the string `after`. `data`: the bytes as a string, one
    character per byte (Latin-1).
    """

    time: float | None = None
    after: str | None = None
    within: float = 0.0
    device: str = ""
    event: str = "data"
    handle: int | None = None
    data: str = ""
    code: int = 0


class _Part(Struct):
    """The lines of a script for one device. `due`: the time of the next line [s]; None if it is not known yet.
    `written`: the text that the program has written since the last match of `after`. `last`: the time of the previous
    line [s].
    """

    lines: deque[tuple[int, UnitLine]] = field(default_factory=deque)
    opened: deque[int] = field(default_factory=deque)  # error codes of the next openings, 0 for success
    sent: dict[int, bytearray] = field(default_factory=dict)  # by handle: text that the recorded program wrote
    open: bool = False
    due: float | None = None
    last: float = 0.0
    written: bytearray = field(default_factory=bytearray)

    def look(self, now: float) -> float:
        """Update and return the time of the next line [s], which is after the program's actions up to `now` [s];
        infinity if it is not known."""
        if self.due is None and self.open and self.lines:
            _, line = self.lines[0]
            if line.after is None:
                self.due = max(on_grid(self.last + line.within) if line.time is None else line.time, now + TICK)
            elif (place := self.written.find(text := _bytes(line.after))) >= 0:
                del self.written[: place + len(text)]
                self.due = on_grid(now + line.within) + TICK
        return inf if self.due is None else self.due

    def due_lines(self, now: float) -> Iterable[tuple[int, UnitLine]]:
        """Yield the lines that are due at `now` [s], with their numbers."""
        while self.due is not None and self.due <= now:
            yield self.lines.popleft()
            self.last, self.due = self.due, None
            following = self.lines[0][1] if self.lines else None
            if following is not None and following.time is not None and following.time <= now:
                self.due = now


class Script(Outside):
    """Devices whose arrivals come from a script. The user is warned once if a program writes something that differs
    from the recording."""

    def __init__(self, lines: Iterable[UnitLine], patience: float = inf) -> None:
        super().__init__(patience=patience)
        self._parts: dict[str, _Part] = {}
        self._differs = False
        for number, line in enumerate(lines):
            part = self._parts.setdefault(line.device, _Part())
            if line.event == OPEN:
                part.opened.append(line.code)
            elif line.event == SENT:
                part.sent.setdefault(line.handle or 0, bytearray()).extend(_bytes(line.data))
            else:
                part.lines.append((number, line))

    def check(self, device: str) -> None:
        check_known(device)
        if device != TCP and device not in self._parts:
            raise DeviceNotReady(f"the device {device}", "the file of --replay-units has nothing of it")

    def open(self, device: str, address: Address | None) -> None:  # noqa: ARG002
        part = self._parts.setdefault(device, _Part())
        code = part.opened.popleft() if part.opened else 0
        if code:
            raise FAULTS[code](device)
        part.open, part.due = True, None

    def send(self, device: str, handle: int, data: bytes, *, ask: bool = False) -> None:  # noqa: ARG002
        part = self._parts[device]
        part.written += data
        if self._differs or handle not in part.sent:
            return
        expected = part.sent[handle]
        self._differs = expected[: len(data)] != data
        if self._differs:
            was = expected[: len(data)].decode("latin-1")
            self.tell(f"{device}: the program writes {data.decode('latin-1')!r}, it wrote {was!r} when it was recorded")
        del expected[: len(data)]

    def close(self, device: str) -> None:
        part = self._parts[device]
        part.open, part.due = False, None
        part.written.clear()

    def due(self, clock: RobotClock) -> float:
        return min((part.look(clock.now) for part in self._parts.values()), default=inf)

    def take(self, now: float) -> Iterable[Arrival]:
        lines = [one for part in self._parts.values() for one in part.due_lines(now)]
        for _, line in sorted(lines, key=lambda one: one[0]):
            yield Arrival(line.device, EVENTS[line.event], line.handle or 0, _bytes(line.data), line.code)


def read_script(path: str, patience: float = inf) -> Script:
    """Read a script from a file; return it. Raises NonexistentFile, and FileDamaged, which lists all wrong lines."""
    return Script(parse_script(text_at(path), path), patience)


def parse_script(text: str, path: str = "units") -> list[UnitLine]:
    """Return the lines of a script, each with its device and handle. Raises FileDamaged, which lists all wrong
    lines."""
    lines, wrong = list[UnitLine](), list[str]()
    device, handle = "", None
    for number, written in enumerate(text.split("\n"), 1):
        if not written.strip() or written.lstrip().startswith("#"):
            continue
        try:
            line = decode(written, UnitLine)
            device, handle = line.device or device, handle if line.handle is None and not line.device else line.handle
            if handle is None:
                handle = 0 if device.startswith(SERIAL) or device.count(":") > 1 else 1
            lines.append(_on_grid(structs.replace(line, device=device, handle=handle)))
        except (RecordError, ValueError) as error:
            wrong.append(f"{path}:{number}: {error}")
    if wrong:
        raise FileDamaged("\n".join(wrong), 'a line is {"time": 0.5, "device": "TCP:11000", "data": "go\\n"}')
    return lines


def _on_grid(line: UnitLine) -> UnitLine:
    """Check a line; return it with its time rounded to a tick of the clock. Raises ValueError."""
    if not line.device:
        raise ValueError('no device is named: "device": "TCP:11000"')
    if line.event not in (*EVENTS, SENT, OPEN):
        raise ValueError(f"{line.event!r} is no event: {', '.join(EVENTS)}")
    if line.code and line.event == OPEN and line.code not in FAULTS:
        raise ValueError(f"the code {line.code} is not one of {', '.join(map(str, FAULTS))}")
    for seconds in (line.time or 0.0, line.within):
        if not (isfinite(seconds) and 0.0 <= seconds <= LATEST):
            raise ValueError(f"{seconds:g} is no time from 0 to {LATEST:g} s")
    _bytes(line.data)
    _bytes(line.after or "")
    return line if line.time is None else structs.replace(line, time=on_grid(line.time))


def _bytes(text: str) -> bytes:
    """Return one byte for each character (Latin-1). Raises ValueError for a character with a code above 255."""
    try:
        return text.encode("latin-1")
    except UnicodeEncodeError:
        raise ValueError(f"{text!r} has characters beyond 255, which are no bytes") from None


# --- recordings -----------------------------------------------------------------------------------------------------


def line_of(arrival: Arrival, now: float) -> UnitLine:
    """Return an arrival as a line of a recording."""
    data, event = arrival.data.decode("latin-1"), arrival.event.value
    return UnitLine(time=now, device=arrival.device, event=event, handle=arrival.handle, data=data, code=arrival.code)


class DeviceRecording(Outside):
    """Devices of another `Outside`, whose arrivals and sent bytes are also recorded in a file."""

    def __init__(self, outside: Outside, path: str) -> None:
        """Open the file. Raises FileError."""
        super().__init__(patience=outside.patience)
        self.live = outside.live
        outside.wake = lambda: self.wake()  # noqa: PLW0108 (`self.wake` is set later)
        outside.tell = lambda text: self.tell(text)  # noqa: PLW0108
        self._outside, self._path = outside, path
        self._clock: RobotClock | None = None
        try:
            self._file: BinaryIO | None = Path(path).open("wb")  # noqa: SIM115 (`close_all` closes it)
        except OSError as error:
            raise FileError(f"{path} cannot be written: {error.strerror}") from None

    def check(self, device: str) -> None:
        self._outside.check(device)

    def open(self, device: str, address: Address | None) -> None:
        try:
            self._outside.open(device, address)
        except VrsError as error:
            self._write(UnitLine(time=self._now, device=device, event=OPEN, code=error.code))
            raise
        self._write(UnitLine(time=self._now, device=device, event=OPEN))

    def send(self, device: str, handle: int, data: bytes, *, ask: bool = False) -> None:
        if not ask:
            self._write(UnitLine(device=device, event=SENT, handle=handle, data=data.decode("latin-1")))
        self._outside.send(device, handle, data, ask=ask)

    def confirm_read(self, device: str, handle: int, count: int) -> None:
        self._outside.confirm_read(device, handle, count)

    def release(self, device: str, handle: int) -> None:
        self._outside.release(device, handle)

    def close(self, device: str) -> None:
        self._outside.close(device)

    def close_all(self) -> None:
        self._outside.close_all()
        file, self._file = self._file, None
        if file is not None:
            file.close()

    def due(self, clock: RobotClock) -> float:
        self._clock = clock
        return self._outside.due(clock)

    def take(self, now: float) -> Iterable[Arrival]:
        arrivals = tuple(self._outside.take(now))
        for one in arrivals:
            self._write(line_of(one, now))
        return arrivals

    @property
    def _now(self) -> float:
        return 0.0 if self._clock is None else self._clock.now

    def _write(self, line: UnitLine) -> None:
        if self._file is None:
            return
        try:
            self._file.write(f"{to_json(line)}\n".encode())
            self._file.flush()
        except OSError as error:
            self.tell(f"{self._path}: {error.strerror}; no more is recorded")
            self._file = None
