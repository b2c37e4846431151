"""Define the external devices (TCP ports, serial lines) to which tasks attach logical units, and handle the bytes that
arrive from them.

Bytes arrive at an instant of the robot's clock, before all actions of programs at that instant. So programs that
receive the same arrivals at the same times behave identically: a recording is a list of arrivals, and a script can
replace the peers (the programs at the other ends).

Each byte becomes one character, so that a V+ string can hold any bytes. A line ends with LF, CR LF or CR, which are not
part of it. A line longer than the maximum is delivered in several pieces. Bytes without a line end count as a line if
the peer then pauses or closes the connection, because in V+ a READ returns the contents of one packet.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable
from itertools import count

from msgspec import Struct, field

from vrs_cli import errors
from vrs_cli.devices.arrivals import MAX_LINE_BYTES, Address, Arrival, DeviceEvent, read_address
from vrs_cli.devices.outside import TCP, YET, Outside, Waits
from vrs_cli.language.run.effects import CLOSED, OPENED, SUCCESS

FULL = 65536  # [bytes] while more bytes than this may be unsent, a program that wants to write waits
CONFIRM_BYTES = 8192  # [bytes] each time that a program has read this many bytes, they are confirmed
# the FCMND that closes a connection, as in V+ programs, and the length of its argument, the handle [bytes]
CLOSE_CONNECTION, HANDLE = 600, 2
END_OF_LINE = "\r\n"  # end of a written line
RETURN, LINE_FEED = 13, 10  # character codes of CR and LF
_END = re.compile(rb"[\r\n]")


class DeviceConnection(Struct, eq=False):
    """A connection of a device. `announced`: whether the program was informed that the connection is open. `data`:
    unread bytes. `paused`, `ended`, `gone`: whether the `DeviceEvent` of that name has occurred. `unwritten`: number of
    sent bytes not known to have left; `asked`: whether WRITTEN was requested. `taken`: number of bytes read since the
    last `confirm_read`. `returned`: whether the last line ended with CR, so that an LF that follows is part of this
    line end."""

    handle: int
    announced: bool
    data: bytearray = field(default_factory=bytearray)
    paused: bool = False
    ended: bool = False
    gone: bool = False
    unwritten: int = 0
    taken: int = 0
    asked: bool = False
    returned: bool = False

    def record(self, longest: int) -> bytes | None:
        """Remove and return the next line; None if it is not complete."""
        data = self.data
        self._pass_line_feed()
        if (end := _END.search(data, 0, longest + 1)) is None:
            piece = bytes(data[:longest]) if len(data) > longest or (data and (self.paused or self.ended)) else None
            del data[: len(piece or b"")]
            return piece
        line, self.returned = data[: end.start()], data[end.start()] == RETURN
        del data[: end.end()]
        self._pass_line_feed()
        return bytes(line)

    def byte(self) -> int | None:
        self._pass_line_feed()
        return self.data.pop(0) if self.data else None

    def _pass_line_feed(self) -> None:
        if self.returned and self.data:
            self.returned = False
            if self.data[0] == LINE_FEED:
                del self.data[0]


class Device(Struct, eq=False):
    """The device of a unit. `attached`: the name given to ATTACH; `name`: this name, with the port once it is known.
    `fault`: the reason why the device cannot be used. `status`, `length`, `handle`: results of the last operation.
    `expired`: whether GETC has waited for its maximum time. `dialing`: whether a connection was requested and is not
    open yet."""

    attached: str
    name: str
    outside: Outside
    fault: errors.VrsError | None = None
    address: Address | None = None
    open: bool = False
    status: int = SUCCESS
    length: int = 0
    handle: int = 0
    expired: bool = False
    dialing: bool = False
    _fresh: bool = False
    _refused: int | None = None  # outcome of the requested connection: 0 if open, otherwise an error code; None before
    _connections: dict[int, DeviceConnection] = field(default_factory=dict)

    # --- opening and closing ---

    def begin(self) -> None:
        """Attach the unit; open the device if it is a serial line. Raises DeviceNotReady."""
        self.outside.check(self.name)
        if self.name != TCP:
            self.outside.open(self.name, None)
            self.open = True
            self._connections[0] = DeviceConnection(0, announced=True)

    def open_at(self, how: str, in_use: Collection[str] = ()) -> None:
        """Execute FOPEN; `dial_result` then gives the outcome. `how`: the string given to FOPEN; `in_use`: names of the
        devices in use. Raises IllegalValue, FileOpened, FileError, DeviceNotReady, PortTaken.
        """
        self._check_fault()
        if self.open:
            raise errors.FileOpened(self.name, "FCLOSE closes it")
        if self.name != TCP:
            raise errors.FileError(f"{self.name} has no ports", "FOPEN is for TCP")
        address = read_address(how)
        names = (address.name if number == 1 else f"{address.name}#{number}" for number in count(1))
        name = next(one for one in names if one not in in_use)  # two connections to one port need different names
        self.outside.open(name, address)
        self.name, self.address, self.open, self.dialing = name, address, True, bool(address.host)

    def dial_result(self) -> Waits | None:
        """Return YET while a connection is being opened; then set the status to the outcome and return None."""
        if self.dialing and self._refused is None:
            return YET
        refused, self._refused, self.dialing = self._refused, None, False
        if refused:
            self.close()
        self.status = refused or SUCCESS
        return None

    def close_port(self) -> None:
        """Execute FCLOSE. Raises FileError for a serial line, and the errors of `check_open`."""
        self.check_open()
        if self.address is None:
            raise errors.FileError(f"{self.name} has no ports", "DETACH closes a serial line")
        self.close()
        self.status = SUCCESS

    def close(self) -> None:
        """Close the device with all its connections."""
        if self.open:
            self.outside.close(self.name)
        if self.address is not None:
            self.name, self.address = TCP, None
        self.open, self.dialing, self._refused = False, False, None
        self._connections.clear()

    def command(self, number: int, data: str) -> None:
        """Execute FCMND. Raises FileError, and the errors of `check_open`."""
        self.check_open()
        if number != CLOSE_CONNECTION or len(data) < HANDLE:
            raise errors.FileError(f"FCMND {number}", f"{CLOSE_CONNECTION} and $INTB(handle) close a connection")
        handle = ord(data[0]) << 8 | ord(data[1])
        if handle in self._connections:
            self._release(handle)
        self.status = SUCCESS

    def check_open(self) -> None:
        """Check that the device is open. Raises FileNotOpened, or the reason why the device cannot be used."""
        self._check_fault()
        if not self.open:
            raise errors.FileNotOpened(self.name, "FOPEN opens a port")

    def _check_fault(self) -> None:
        if self.fault is not None:
            raise self.fault.with_traceback(None)

    def _release(self, handle: int) -> None:
        del self._connections[handle]
        self.outside.release(self.name, handle)

    # --- arrivals ---

    def arrive(self, arrival: Arrival) -> None:
        """Take an arrival, and keep its data until a program reads them."""
        self._fresh = True
        handle, event = arrival.handle, arrival.event
        if event is DeviceEvent.REFUSED:
            self._refused = arrival.code or errors.NetworkClosed.code
        elif event is DeviceEvent.OPENED:
            self._connections[handle] = DeviceConnection(handle, announced=self.dialing)
            self._refused = 0
        elif (one := self._connections.get(handle)) is None:
            return
        elif event is DeviceEvent.CAME:
            one.data += arrival.data
            one.paused = False
        elif event is DeviceEvent.PAUSED:
            one.paused = True
        elif event is DeviceEvent.WRITTEN:
            one.unwritten, one.asked = 0, False
        else:
            one.ended, one.gone = True, one.gone or event is DeviceEvent.GONE

    # --- reading ---

    def read(self, notices: bool, wait: bool) -> str | Waits | None:
        """Execute READ: return a line, None if the result is only a status, or YET to wait. `notices`: report opened
        and closed connections as a status. Raises NoDataReceived, NetworkClosed, and the errors of `check_open`."""
        self.check_open()
        longest = MAX_LINE_BYTES if self.address is None else self.address.longest
        for one in self._in_turn(self.handle + 1):
            if notices and not one.announced:
                one.announced = True
                self._set_status(one, OPENED)
                return None
            before = len(one.data)
            if (line := one.record(longest)) is not None:
                self._count_read(one, before - len(one.data))
                self._set_status(one, SUCCESS, len(line))
                return line.decode("latin-1")
            if one.ended:
                self._release(one.handle)
                self._set_status(one, CLOSED if notices else errors.NetworkClosed.code)
                return None
        return self._nothing(wait)

    def character(self, wait: bool) -> int | Waits:
        """Execute GETC: return the next byte, or YET to wait. Raises NetworkTimeout, and the errors of `read`."""
        self.check_open()
        if self.expired:
            self.expired = False
            raise errors.NetworkTimeout(self.name)
        for one in self._in_turn(self.handle):
            if (byte := one.byte()) is not None:
                self._count_read(one, 1)
                self._set_status(one, SUCCESS)
                return byte
            if one.ended:
                self._release(one.handle)
                self._set_status(one, SUCCESS)
                raise errors.NetworkClosed(self.name)
        self._fresh = False
        return self._nothing(wait)

    def put_back(self, bytes_: Iterable[int]) -> None:
        """Put bytes back, so that the current step reads them again when it is repeated."""
        if (one := self._connections.get(self.handle)) is not None:
            one.data[:0] = bytes(bytes_)

    @property
    def has_more(self) -> bool:
        """Return whether a waiting GETC can continue: something has arrived, the maximum wait is over, or the device
        was closed."""
        return self.expired or self._fresh or not self.open

    def _count_read(self, one: DeviceConnection, count: int) -> None:
        """Count bytes as read. Confirm them only every CONFIRM_BYTES, because confirming each byte would be slow."""
        one.taken += count
        if one.taken >= CONFIRM_BYTES:
            self.outside.confirm_read(self.name, one.handle, one.taken)
            one.taken = 0

    def _in_turn(self, first: int) -> list[DeviceConnection]:
        """Return the connections by rising handle, starting at handle `first`; smaller handles come last."""
        return sorted(self._connections.values(), key=lambda one: (one.handle < first, one.handle))

    def _set_status(self, one: DeviceConnection, status: int, length: int = 0) -> None:
        self.handle, self.status, self.length = one.handle, status, length

    def _nothing(self, wait: bool) -> Waits:
        """Return YET if the program waits. Raises NoDataReceived if it does not wait, and NetworkClosed if no more data
        can arrive."""
        if not self._connections and not self._listens:
            raise errors.NetworkClosed(self.name)
        if not wait:
            raise errors.NoDataReceived(self.name)
        return YET

    @property
    def _listens(self) -> bool:
        return self.address is not None and not self.address.host

    # --- writing ---

    def write(self, text: str, newline: bool, handle: int | None, wait: bool) -> Waits | None:
        """Send text to the connection with this handle; None: to the connection of the last READ or, if that is not
        open, to the first open connection. Return YET if the program has to wait. Raises NetworkClosed, and the errors
        of `check_open`.
        """
        self.check_open()
        one = self._connections.get(self.handle if handle is None else handle)
        if one is None and handle is None:
            one = next(iter(self._connections.values()), None)
        if one is None:
            if wait and handle is None and self._listens:
                return YET
            raise errors.NetworkClosed(self.name)
        if one.gone:
            self._release(one.handle)
            raise errors.NetworkClosed(self.name)
        if one.unwritten > FULL:
            if not one.asked:
                one.asked = True
                self.outside.send(self.name, one.handle, b"", ask=True)
            return YET
        data = (text + END_OF_LINE * newline).encode("latin-1", "replace")
        one.unwritten += len(data)
        self.outside.send(self.name, one.handle, data)
        self.status, self.length = SUCCESS, len(text)
        return None

    # --- timeouts ---

    def expire(self, *, of_getc: bool) -> None:
        """End the waiting operation with NetworkTimeout. `of_getc`: the operation is a GETC, which raises the error."""
        if of_getc:
            self.expired = True
        else:
            if self.dialing:
                self.close()
            self.status, self.length = errors.NetworkTimeout.code, 0
