"""Peers that are written down: their lines, and recordings of real ones."""

from __future__ import annotations

import socket
from pathlib import Path

import pytest

from tests.devices.peers import PEER_TIMEOUT_S, Door, client, run
from tests.interfaces.programs import load
from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.devices.arrivals import Arrival, DeviceEvent
from vrs_cli.devices.script import DeviceRecording, Script, UnitLine, line_of, parse_script, read_script
from vrs_cli.devices.sockets import Sockets
from vrs_cli.engine.clock import VirtualClock
from vrs_cli.errors import FileDamaged, FileError, NonexistentFile
from vrs_cli.interfaces.session.session import Session
from vrs_cli.values.results import Message
from vrs_cli.wire.codec import Encoding, decode, encode

SERVER = (
    'ATTACH (lun, 4) "TCP"',
    'FOPEN (lun, 16) "/LOCAL_PORT 0 /CLIENTS 2"',
    "DO",
    "READ (lun, handle) joint, change",
    "status = IOSTAT(lun)",
    "TYPE /F0.6, TIME(), status",
    "IF status == 1 THEN",
    "DRIVE joint, change, 100",
    'WRITE (lun, handle) "at ", /F0.6, TIME()',
    "END",
    "UNTIL status == 101",
    "FCLOSE (lun)",
)


# --- lines ---


def test_a_line_is_of_the_device_and_handle_of_the_line_before() -> None:
    text = """
    # peers
    {"time": 1, "device": "TCP:7", "event": "opened"}
    {"data": "x"}
    {"device": "TCP:7", "handle": 2, "event": "opened"}
    {"event": "closed"}
    {"device": "SERIAL:1", "data": "y"}
    {"device": "TCP:host:80", "event": "opened"}
    """
    found = [(line.device, line.handle) for line in parse_script(text)]
    assert found == [("TCP:7", 1), ("TCP:7", 1), ("TCP:7", 2), ("TCP:7", 2), ("SERIAL:1", 0), ("TCP:host:80", 0)]


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("{", "truncated"),
        ('{"data": "x"}', "no device"),
        ('{"device": "TCP:7", "event": "come"}', "no event"),
        ('{"device": "TCP:7", "tiem": 1}', "tiem"),
        ('{"device": "TCP:7", "time": -1}', "no time"),
        ('{"device": "TCP:7", "in": 1e30}', "no time"),
        ('{"device": "TCP:7", "data": "\\u20ac"}', "beyond 255"),
        ('{"device": "TCP:7", "event": "open", "code": 3}', "the code 3"),
    ],
)
def test_a_wrong_line_is_named(line: str, told: str) -> None:
    with pytest.raises(FileDamaged) as refused:
        parse_script(f'{{"device": "TCP:7"}}\n{line}' if "no device" not in told else line, "f.jsonl")
    assert f"f.jsonl:{1 if 'no device' in told else 2}: " in str(refused.value)
    assert told in str(refused.value)


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(NonexistentFile):
        read_script(str(tmp_path / "no.jsonl"))


def test_arrivals_come_after_what_was_done_at_the_present_instant() -> None:
    text = '{"time": 1, "device": "SERIAL:1", "data": "a"}\n{"time": 1, "data": "b"}\n{"data": "c"}'
    script = Script(parse_script(text))
    clock = VirtualClock(5.0)
    assert script.due(clock) == float("inf"), "it is not open"
    script.open("SERIAL:1", None)
    due = script.due(clock)
    assert due > 5.0
    assert [arrival.data for arrival in script.take(due)] == [b"a", b"b"]
    clock.set(due)
    later = script.due(clock)
    assert later > due
    assert list(script.take(later)) == [Arrival("SERIAL:1", DeviceEvent.CAME, 0, b"c")]


def test_a_recorded_line_is_read_as_it_was() -> None:
    arrival = Arrival("TCP:7", DeviceEvent.CAME, 2, bytes(range(256)))
    line = line_of(arrival, 0.123456789)
    assert decode(encode(line, Encoding.JSON), UnitLine) == line


# --- recordings ---


def dialogue(line: socket.socket) -> None:
    """One line of three has no end; all that the program answers."""
    answers = line.makefile("rb")
    for said in (b"1 20\n", b"2 -15", b"1 -5\n"):
        line.sendall(said)
        assert answers.readline().startswith(b"at ")
    answers.close()


def test_a_recording_gives_the_same_again(tmp_path: Path) -> None:
    file = str(tmp_path / "units.jsonl")
    door = Door(client(dialogue))
    live, first = run(door, *SERVER, outside=DeviceRecording(Sockets(patience=PEER_TIMEOUT_S * 50), file), rate=50.0)
    assert first.fault is None
    again = []
    for _ in range(2):
        session = Session(terminal := RecordingTerminal(), outside=read_script(file))
        load(session, *SERVER)
        result = session.execute("main")
        assert terminal.replies == []
        assert result.typed == first.typed
        again.append(session)
    assert again[0].engine.timeline == again[1].engine.timeline == live.engine.timeline


def test_a_program_that_writes_something_else_is_told_of_once(tmp_path: Path) -> None:
    file = str(tmp_path / "units.jsonl")
    run(
        Door(client(dialogue)), *SERVER, outside=DeviceRecording(Sockets(patience=PEER_TIMEOUT_S * 50), file), rate=50.0
    )
    session = Session(terminal := RecordingTerminal(), outside=read_script(file))
    load(session, *(line.replace('"at ', '"since ') for line in SERVER))
    session.execute("main")
    told = [reply.text for reply in terminal.replies if isinstance(reply, Message)]
    assert len(told) == 1
    assert "TCP:0: the program writes 'since " in told[0]


def test_a_recording_that_cannot_be_written(tmp_path: Path) -> None:
    with pytest.raises(FileError):
        DeviceRecording(Sockets(), str(tmp_path / "no" / "units.jsonl"))


def test_two_ports_that_the_system_chooses_are_two() -> None:
    script = ['{"device": "TCP:0", "event": "opened"}', '{"data": "a\\n"}', '{"device": "TCP:0#2", "event": "opened"}']
    session = Session(RecordingTerminal(), outside=Script(parse_script("\n".join([*script, '{"data": "b\\n"}']))))
    opens = [line for k in (0, 1) for line in (f'ATTACH (l[{k}], 4) "TCP"', f'FOPEN (l[{k}], 16) "/LOCAL_PORT 0"')]
    load(session, *opens, "READ (l[0]) $a", "READ (l[1]) $b", "TYPE $a, $b")
    assert session.execute("main").typed == ("ab",)
