"""Open real TCP sockets and serial lines for programs; decide which of them are allowed, and when programs see
arrivals."""

from __future__ import annotations

import errno
import ipaddress
import os
import socket
import sys
import time
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from math import inf
from threading import Lock

from vrs_cli.devices.arrivals import Address, Arrival
from vrs_cli.devices.outside import SERIAL, TCP, Outside, check_known
from vrs_cli.devices.traffic import GRACE, NonBlockingEnd, Traffic
from vrs_cli.engine.clock import RobotClock
from vrs_cli.errors import DeviceNotReady, PortTaken
from vrs_cli.trajectory.instant import TICK

LOOK = 0.005  # [s] time between two checks whether the bytes in a pseudo-terminal were read
LOOPBACK = "127.0.0.1"
USUAL_SPEED = 9600  # [baud] default speed of a serial line


class FileEnd:
    """Our end of a serial line, which is open as a file."""

    def __init__(self, handle: int) -> None:
        self._handle = handle
        os.set_blocking(handle, False)

    def fileno(self) -> int:
        return self._handle

    def receive(self, size: int) -> bytes:
        return os.read(self._handle, size)

    def send(self, data: bytes) -> int:
        return os.write(self._handle, data)

    def close(self) -> None:
        os.close(self._handle)


class PseudoEnd(FileEnd):
    """Our end of the pseudo-terminal `name`. It stays open until `leave` is called, even if programs close the device.
    The other end is kept open too, so that other programs may open and close it.
    """

    def __init__(self) -> None:
        """Open a pseudo-terminal. Raises OSError, termios.error."""
        import tty

        ours, self._theirs = os.openpty()
        tty.setraw(self._theirs)
        self.name = os.ttyname(self._theirs)
        super().__init__(ours)

    def close(self) -> None:
        """Do nothing: the pseudo-terminal stays open."""

    def unread(self) -> int:
        """Return the number of bytes that are still unread at the other end."""
        import fcntl
        import termios

        return int.from_bytes(fcntl.ioctl(self._theirs, termios.FIONREAD, bytes(4)), sys.byteorder)

    def leave(self) -> None:
        """Close both ends. Unread bytes are lost."""
        super().close()
        os.close(self._theirs)


def open_serial(what: str) -> tuple[FileEnd, str]:
    """Open a serial line: `pty` for a new pseudo-terminal, or the path of a device, optionally with its speed:
    /dev/ttyUSB0,115200. Return our end and a description for the user. Raises DeviceNotReady.
    """
    try:
        import termios
        import tty
    except ImportError:
        raise DeviceNotReady("a serial line", "this system has none that vrs can open") from None
    try:
        if what != "pty":
            path, _, speed = what.partition(",")
            if (code := getattr(termios, f"B{speed or USUAL_SPEED}", None)) is None:
                raise DeviceNotReady(f"{what}: no speed {speed}", "as 9600, 19200, 115200")
            handle = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
            try:
                tty.setraw(handle)
                settings = termios.tcgetattr(handle)
                settings[4] = settings[5] = code
                settings[2] |= termios.CLOCAL | termios.CREAD
                termios.tcsetattr(handle, termios.TCSANOW, settings)
            except BaseException:
                os.close(handle)
                raise
            return FileEnd(handle), f"{path} at {speed or USUAL_SPEED} baud"
        end = PseudoEnd()
        return end, end.name
    except (OSError, termios.error) as error:
        raise DeviceNotReady(f"{what}: {error.args[-1]}", "name a serial device, or pty") from None


