"""Serve all open ports and connections of programs, in one thread.

The thread runs an event loop, and owns the ports and connections. Other threads pass calls to it. From each connection
the thread reads only as many bytes as the unit can hold, so a peer that sends more has to wait. A port accepts as many
clients as FOPEN allows; further clients wait until one is released. The thread ends when the last device is closed.
"""

from __future__ import annotations

import asyncio
import errno
import socket
from collections.abc import Callable
from contextlib import suppress
from threading import Event as Done
from threading import Thread
from typing import NamedTuple, Protocol

from vrs_cli.devices.arrivals import Arrival, DeviceEvent
from vrs_cli.errors import NetworkClosed

WINDOW = 65536  # maximum number of unread bytes of one connection
PIECE = 16384  # maximum number of bytes of one read
PAUSE = 0.02  # [s] silence after which bytes without a line end count as a line
GRACE = 0.5  # [s] maximum time to send the remaining bytes after the device was closed
# settings of TCP keepalive, to detect peers that are gone: idle time [s], interval [s] and number of probes
ALONE = {"TCP_KEEPIDLE": 30, "TCP_KEEPINTVL": 10, "TCP_KEEPCNT": 3}


class NonBlockingEnd(Protocol):
    """Our end of a connection, which does not block."""

    def fileno(self) -> int: ...
    def receive(self, size: int) -> bytes: ...
    def send(self, data: bytes) -> int: ...
    def close(self) -> None: ...


class SocketEnd:
    """Our end of a TCP connection."""

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
    """A connection. `room`: the number of bytes that may arrive before the program reads some. `out`: unsent bytes.
    `asked`: report WRITTEN when all bytes were sent. `ended`: no more bytes arrive. `broken`: bytes can neither arrive
    nor be sent. `closing`: close it when all bytes were sent. `pause`: the timer that reports PAUSED after a silence of
    PAUSE seconds."""

    def __init__(self, device: str, handle: int, ends: NonBlockingEnd) -> None:
        self.device, self.handle, self.ends = device, handle, ends
        self.room, self.out = WINDOW, bytearray()
        self.asked = self.ended = self.broken = self.closing = False
        self.pause: asyncio.TimerHandle | None = None


class _Port(NamedTuple):
    """A port for clients, and the free handles for new connections."""

    listener: socket.socket
    free: set[int]


