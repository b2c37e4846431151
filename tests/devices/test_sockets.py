"""TCP over real sockets on this machine, with peers that behave and with those that do not."""

from __future__ import annotations

import socket
import struct
import threading
from contextlib import suppress

import pytest

from tests.devices.peers import Door, client, connected, exchange, heard, live_session, run
from tests.interfaces.programs import load, value
from tests.live import PATIENCE
from vrs_cli.devices import traffic
from vrs_cli.devices.device import FULL
from vrs_cli.devices.sockets import Sockets, is_loopback
from vrs_cli.devices.traffic import WINDOW, SocketEnd
from vrs_cli.errors import DeviceNotReady, NetworkClosed, NetworkTimeout, PortTaken, StringOverflow
from vrs_cli.values.results import RunOutcome

OPEN = ('ATTACH (lun, 4) "TCP"', 'FOPEN (lun, 16) "/LOCAL_PORT 0 /CLIENTS 2 /BUFFER_SIZE 2048"')
CLOSE = ("FCLOSE (lun)", "DETACH (lun)")
READ = ('$line = ""', "READ (lun, handle) $line", "status = IOSTAT(lun)", 'TYPE /I0, status, " ", handle, " ", $line')
RESET = struct.pack("ii", 1, 0)  # of SO_LINGER: close at once, with a reset


STATUS = ("TYPE /I0, IOSTAT(lun)",)


def many(count: int, *lines: str) -> tuple[str, ...]:
    return (f"FOR i = 1 TO {count}", *lines, "END")


def until_closed(*lines: str) -> tuple[str, ...]:
    return ("DO", *lines, "UNTIL status == 101")


def no_thread_is_left() -> bool:
    return not [thread for thread in threading.enumerate() if thread.name == "units"]


# --- peers that behave ---


def test_a_client_is_answered_and_its_coming_and_going_is_told() -> None:
    def dialogue(line: socket.socket) -> None:
        assert exchange(line, b"hello\r\n", 12) == b"you: hello\r\n"

    echo = ("IF status == 1 THEN", 'WRITE (lun, handle) "you: ", $line', "END")
    _, result = run(Door(client(dialogue)), *OPEN, *until_closed(*READ, *echo), *CLOSE)
    assert result.fault is None
    assert result.typed == ("100 1 ", "1 1 hello", "101 1 ")
    assert no_thread_is_left()


def test_lines_end_in_every_way_and_hold_every_byte() -> None:
    said = b"lf\ncrlf\r\ncr\rnul\x00\n\nz\xc3\xbcrich\nrest"
    _, result = run(Door(client(lambda line: line.sendall(said))), *OPEN, *until_closed(*READ), *CLOSE)
    texts = ["lf", "crlf", "cr", "nul\x00", "", "z\xc3\xbcrich", "rest"]
    assert result.typed == ("100 1 ", *(f"1 1 {text}" for text in texts), "101 1 ")


def test_bytes_are_read_one_by_one_and_written_as_they_are() -> None:
    def dialogue(line: socket.socket) -> None:
        assert exchange(line, bytes(range(256)), 6) == bytes([0, 255, 13, 10, 200, 7])

    sent = "$CHR(0), $CHR(255), $CHR(13), $CHR(10), $CHR(200), $CHR(7)"
    lines = ("sum = 0", *many(256, "sum = sum+GETC(lun)"), "TYPE /I0, sum", f"WRITE (lun) {sent}, /S", "x = GETC(lun)")
    _, result = run(Door(client(dialogue)), *OPEN, *lines, 'TYPE /I0, x, " ", IOSTAT(lun)', *CLOSE)
    assert result.fault is None
    assert result.typed == (str(sum(range(256))), f"{NetworkClosed.code} {NetworkClosed.code}")


def test_packets_without_ends_of_lines_are_read_one_by_one() -> None:
    def dialogue(line: socket.socket) -> None:
        for number in (1, 70000):
            assert exchange(line, number.to_bytes(4, "big"), 1) == b"!"

    read = ("IF status == 1 THEN", "TYPE /I0, LNGB($line)", 'WRITE (lun, handle) "!", /S', "END")
    lines = until_closed('$line = ""', "READ (lun, handle) $line", "status = IOSTAT(lun)", *read)
    _, result = run(Door(client(dialogue)), *OPEN, *lines, *CLOSE)
    assert result.typed == ("1", "70000")


def test_what_is_written_leaves_before_the_port_closes() -> None:
    said = [b""]

    def dialogue(line: socket.socket) -> None:
        said[0] = heard(line, 200_000)

    text = "0123456789" * 10
    run(Door(client(dialogue)), *OPEN, *READ, *many(500, f'WRITE (lun, handle) "{text}"'), *CLOSE)
    assert said[0] == f"{text}\r\n".encode() * 500


