"""All that is open at once, and the one thread that waits for it.

The thread owns ports and connections. Whoever wants something of them puts it in a queue and rings. Of each connection
so much is taken as its unit can hold: a peer that sends more waits. A port has as many clients as it was opened for;
others wait until one is released. The thread ends with the last device.
"""

from __future__ import annotations

import errno
import selectors
import socket
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from math import inf
from threading import Event as Done
from threading import Thread
from typing import Concatenate, ParamSpec, Protocol

from vrs_cli.devices.outside import Arrival, Event
from vrs_cli.errors import NetworkClosed

WINDOW = 65536  # bytes that have come and were not read, of one connection
PIECE = 16384  # bytes that are taken at once
PAUSE = 0.02  # [s] in which a line goes on whose end has not come
GRACE = 0.5  # [s] that what was written has to leave when its device is closed
ALONE = {"TCP_KEEPIDLE": 30, "TCP_KEEPINTVL": 10, "TCP_KEEPCNT": 3}  # [s], [s], times: a peer that is gone is missed

P = ParamSpec("P")


class NonBlockingEnd(Protocol):
    """One end of a connection, which does not block."""

    def fileno(self) -> int: ...
    def receive(self, size: int) -> bytes: ...
    def send(self, data: bytes) -> int: ...
    def close(self) -> None: ...


class SocketEnd:
    """The end of a TCP connection."""

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

    def __init__(self, device: str, handle: int, ends: NonBlockingEnd) -> None:
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


class Traffic:
    """`arrived` hears, in its thread, what comes."""

    def __init__(self, arrived: Callable[[Arrival], None]) -> None:
        self._arrived = arrived
        self._wanted: deque[Callable[[], None]] = deque()
        self._ports: dict[str, _Port] = {}
        self._connections: dict[tuple[str, int], _Connection] = {}
        self._dialling: dict[str, socket.socket] = {}
        self._leaving: list[_Connection] = []  # closed, with something still to be sent
        self._ended = False
        self._selector = selectors.DefaultSelector()
        self._bell, self._ringer = socket.socketpair()
        for end in (self._bell, self._ringer):
            end.setblocking(False)
        self._thread = Thread(target=self._serve, name="units", daemon=True)
        self._thread.start()

    # --- from another thread ---

    def do(self, act: Callable[Concatenate[Traffic, P], None], *of: P.args, **named: P.kwargs) -> None:
        """Have the thread do something: `traffic.do(Traffic.send, device, handle, data)`."""
        self._wanted.append(partial(act, self, *of, **named))
        with suppress(OSError):  # it rings already
            self._ringer.send(b"\0")

    def close(self, device: str) -> None:
        """Nothing of it arrives any more."""
        done = Done()
        self.do(Traffic._close, device, done)
        done.wait(GRACE)

    def end(self) -> None:
        """Once what was written has left, all is closed."""
        self.do(Traffic._end)
        self._thread.join(2 * GRACE)

    # --- in the thread ---

    def _end(self) -> None:
        self._ended = True

    def _serve(self) -> None:
        self._selector.register(self._bell, selectors.EVENT_READ, self._rung)
        while not self._ended or self._leaving:
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
        """The time for which the thread may wait [s]; None for ever."""
        ends = [one.closing for one in self._leaving]
        last = min([*ends, *(one.pause for one in self._connections.values())], default=inf)
        return None if last == inf else max(last - time.monotonic(), 0.0)

    def _rung(self, _mask: int) -> None:
        with suppress(OSError):
            self._bell.recv(PIECE)

    def listen(self, device: str, listener: socket.socket, clients: int) -> None:
        """Let clients in."""
        port = self._ports[device] = _Port(device, listener, clients)
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
        self.connect(port.device, handle, SocketEnd(client))
        self._arrived(Arrival(port.device, Event.OPENED, handle))
        self._watch_port(port)

    def connect(self, device: str, handle: int, ends: NonBlockingEnd) -> None:
        """A connection is open. That of a device with one alone has the handle 0."""
        one = self._connections[device, handle] = _Connection(device, handle, ends)
        self._watch(one)

    def dial(self, device: str, host: str, port: int) -> None:
        """Connect to a numeric address: OPENED or REFUSED arrives."""
        it = socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET, socket.SOCK_STREAM)
        it.setblocking(False)
        if it.connect_ex((host, port)) not in (0, errno.EINPROGRESS, errno.EWOULDBLOCK):
            self._refused(device, it)
            return
        self._dialling[device] = it
        self._selector.register(it, selectors.EVENT_WRITE, partial(self._dialled, device, it))

    def _dialled(self, device: str, it: socket.socket, _mask: int) -> None:
        self._selector.unregister(self._dialling.pop(device))
        if it.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR):
            self._refused(device, it)
            return
        self.connect(device, 0, SocketEnd(it))
        self._arrived(Arrival(device, Event.OPENED))

    def _refused(self, device: str, it: socket.socket) -> None:
        it.close()
        self._arrived(Arrival(device, Event.REFUSED, code=NetworkClosed.code))

    def _watch(self, one: _Connection) -> None:
        """Register what the selector is to watch of a connection."""
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

    def send(self, device: str, handle: int, data: bytes, *, ask: bool = False) -> None:
        """Send bytes. `ask`: WRITTEN arrives when all has left."""
        one = self._connections.get((device, handle))
        if one is not None and not one.broken:
            one.out += data
            one.asked |= ask
            self._push(one)
            self._watch(one)

    def consumed(self, device: str, handle: int, count: int) -> None:
        one = self._connections.get((device, handle))
        if one is not None:
            one.room += count
            self._watch(one)

    def release(self, device: str, handle: int) -> None:
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
            self.release(*key)
        self._hurry()
        done.set()

    def _hush(self) -> None:
        """Report lines whose end has not come for a while."""
        now = time.monotonic()
        for one in self._connections.values():
            if now >= one.pause:
                one.pause = inf
                self._arrived(Arrival(one.device, Event.PAUSED, one.handle))

    def _hurry(self) -> None:
        """Close the connections from which all has left, or whose time is over."""
        now = time.monotonic()
        for one in tuple(self._leaving):
            if one.broken or not one.out or now >= one.closing:
                self._leaving.remove(one)
                one.broken = True
                self._watch(one)
                one.ends.close()
