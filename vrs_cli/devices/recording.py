"""Writes down what units are given, so that `Script` gives them the same again."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import BinaryIO

from vrs_cli.devices.address import Address
from vrs_cli.devices.outside import Arrival, Outside
from vrs_cli.devices.script import OPEN, SENT
from vrs_cli.engine.clock import RobotClock
from vrs_cli.errors import FileError, VrsError
from vrs_cli.wire.unit_lines import UnitLine, written_unit_line


def line_of(arrival: Arrival, now: float) -> UnitLine:
    """What is written down of it."""
    data, event = arrival.data.decode("latin-1"), arrival.event.value
    return UnitLine(time=now, device=arrival.device, event=event, handle=arrival.handle, data=data, code=arrival.code)


class DeviceRecording:
    """The world outside, and a file of all that comes from there."""

    def __init__(self, outside: Outside, path: str) -> None:
        """Raises FileError."""
        self._outside, self._path = outside, path
        self._clock: RobotClock | None = None
        try:
            self._file: BinaryIO | None = Path(path).open("wb")  # noqa: SIM115 (`close_all` closes it)
        except OSError as error:
            raise FileError(f"{path} cannot be written: {error.strerror}") from None

    @property
    def live(self) -> bool:
        return self._outside.live

    @property
    def patience(self) -> float:
        return self._outside.patience

    @property
    def wake(self) -> Callable[[], None]:
        return self._outside.wake

    @wake.setter
    def wake(self, wake: Callable[[], None]) -> None:
        self._outside.wake = wake

    @property
    def tell(self) -> Callable[[str], None]:
        return self._outside.tell

    @tell.setter
    def tell(self, tell: Callable[[str], None]) -> None:
        self._outside.tell = tell

    def check(self, device: str) -> None:
        self._outside.check(device)

    def open(self, device: str, address: Address | None) -> None:
        try:
            self._outside.open(device, address)
        except VrsError as error:
            self._write(UnitLine(time=self._now, device=device, event=OPEN, code=error.code))
            raise
        self._write(UnitLine(time=self._now, device=device, event=OPEN))

    def send(self, device: str, handle: int, data: bytes) -> None:
        self._write(UnitLine(device=device, event=SENT, handle=handle, data=data.decode("latin-1")))
        self._outside.send(device, handle, data)

    def ask(self, device: str, handle: int) -> None:
        self._outside.ask(device, handle)

    def consumed(self, device: str, handle: int, count: int) -> None:
        self._outside.consumed(device, handle, count)

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
            self._file.write(written_unit_line(line))
            self._file.flush()
        except OSError as error:
            self.tell(f"{self._path}: {error.strerror}; no more is recorded")
            self._file = None
