"""Define the base class of the external devices to which tasks can attach logical units. It has no devices."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from enum import Enum
from math import inf
from typing import TYPE_CHECKING, Final

from vrs_cli.errors import DeviceNotReady

if TYPE_CHECKING:
    from vrs_cli.devices.arrivals import Address, Arrival
    from vrs_cli.engine.clock import RobotClock

TCP, SERIAL = "TCP", "SERIAL:"


class Waits(Enum):
    """The result of an operation that has to wait, because it is not complete yet."""

    YET = "yet"


YET: Final = Waits.YET


class Outside:
    """The devices to which units can be attached: sockets, serial lines, or scripts that replace them. This base class
    has no devices; `hint`: how the user can allow some.

    `live`: whether arrivals come from other programs, in real time. `patience`: the maximum time that a unit waits, by
    the robot's clock [s]. `wake`: called, in any thread, after an arrival. `tell`: takes messages for the person who
    runs the programs.
    """

    live = False

    def __init__(self, hint: str = "", patience: float = inf) -> None:
        self.hint, self.patience = hint, patience
        self.wake: Callable[[], None] = lambda: None
        self.tell: Callable[[str], None] = lambda _text: None

    def check(self, device: str) -> None:
        """Check that a unit may be attached to a device. Raises DeviceNotReady if not."""
        check_known(device)
        raise DeviceNotReady(f"the device {device}", self.hint)

    def open(self, device: str, address: Address | None) -> None:  # noqa: ARG002
        """Open a device: a serial line if `address` is None. For a connection to another program only start to open it;
        OPENED or REFUSED arrives later. Raises DeviceNotReady, PortTaken."""
        self.check(device)

    def send(self, device: str, handle: int, data: bytes, *, ask: bool = False) -> None:
        """Send bytes to a connection. `ask`: report WRITTEN when all bytes were handed to the operating system."""

    def confirm_read(self, device: str, handle: int, count: int) -> None:
        """Confirm that the program has read `count` bytes, so that as many more may arrive."""

    def release(self, device: str, handle: int) -> None:
        """Close a connection. A later connection may get the same handle."""

    def close(self, device: str) -> None:
        """Close a device with all its connections, and free its port."""

    def close_all(self) -> None: ...
    def due(self, clock: RobotClock) -> float:  # noqa: ARG002
        """Return the time of the next arrivals by the robot's clock [s]; infinity if none are known."""
        return inf

    def take(self, now: float) -> Iterable[Arrival]:  # noqa: ARG002
        """Return the arrivals up to `now` [s], in their order, and remove them."""
        return ()


def check_known(device: str) -> None:
    """Check that a device with this name can exist. Raises DeviceNotReady if not."""
    if device != TCP and not (device.startswith(SERIAL) and device[len(SERIAL) :].isdigit()):
        raise DeviceNotReady(f"the device {device}", f"there are DISK, {TCP} and {SERIAL}1")
