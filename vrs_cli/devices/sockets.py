"""TCP over real sockets, and serial lines: one thread waits for all of them while any is open.

The thread owns what is open. The robot's side puts what is to be done in a queue and rings; what comes is put in
another one, and `wake` is called. Of each connection so much is taken that its unit can hold: a peer that sends more
waits. A port has as many clients as it was opened for; others wait until one is released.
"""

from __future__ import annotations

import errno
import ipaddress
import selectors
import socket
import sys
import time
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from functools import partial
from math import inf
from threading import Event as Done
from threading import Lock, Thread
from typing import Protocol

from vrs_cli.devices.address import Address
from vrs_cli.devices.outside import SERIAL, TCP, Arrival, Event, check_known
from vrs_cli.devices.serial_line import PseudoEnd, open_serial
from vrs_cli.engine.clock import Clock
from vrs_cli.errors import DeviceNotReady, NetworkClosed, PortTaken
from vrs_cli.trajectory.instant import TICK

WINDOW = 65536  # bytes that have come and were not read, of one connection
PIECE = 16384  # bytes that are taken at once
PAUSE = 0.02  # [s] in which a line goes on whose end has not come
GRACE = 0.5  # [s] that what was written has to leave when its device is closed
LOOK = 0.005  # [s] between two looks whether that has happened, where nobody tells
LOOPBACK = "127.0.0.1"
ALONE = {"TCP_KEEPIDLE": 30, "TCP_KEEPINTVL": 10, "TCP_KEEPCNT": 3}  # [s], [s], times: a peer that is gone is missed


class Ends(Protocol):
    """One end of a connection, which does not block."""

    def fileno(self) -> int: ...
    def receive(self, size: int) -> bytes: ...
    def send(self, data: bytes) -> int: ...
    def close(self) -> None: ...


class SocketEnd:
    """Of TCP."""

    def __init__(self, it: socket.socket) -> None:
        self._it = it
        it.setblocking(False)
        it.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        it.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
        for name, value in ALONE.items():
            if hasattr(socket, name):
                it.setsockopt(socket.IPPROTO_TCP, getattr(socket, name), value)

    def fileno(self) -> int:
        return self._it.fileno()

    def receive(self, size: int) -> bytes:
        return self._it.recv(size)

    def send(self, data: bytes) -> int:
        return self._it.send(data)

    def close(self) -> None:
        with suppress(OSError):
            self._it.shutdown(socket.SHUT_WR)
        self._it.close()


class _Connection:
    """`room` [bytes]: that may come before some are read. `asked`: it is to be told when all has left. `closing`: by
    when [s] that has to be. `pause`: when [s] what has come without an end of line is a line; `packets`: is it ever.
    """

    def __init__(self, device: str, handle: int, ends: Ends) -> None:
        self.device, self.handle, self.ends = device, handle, ends
        self.room, self.out = WINDOW, bytearray()
        self.asked = self.ended = self.broken = False
        self.closing = self.pause = inf
        self.packets = isinstance(ends, SocketEnd)
        self.watched = 0  # for what the selector looks

    def interest(self) -> int:
        reads = self.room > 0 and not self.ended and self.closing == inf
        return selectors.EVENT_READ * reads | selectors.EVENT_WRITE * bool(self.out)


class _Port:
    """A port for clients: `free` handles, of so many as it has clients."""

    def __init__(self, device: str, listener: socket.socket, clients: int) -> None:
        self.device, self.listener = device, listener
        self.free = set(range(1, clients + 1))
        self.watched = False