class Traffic:
    """The thread that serves ports and connections. `arrived`: called in this thread with each arrival."""

    def __init__(self, arrived: Callable[[Arrival], None]) -> None:
        self._arrived = arrived
        self._ports: dict[str, _Port] = {}
        self._connections: dict[tuple[str, int], _Connection] = {}
        self._dialling: dict[str, socket.socket] = {}
        self._leaving: list[_Connection] = []  # released connections that still send bytes
        self._ended = False
        self._loop = asyncio.SelectorEventLoop()
        self._thread = Thread(target=self._serve, name="units", daemon=True)
        self._thread.start()

    # --- from another thread ---

    def do(self, act: Callable[[Traffic], None]) -> None:
        """Schedule a call of `act` in the thread, in the order of these calls."""
        self._loop.call_soon_threadsafe(act, self)

    def close(self, device: str) -> None:
        """Close a device. After this method returns, no more events of the device arrive."""
        done = Done()
        self.do(lambda it: it._close(device, done))
        done.wait(GRACE)

    def end(self) -> None:
        """Stop the thread when all bytes were sent."""
        self.do(Traffic._end)
        self._thread.join(2 * GRACE)

    # --- in the thread ---

    def _serve(self) -> None:
        self._loop.run_forever()
        self._loop.close()

    def _end(self) -> None:
        self._ended = True
        if not self._leaving:
            self._loop.stop()

    def listen(self, device: str, listener: socket.socket, clients: int) -> None:
        """Accept clients at a port, at most `clients` at a time."""
        self._ports[device] = _Port(listener, set(range(1, clients + 1)))
        self._watch_port(device)

    def _watch_port(self, device: str) -> None:
        port = self._ports[device]
        if port.free:
            self._loop.add_reader(port.listener, self._accept, device)
        else:
            self._loop.remove_reader(port.listener)

    def _accept(self, device: str) -> None:
        port = self._ports[device]
        try:
            client, _address = port.listener.accept()
        except OSError:  # the client has already left
            return
        handle = min(port.free)
        port.free.remove(handle)
        self.connect(device, handle, SocketEnd(client))
        self._arrived(Arrival(device, DeviceEvent.OPENED, handle))
        self._watch_port(device)

    def connect(self, device: str, handle: int, ends: NonBlockingEnd) -> None:
        """Serve an open connection. If a device has only one connection, its handle is 0."""
        one = self._connections[device, handle] = _Connection(device, handle, ends)
        self._watch(one)

    def dial(self, device: str, host: str, port: int) -> None:
        """Connect to a numeric address. OPENED or REFUSED arrives later."""
        it = socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET, socket.SOCK_STREAM)
        it.setblocking(False)
        if it.connect_ex((host, port)) not in (0, errno.EINPROGRESS, errno.EWOULDBLOCK):
            self._refuse(device, it)
            return
        self._dialling[device] = it
        self._loop.add_writer(it, self._finish_dial, device)

    def _finish_dial(self, device: str) -> None:
        it = self._dialling.pop(device)
        self._loop.remove_writer(it)
        if it.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR):
            self._refuse(device, it)
            return
        self.connect(device, 0, SocketEnd(it))
        self._arrived(Arrival(device, DeviceEvent.OPENED))

    def _refuse(self, device: str, it: socket.socket) -> None:
        it.close()
        self._arrived(Arrival(device, DeviceEvent.REFUSED, code=NetworkClosed.code))

    def _watch(self, one: _Connection) -> None:
        """Let the loop watch a connection for reading if bytes may arrive, and for writing if bytes are unsent."""
        if one.room > 0 and not (one.ended or one.broken or one.closing):
            self._loop.add_reader(one.ends, self._receive, one)
        else:
            self._loop.remove_reader(one.ends)
        if one.out:
            self._loop.add_writer(one.ends, self._push, one)
        else:
            self._loop.remove_writer(one.ends)

    def _receive(self, one: _Connection) -> None:
        try:
            data = one.ends.receive(min(one.room, PIECE))
        except (BlockingIOError, InterruptedError):
            return
        except OSError:
            self._break(one)
            return
        one.room -= len(data)
        one.ended = not data
        self._arrived(Arrival(one.device, DeviceEvent.CAME if data else DeviceEvent.ENDED, one.handle, data))
        self._end_pause(one)
        if isinstance(one.ends, SocketEnd) and one.room > 0 and data[-1:] not in b"\r\n":
            one.pause = self._loop.call_later(PAUSE, self._arrived, Arrival(one.device, DeviceEvent.PAUSED, one.handle))
        self._watch(one)

    @staticmethod
    def _end_pause(one: _Connection) -> None:
        if one.pause is not None:
            one.pause.cancel()

    def _push(self, one: _Connection) -> None:
        """Send as many bytes as possible now."""
        try:
            while one.out:
                del one.out[: one.ends.send(bytes(one.out[:WINDOW]))]
        except (BlockingIOError, InterruptedError):
            self._watch(one)
            return
        except OSError:
            self._break(one)
            return
        if one.asked:
            one.asked = False
            self._arrived(Arrival(one.device, DeviceEvent.WRITTEN, one.handle))
        self._watch(one)
        if one.closing:
            self._shut(one)

    def _break(self, one: _Connection) -> None:
        one.broken = True
        one.out.clear()
        self._watch(one)
        if one.closing:
            self._shut(one)
        else:
            self._arrived(Arrival(one.device, DeviceEvent.GONE, one.handle))

    def send(self, device: str, handle: int, data: bytes, *, ask: bool = False) -> None:
        """Send bytes. `ask`: report WRITTEN when all bytes were sent."""
        one = self._connections.get((device, handle))
        if one is not None and not one.broken:
            one.out += data
            one.asked |= ask
            self._push(one)

    def confirm_read(self, device: str, handle: int, count: int) -> None:
        if (one := self._connections.get((device, handle))) is not None:
            one.room += count
            self._watch(one)

    def release(self, device: str, handle: int) -> None:
        if (one := self._connections.pop((device, handle), None)) is not None:
            one.closing = True
            self._end_pause(one)
            self._leaving.append(one)
            self._watch(one)
            if one.out:
                self._loop.call_later(GRACE, self._shut, one)
            else:
                self._shut(one)
        if device in self._ports:
            self._ports[device].free.add(handle)
            self._watch_port(device)

    def _shut(self, one: _Connection) -> None:
        """Close a released connection, after all its bytes were sent or GRACE seconds have passed."""
        if one in self._leaving:
            self._leaving.remove(one)
            one.out.clear()
            self._watch(one)
            one.ends.close()
        if self._ended and not self._leaving:
            self._loop.stop()

    def _close(self, device: str, done: Done) -> None:
        if device in self._ports:
            listener = self._ports.pop(device).listener
            self._loop.remove_reader(listener)
            listener.close()
        if device in self._dialling:
            dialled = self._dialling.pop(device)
            self._loop.remove_writer(dialled)
            dialled.close()
        for key in [key for key in self._connections if key[0] == device]:
            self.release(*key)
        done.set()