def test_more_clients_than_a_port_has_wait_until_one_is_gone() -> None:
    def dialogue(port: int) -> None:
        lines = [connected(port) for _ in range(3)]
        for number, line in enumerate(lines[:2]):
            assert exchange(line, b"%d\n" % number, 1) == b"!"
        lines[2].sendall(b"2\n")
        lines[0].close()
        assert heard(lines[2], 1) == b"!", "the third has the place of the first"
        for line in lines[1:]:
            line.close()

    answer = (
        "IF status == 1 THEN",
        'WRITE (lun, handle) "!", /S',
        "END",
        "IF status == 101 THEN",
        "left = left+1",
        "END",
    )
    _, result = run(Door(dialogue), "left = 0", *OPEN, "DO", *READ, *answer, "UNTIL left == 3", *CLOSE)
    assert result.fault is None
    assert sorted(result.typed[:4]) == ["1 1 0", "1 2 1", "100 1 ", "100 2 "]
    assert result.typed[4:7] == ("101 1 ", "100 1 ", "1 1 2")


def test_a_program_closes_a_connection_by_its_handle() -> None:
    def dialogue(line: socket.socket) -> None:
        assert exchange(line, b"bye\n", 1) == b"", "closed"

    _, result = run(Door(client(dialogue)), *OPEN, *READ, *READ, "FCMND (lun, 600) $INTB(handle)", *STATUS, *CLOSE)
    assert result.typed == ("100 1 ", "1 1 bye", "1")


def test_a_program_connects_to_another() -> None:
    listener = socket.create_server(("127.0.0.1", 0))
    port = listener.getsockname()[1]

    def answer() -> None:
        line, _ = listener.accept()
        with line:
            assert exchange(line, b"who?\n", 4) == b"me\r\n"

    peer = threading.Thread(target=answer)
    peer.start()
    where = f'FOPEN (lun, 16) "localhost /REMOTE_PORT {port}"'
    dialogue = ("READ (lun) $line", "TYPE $line", 'WRITE (lun) "me"', "READ (lun) $line", *STATUS)
    _, result = run(Door(), OPEN[0], where, *dialogue, *CLOSE)
    peer.join()
    listener.close()
    assert result.fault is None
    assert result.typed == ("who?", str(NetworkClosed.code))


# --- peers that do not ---


def test_a_peer_that_is_reset_is_gone() -> None:
    def dialogue(line: socket.socket) -> None:
        line.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, RESET)

    _, result = run(Door(client(dialogue)), *OPEN, *READ, *READ, 'WRITE (lun, handle) "?"', *STATUS, *CLOSE)
    assert result.typed == ("100 1 ", "101 1 ", str(NetworkClosed.code))


def test_a_peer_that_goes_is_missed_by_a_program_that_only_writes() -> None:
    def dialogue(line: socket.socket) -> None:
        heard(line, 1)
        line.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, RESET)

    stream = ("DO", 'WRITE (lun) "position"', "WAIT", f"UNTIL IOSTAT(lun) == {NetworkClosed.code}")
    _, result = run(Door(client(dialogue)), *OPEN, *stream, *CLOSE, rate=20.0)
    assert result.fault is None


def test_a_peer_that_never_ends_a_line_costs_no_memory() -> None:
    size = 4 * WINDOW
    read = ("READ (lun, handle) $line", "status = IOSTAT(lun)")
    count = (f"IF status == {StringOverflow.code} THEN", "sum = sum+IOSTAT(lun, 2)", "END")
    door = Door(client(lambda line: line.sendall(b"x" * size)))
    _, result = run(door, "sum = 0", *OPEN, *until_closed(*read, *count), "TYPE /I0, sum", *CLOSE)
    assert result.fault is None
    assert result.typed == (str(size),)


def test_what_nobody_reads_is_not_taken_from_its_peer() -> None:
    taken = []

    def dialogue(line: socket.socket) -> None:
        line.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, WINDOW)
        line.settimeout(0.05)
        with suppress(TimeoutError, ConnectionError):
            while True:
                taken.append(line.send(b"x" * WINDOW))

    outside = Sockets(patience=10.0)
    session = live_session(door := Door(client(dialogue)), outside)
    load(session, *OPEN, "READ (lun, handle) $line", "WAIT.EVENT , 0.15", *CLOSE)
    come = []
    take = outside.take
    outside.take = lambda now: come.append(tuple(take(now))) or come[-1]  # type: ignore[method-assign, func-returns-value]
    session.execute("main")
    session.close()
    door.leave()
    assert 0 < sum(len(one.data) for some in come for one in some) <= WINDOW
    assert sum(taken) > WINDOW


def test_a_line_that_is_too_long_for_a_string_is_passed_over() -> None:
    said = b"y" * 200 + b"\nshort\n"
    _, result = run(Door(client(lambda line: line.sendall(said))), *OPEN, *until_closed(*READ), *CLOSE)
    assert result.typed == ("100 1 ", f"{StringOverflow.code} 1 ", "1 1 short", "101 1 ")


class Narrow(SocketEnd):
    """Of a socket that holds little."""

    def __init__(self, it: socket.socket) -> None:
        it.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 4096)
        super().__init__(it)