class Sockets:
    """`host`: at which ports are opened. Where that is this machine alone, connections are to this machine alone.
    `serial`: the number of each serial line and what it is: a device, or a pseudo-terminal
    """

    live = True
    wake: Callable[[], None] = staticmethod(lambda: None)
    tell: Callable[[str], None] = staticmethod(lambda _text: None)

    def __init__(
        self,
        host: str | None = LOOPBACK,
        serial: Mapping[str, str] | None = None,
        patience: float = inf,
    ) -> None:
        self.host, self.serial, self.patience = host, serial or {}, patience
        self._come: deque[Arrival] = deque()
        self._coming = Lock()
        self._due: float | None = None
        self._open: set[str] = set()
        self._pseudo: dict[str, PseudoEnd] = {}
        self._wanted: deque[Callable[[], None]] = deque()
        self._thread: Thread | None = None
        # of the thread alone
        self._ports: dict[str, _Port] = {}
        self._connections: dict[tuple[str, int], _Connection] = {}
        self._dialling: dict[str, socket.socket] = {}
        self._leaving: list[_Connection] = []  # closed, with something still to be sent

    # --- the robot's side ---

    def check(self, device: str) -> None:
        check_known(device)
        number = device.removeprefix(SERIAL)
        if device == TCP and self.host is None:
            raise DeviceNotReady("the device TCP", "--allow-net gives it to programs")
        if device != TCP and number not in self.serial:
            raise DeviceNotReady(f"the device {device}", f"--serial {number}=pty makes it a pseudo-terminal")

    def open(self, device: str, address: Address | None) -> None:
        if address is None:
            ends = self._serial_line(device)
            self._begin(device, partial(self._connected, device, 0, ends))
        elif address.host:
            self._check_host(address.host)
            self._begin(device, partial(self._dial, device, address))
        else:
            listener = self._listener(address)
            where = listener.getsockname()
            self._begin(device, partial(self._listen, _Port(device, listener, address.clients)))
            self.tell(f"TCP port {where[1]} is open at {where[0]}")

    def _serial_line(self, device: str) -> Ends:
        """Raises DeviceNotReady."""
        if device in self._pseudo:
            return self._pseudo[device]
        ends, told = open_serial(self.serial[device.removeprefix(SERIAL)])
        if isinstance(ends, PseudoEnd):
            self._pseudo[device] = ends
        self.tell(f"{device} is {told}")
        return ends

    def _listener(self, address: Address) -> socket.socket:
        """Raises PortTaken, DeviceNotReady."""
        assert self.host is not None
        family = socket.AF_INET6 if ":" in self.host else socket.AF_INET
        listener = socket.socket(family, socket.SOCK_STREAM)
        try:
            if sys.platform != "win32":  # there it would let two programs have one port
                listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            listener.setblocking(False)
            listener.bind((self.host, address.port))
            listener.listen(address.clients)
        except OSError as error:
            listener.close()
            if error.errno == errno.EADDRINUSE:
                raise PortTaken(f"port {address.port}", "another program has it") from None
            raise self._told(f"port {address.port} at {self.host}: {error.strerror}", "choose another one") from None
        return listener

    def _check_host(self, host: str) -> None:
        """Raises DeviceNotReady for a name, as nobody knows how long it takes to look it up; and for another machine,
        where this one alone is allowed.
        """
        if address_of(host) is None:
            raise self._told(f"a connection to {host}", "give the address in numbers, as 192.168.0.7")
        if is_loopback(self.host or LOOPBACK) and not is_loopback(host):
            raise self._told(f"a connection to {host}", "--net-host 0.0.0.0 allows other machines")

    def _told(self, what: str, hint: str) -> DeviceNotReady:
        """Why a device is not ready, which its status does not say."""
        fault = DeviceNotReady(what, hint)
        self.tell(str(fault))
        return fault

    def send(self, device: str, handle: int, data: bytes) -> None:
        self._do(partial(self._send, device, handle, data))

    def ask(self, device: str, handle: int) -> None:
        self._do(partial(self._ask, device, handle))

    def consumed(self, device: str, handle: int, count: int) -> None:
        self._do(partial(self._consumed, device, handle, count))

    def release(self, device: str, handle: int) -> None:
        self._do(partial(self._release, device, handle))

    def close(self, device: str) -> None:
        self._open.discard(device)
        done = Done()
        self._do(partial(self._close, device, done))
        done.wait(GRACE)
        with self._coming:
            self._come = deque(arrival for arrival in self._come if arrival.device != device)
            self._due = self._due if self._come else None
        if not self._open:
            self._join()

    def close_all(self) -> None:
        for device in tuple(self._open):
            self.close(device)
        last = time.monotonic() + GRACE
        for ends in self._pseudo.values():
            while ends.unread() and time.monotonic() < last:
                time.sleep(LOOK)
            ends.leave()
        self._pseudo.clear()

    def due(self, clock: Clock) -> float:
        """An instant at which no program has done anything yet."""
        if not self._come:
            return inf
        if self._due is None:
            self._due = max(clock.reached, clock.now + TICK)
        return self._due

    def take(self, now: float) -> Iterable[Arrival]:  # noqa: ARG002
        with self._coming:
            come, self._come, self._due = self._come, deque(), None
        return come

    # --- the thread ---

    def _begin(self, device: str, begin: Callable[[], None]) -> None:
        self._open.add(device)
        if self._thread is None:
            self._wanted.clear()
            self._bell, self._ringer = socket.socketpair()
            self._bell.setblocking(False)
            self._ringer.setblocking(False)
            self._thread = Thread(target=self._serve, name="units", daemon=True)
            self._thread.start()
        self._do(begin)

    def _do(self, wanted: Callable[[], None]) -> None:
        self._wanted.append(wanted)
        with suppress(OSError):  # it rings already
            self._ringer.send(b"\0")

    def _join(self) -> None:
        thread, self._thread = self._thread, None
        if thread is not None:
            self._do(lambda: None)
            thread.join(2 * GRACE)

    def _serve(self) -> None:
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._bell, selectors.EVENT_READ, self._rung)
        while self._thread is not None or self._wanted or self._leaving:
            for key, mask in self._selector.select(self._rest()):
                key.data(mask)
            while self._wanted:
                self._wanted.popleft()()
            self._hurry()
            self._hush()
        self._selector.close()
        self._bell.close()
        self._ringer.close()

    def _rest(self) -> float | None:
        """How long nothing is to be done but to wait [s]."""
        ends = [one.closing for one in self._leaving]
        last = min([*ends, *(one.pause for one in self._connections.values())], default=inf)
        return None if last == inf else max(last - time.monotonic(), 0.0)

    def _rung(self, _mask: int) -> None:
        with suppress(OSError):
            self._bell.recv(PIECE)

    def _arrived(self, arrival: Arrival) -> None:
        with self._coming:
            self._come.append(arrival)
        self.wake()

    def _listen(self, port: _Port) -> None:
        self._ports[port.device] = port
        self._watch_port(port)

    def _watch_port(self, port: _Port) -> None:
        if bool(port.free) != port.watched:
            port.watched = bool(port.free)
            if port.watched:
                self._selector.register(port.listener, selectors.EVENT_READ, partial(self._accept, port))
            else:
                self._selector.unregister(port.listener)

    def _accept(self, port: _Port, _mask: int) -> None:
        try:
            client, _address = port.listener.accept()
        except OSError:  # it has gone before
            return
        handle = min(port.free)
        port.free.remove(handle)
        self._connected(port.device, handle, SocketEnd(client))
        self._arrived(Arrival(port.device, Event.OPENED, handle))
        self._watch_port(port)

    def _connected(self, device: str, handle: int, ends: Ends) -> None:
        one = self._connections[device, handle] = _Connection(device, handle, ends)
        self._watch(one)

    def _dial(self, device: str, address: Address) -> None:
        host = str(address_of(address.host))
        it = socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET, socket.SOCK_STREAM)
        it.setblocking(False)
        if it.connect_ex((host, address.port)) not in (0, errno.EINPROGRESS, errno.EWOULDBLOCK):
            self._refused(device, it)
            return
        self._dialling[device] = it
        self._selector.register(it, selectors.EVENT_WRITE, partial(self._dialled, device, it))

    def _dialled(self, device: str, it: socket.socket, _mask: int) -> None:
        self._selector.unregister(self._dialling.pop(device))
        if it.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR):
            self._refused(device, it)
            return
        self._connected(device, 0, SocketEnd(it))
        self._arrived(Arrival(device, Event.OPENED))

    def _refused(self, device: str, it: socket.socket) -> None:
        it.close()
        self._arrived(Arrival(device, Event.REFUSED, code=NetworkClosed.code))

    # --- connections ---

    def _watch(self, one: _Connection) -> None:
        """Look for what is of interest now."""
        wanted = 0 if one.broken else one.interest()
        if wanted == one.watched:
            return
        if not one.watched:
            self._selector.register(one.ends, wanted, partial(self._ready, one))
        elif wanted:
            self._selector.modify(one.ends, wanted, partial(self._ready, one))
        else:
            self._selector.unregister(one.ends)
        one.watched = wanted

    def _ready(self, one: _Connection, mask: int) -> None:
        if mask & selectors.EVENT_READ:
            self._receive(one)
        if mask & selectors.EVENT_WRITE and not one.broken:
            self._push(one)
        self._watch(one)

    def _receive(self, one: _Connection) -> None:
        try:
            data = one.ends.receive(min(one.room, PIECE))
        except (BlockingIOError, InterruptedError):
            return
        except OSError:
            self._break(one)
            return
        one.room -= len(data)
        unended = one.packets and one.room > 0 and data[-1:] not in b"\r\n"
        one.pause = time.monotonic() + PAUSE if unended else inf
        if data:
            self._arrived(Arrival(one.device, Event.CAME, one.handle, data))
        else:
            one.ended = True
            self._arrived(Arrival(one.device, Event.ENDED, one.handle))

    def _push(self, one: _Connection) -> None:
        """Send what can be sent now."""
        try:
            while one.out:
                del one.out[: one.ends.send(bytes(one.out[:WINDOW]))]
        except (BlockingIOError, InterruptedError):
            return
        except OSError:
            self._break(one)
            return
        if one.asked:
            one.asked = False
            self._arrived(Arrival(one.device, Event.WRITTEN, one.handle))

    def _break(self, one: _Connection) -> None:
        one.broken = True
        one.out.clear()
        if one.closing == inf:
            self._arrived(Arrival(one.device, Event.GONE, one.handle))

    def _send(self, device: str, handle: int, data: bytes) -> None:
        one = self._connections.get((device, handle))
        if one is not None and not one.broken:
            one.out += data
            self._push(one)
            self._watch(one)

    def _ask(self, device: str, handle: int) -> None:
        one = self._connections.get((device, handle))
        if one is not None and not one.broken:
            one.asked = True
            self._push(one)
            self._watch(one)

    def _consumed(self, device: str, handle: int, count: int) -> None:
        one = self._connections.get((device, handle))
        if one is not None:
            one.room += count
            self._watch(one)

    def _release(self, device: str, handle: int) -> None:
        one = self._connections.pop((device, handle), None)
        if one is not None:
            one.closing = time.monotonic() + GRACE
            self._leaving.append(one)
            self._watch(one)
        port = self._ports.get(device)
        if port is not None:
            port.free.add(handle)
            self._watch_port(port)

    def _close(self, device: str, done: Done) -> None:
        port = self._ports.pop(device, None)
        if port is not None:
            if port.watched:
                self._selector.unregister(port.listener)
            port.listener.close()
        dialled = self._dialling.pop(device, None)
        if dialled is not None:
            self._selector.unregister(dialled)
            dialled.close()
        for key in [key for key in self._connections if key[0] == device]:
            self._release(*key)
        self._hurry()
        done.set()

    def _hush(self) -> None:
        """Tell of lines that have no end. What had come until now is there."""
        now = time.monotonic()
        for one in self._connections.values():
            if now >= one.pause:
                one.pause = inf
                self._arrived(Arrival(one.device, Event.PAUSED, one.handle))

    def _hurry(self) -> None:
        """Close those from which all has left, or whose time is over."""
        now = time.monotonic()
        for one in tuple(self._leaving):
            if one.broken or not one.out or now >= one.closing:
                self._leaving.remove(one)
                one.broken = True
                self._watch(one)
                one.ends.close()


def address_of(host: str) -> ipaddress.IPv4Address | ipaddress.IPv6Address | None:
    """The address that is written there; None for a name, but that of this machine."""
    try:
        return ipaddress.ip_address(LOOPBACK if host.lower() == "localhost" else host)
    except ValueError:
        return None


def is_loopback(host: str) -> bool:
    """Whether an address is this machine, and cannot be another one."""
    address = address_of(host)
    return address is not None and address.is_loopback