class Sockets(Outside):
    """TCP sockets and serial lines of this machine. `host`: the address at which ports are opened; None: no TCP. With a
    loopback address, programs may connect only to this machine. `serial`: the device of each serial line, by the number
    of the line.
    """

    live = True

    def __init__(
        self, host: str | None = LOOPBACK, serial: Mapping[str, str] | None = None, patience: float = inf
    ) -> None:
        super().__init__(patience=patience)
        self.host, self.serial = host, serial or {}
        self._arrivals: deque[Arrival] = deque()
        self._arrivals_lock = Lock()
        self._due: float | None = None
        self._open: set[str] = set()
        self._pseudo: dict[str, PseudoEnd] = {}
        self._traffic: Traffic | None = None  # None while no device is open

    def check(self, device: str) -> None:
        check_known(device)
        number = device.removeprefix(SERIAL)
        if device == TCP and self.host is None:
            raise DeviceNotReady("the device TCP", "--allow-net gives it to programs")
        if device != TCP and number not in self.serial:
            raise DeviceNotReady(f"the device {device}", f"--serial {number}=pty makes it a pseudo-terminal")

    def open(self, device: str, address: Address | None) -> None:
        if address is None:
            ends: NonBlockingEnd | None = self._pseudo.get(device)
            if ends is None:
                ends, told = open_serial(self.serial[device.removeprefix(SERIAL)])
                if isinstance(ends, PseudoEnd):
                    self._pseudo[device] = ends
                self.tell(f"{device} is {told}")
            self._traffic_of(device).do(lambda traffic: traffic.connect(device, 0, ends))
        elif address.host:
            host = self._numeric_address(address.host)
            self._traffic_of(device).do(lambda traffic: traffic.dial(device, host, address.port))
        else:
            listener = self._listener(address)
            where = listener.getsockname()
            self._traffic_of(device).do(lambda traffic: traffic.listen(device, listener, address.clients))
            self.tell(f"TCP port {where[1]} is open at {where[0]}")

    def _traffic_of(self, device: str) -> Traffic:
        self._open.add(device)
        self._traffic = self._traffic or Traffic(self._keep)
        return self._traffic

    def _keep(self, arrival: Arrival) -> None:
        """Queue an arrival. The thread of `Traffic` calls this method."""
        with self._arrivals_lock:
            self._arrivals.append(arrival)
        self.wake()

    def _listener(self, address: Address) -> socket.socket:
        """Return a socket that listens at an address. Raises PortTaken, DeviceNotReady."""
        assert self.host is not None
        listener = socket.socket(socket.AF_INET6 if ":" in self.host else socket.AF_INET, socket.SOCK_STREAM)
        try:
            if sys.platform != "win32":  # on Windows the option would let two programs open the same port
                listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            listener.setblocking(False)
            listener.bind((self.host, address.port))
            listener.listen(address.clients)
        except OSError as error:
            listener.close()
            if error.errno == errno.EADDRINUSE:
                raise PortTaken(f"port {address.port}", "another program has it") from None
            raise self._not_ready(
                f"port {address.port} at {self.host}: {error.strerror}", "choose another one"
            ) from None
        return listener

    def _numeric_address(self, host: str) -> str:
        """Return the numeric address of a host. Raises DeviceNotReady for a name, because the lookup of a name may be
        slow, and for other machines if only this machine is allowed.
        """
        if (address := address_of(host)) is None:
            raise self._not_ready(f"a connection to {host}", "give the address in numbers, as 192.168.0.7")
        if is_loopback(self.host or LOOPBACK) and not address.is_loopback:
            raise self._not_ready(f"a connection to {host}", "--net-host 0.0.0.0 allows other machines")
        return str(address)

    def _not_ready(self, what: str, hint: str) -> DeviceNotReady:
        """Return an error, and show its message to the user, because the program only sees the error's number in
        IOSTAT."""
        fault = DeviceNotReady(what, hint)
        self.tell(str(fault))
        return fault

    def send(self, device: str, handle: int, data: bytes, *, ask: bool = False) -> None:
        self._do(lambda traffic: traffic.send(device, handle, data, ask=ask))

    def confirm_read(self, device: str, handle: int, count: int) -> None:
        self._do(lambda traffic: traffic.confirm_read(device, handle, count))

    def release(self, device: str, handle: int) -> None:
        self._do(lambda traffic: traffic.release(device, handle))

    def _do(self, act: Callable[[Traffic], None]) -> None:
        if self._traffic is not None:
            self._traffic.do(act)

    def close(self, device: str) -> None:
        traffic = self._traffic
        if traffic is None or device not in self._open:
            return
        self._open.discard(device)
        traffic.close(device)
        with self._arrivals_lock:
            self._arrivals = deque(arrival for arrival in self._arrivals if arrival.device != device)
            self._due = self._due if self._arrivals else None
        if not self._open:
            self._traffic = None
            traffic.end()

    def close_all(self) -> None:
        for device in tuple(self._open):
            self.close(device)
        last = time.monotonic() + GRACE
        for ends in self._pseudo.values():
            while ends.unread() and time.monotonic() < last:
                time.sleep(LOOK)
            ends.leave()
        self._pseudo.clear()

    def due(self, clock: RobotClock) -> float:
        """Return the time at which programs see the arrivals [s]: the earliest time that no program has reached yet.
        Return infinity if there are no arrivals."""
        if not self._arrivals:
            return inf
        if self._due is None:
            self._due = max(clock.reached, clock.now + TICK)
        return self._due

    def take(self, now: float) -> Iterable[Arrival]:  # noqa: ARG002
        with self._arrivals_lock:
            arrivals, self._arrivals, self._due = self._arrivals, deque(), None
        return arrivals


def address_of(host: str) -> ipaddress.IPv4Address | ipaddress.IPv6Address | None:
    """Return a host as a numeric address; None for a name other than localhost."""
    try:
        return ipaddress.ip_address(LOOPBACK if host.lower() == "localhost" else host)
    except ValueError:
        return None


def is_loopback(host: str) -> bool:
    """Return whether an address is reachable only from this machine."""
    address = address_of(host)
    return address is not None and address.is_loopback