def test_a_peer_that_never_reads_is_waited_for_and_no_longer_than_that(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(traffic, "SocketEnd", Narrow)
    seen = threading.Event()

    def dialogue(line: socket.socket) -> None:
        line.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        assert seen.wait(PATIENCE)

    sent = "WRITE (lun, handle) $text, $text, $text, $text, $text, $text, $text, $text"
    text = ('$text = ""', *many(100, '$text = $text+"z"'))
    outside = Sockets(patience=0.2)
    door = Door(client(dialogue))
    session = live_session(door, outside)
    fill = ("bytes = 0", "DO", sent, "bytes = bytes+800", "UNTIL IOSTAT(lun) < 0", "status = IOSTAT(lun)")
    load(session, *text, *OPEN, *READ, *fill, *CLOSE)
    result = session.execute("main")
    seen.set()
    session.close()
    door.leave()
    assert result.fault is None
    assert value(session, "status") == NetworkTimeout.code
    assert FULL < value(session, "bytes") < 20_000_000  # type: ignore[operator]
    assert no_thread_is_left()


def test_nobody_comes() -> None:
    lines = (*READ, "x = GETC(lun)", 'TYPE /I0, x, " ", IOSTAT(lun)')
    _, result = run(Door(), *OPEN, *lines, *CLOSE, outside=Sockets(patience=0.05))
    assert result.fault is None
    assert result.typed == (f"{NetworkTimeout.code} 0 ", f"{NetworkTimeout.code} {NetworkTimeout.code}")


def test_nobody_listens() -> None:
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    where = f'FOPEN (lun, 16) "127.0.0.1 /REMOTE_PORT {port}"'
    _, result = run(Door(), OPEN[0], where, *STATUS, "READ (lun) $line", *STATUS)
    assert result.fault is None
    assert result.typed == (str(NetworkClosed.code), "-513")


# --- ports ---


def test_a_port_that_another_program_has() -> None:
    with socket.create_server(("127.0.0.1", 0)) as theirs:
        port = theirs.getsockname()[1]
        fopen = (f'FOPEN (lun, 16) "/LOCAL_PORT {port}"', *STATUS)
        _, result = run(Door(), OPEN[0], *fopen)
    assert result.fault is None
    assert result.typed == (str(PortTaken.code),)


def test_two_tasks_cannot_have_one_port_and_a_port_that_is_closed_is_free() -> None:
    door = Door()
    session = live_session(door, rate=1000.0)
    load(session, *OPEN, "WAIT.EVENT", name="other")
    session.start(1, "other")
    fopen = (OPEN[0], f'FOPEN (lun, 16) "/LOCAL_PORT {door.ports[0]}"', *STATUS, *CLOSE)
    load(session, *fopen)
    assert session.execute("main").typed == (str(PortTaken.code),)
    session.perform("ABORT 1")
    session.perform("KILL 1")
    assert session.execute("main").typed == ("1",)
    session.close()
    assert no_thread_is_left()


def test_a_port_is_free_again_at_once_though_its_program_closed_the_connections() -> None:
    door = Door(client(lambda line: heard(line, 1)))
    _, result = run(door, *OPEN, *READ, *CLOSE)
    again = Door(client(lambda line: line.sendall(b"again\n")))
    _, result = run(again, OPEN[0], f'FOPEN (lun, 16) "/LOCAL_PORT {door.ports[0]}"', *READ, *READ, *CLOSE)
    assert result.typed == ("100 1 ", "1 1 again")


@pytest.mark.parametrize("host", ["example.org", "192.0.2.1", "0.0.0.0", "::"])
def test_connections_leave_this_machine_only_where_that_is_allowed(host: str) -> None:
    assert not is_loopback(host)
    fopen = (OPEN[0], f'FOPEN (lun, 16) "{host} /REMOTE_PORT 80"', *STATUS)
    _, result = run(Door(), *fopen)
    assert result.typed == (str(DeviceNotReady.code),)


# --- the end ---


@pytest.mark.parametrize("step", ["READ (lun, handle) $line", "x = GETC(lun)", 'WRITE (lun) "?"'])
def test_abort_ends_a_wait_for_a_peer_at_once(step: str) -> None:
    door = Door()
    session = live_session(door, Sockets())
    load(session, *OPEN, step)
    stop = threading.Timer(0.05, session.interrupt)
    stop.start()
    result = session.execute("main")
    stop.join()
    assert result.outcome is RunOutcome.ABORTED
    assert result.ended - result.started < 5.0
    connected(door.ports[0]).close()  # it is open until the program is cleared: PROCEED goes on
    session.perform("KILL")
    with pytest.raises(ConnectionError):
        connected(door.ports[0])
    session.close()
    assert no_thread_is_left()


def test_a_program_that_stops_at_an_error_leaves_no_port_when_the_session_ends() -> None:
    door = Door()
    session = live_session(door)
    load(session, *OPEN, "x = undefined.name")
    assert session.execute("main").fault is not None
    session.close()
    with pytest.raises(ConnectionError):
        connected(door.ports[0])
    assert no_thread_is_left()
