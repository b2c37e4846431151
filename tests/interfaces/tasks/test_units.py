"""Programs and the devices that they attach, with peers that are written down, in virtual time."""

from __future__ import annotations

import pytest

from tests.interfaces.programs import load, value
from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.devices.outside import Outside
from vrs_cli.devices.script import Script, parse_script
from vrs_cli.devices.sockets import Sockets
from vrs_cli.errors import (
    DeviceNotReady,
    EndlessWait,
    FileError,
    IllegalValue,
    InvalidNumber,
    LimitReached,
    NetworkClosed,
    NetworkTimeout,
    NoDataReceived,
    PortTaken,
    UnitAttached,
    UsageError,
)
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.tasks.driver import Driver
from vrs_cli.interfaces.tasks.limits import Limits
from vrs_cli.values.results import Message

OPEN = ('ATTACH (lun, 4) "TCP"', 'FOPEN (lun, 16) "/LOCAL_PORT 7 /CLIENTS 2"')
SERIAL = ('ATTACH (lun, 4) "SERIAL:1"',)
READ = ('$line = ""', "READ (lun, handle) $line", "status = IOSTAT(lun)", 'TYPE /I0, status, " ", handle, " ", $line')
STATUS = ("TYPE /I0, IOSTAT(lun)",)
COMES = '{"time": 0.5, "device": "TCP:7", "event": "opened"}'


def session_with(*script: str, patience: float = 10.0, limits: Limits | None = None) -> Session:
    outside = Script(parse_script("\n".join(script)), patience)
    return Session(RecordingTerminal(), outside=outside, limits=limits or Limits())


def typed(session: Session, *lines: str) -> tuple[str, ...]:
    load(session, *lines)
    result = session.execute("main")
    assert result.fault is None, result.fault
    return result.typed


def test_what_a_peer_says_is_read_when_it_has_come() -> None:
    session = session_with(COMES, '{"time": 1.25, "data": "hello\\r\\nthere\\n"}', '{"in": 0.25, "event": "closed"}')
    times = ("t1 = TIME()", *READ, "t2 = TIME()", *READ, *READ, *READ, "t3 = TIME()")
    assert typed(session, *OPEN, *times) == ("100 1 ", "1 1 hello", "1 1 there", "101 1 ")
    assert [value(session, f"t{k}") for k in (1, 2, 3)] == pytest.approx([0.0, 0.5, 1.5])


def test_other_tasks_go_on_while_one_waits() -> None:
    session = session_with(COMES.replace("0.5", "0.45"))
    load(session, "DO", "WAIT.EVENT , 0.1", "ticks = ticks+1", "UNTIL FALSE", name="beside")
    typed(session, "ticks = 0", "EXECUTE 2 beside()", *OPEN, *READ, "seen = ticks")
    assert value(session, "seen") == 4.0


def test_a_motion_goes_on_while_its_program_waits() -> None:
    session = session_with(COMES)
    typed(session, *OPEN, "DRIVE 1, 20, 100", *READ, "DRIVE 1, 20, 100")
    first, second = session.engine.book.records()
    assert first.executed == 0.0
    assert second.issued == pytest.approx(0.5)


@pytest.mark.parametrize("line", ["READ (lun, h) $s", "char = GETC(lun)"])
@pytest.mark.parametrize("comes", [True, False])
def test_a_reaction_comes_while_its_program_waits_for_a_peer(line: str, comes: bool) -> None:
    """It is served at once, each time; what was waited for is waited for again, and no longer than without it."""
    session = session_with(COMES.replace("0.5", "0.1"), *['{"time": 0.6, "data": "a\\n"}'] * comes, patience=0.7)
    load(session, "WAIT.EVENT , 0.2", "SIGNAL 2001", "WAIT.EVENT , 0.1", "SIGNAL -2001, 2001", name="beside")
    load(session, "TYPE TIME()", "REACT 2001, hit", name="hit")
    opened = ("REACT 2001, hit", "EXECUTE 2 beside", *OPEN, "READ (lun, h) $s")
    shown = typed(session, *opened, line, "TYPE TIME(), IOSTAT(lun)")
    ends = " 0.6 1" if comes else f" 0.8{NetworkTimeout.code}"
    assert shown == (" 0.2", " 0.3", ends)


def test_numbers_of_a_line() -> None:
    session = session_with(COMES, '{"data": "1, 2.5 -3e1 rest of it\\n4 five\\n"}')
    first = ("READ (lun, h) x", "READ (lun, h) x, y, z, $s", 'TYPE x, y, z, " ", $s')
    second = ("READ (lun, h) x, y", "TYPE x, IOSTAT(lun)")
    assert typed(session, *OPEN, *first, *second) == (" 1 2.5-30 rest of it", f" 1{InvalidNumber.code}")


def test_who_does_not_wait_goes_on_without() -> None:
    session = session_with(COMES, '{"data": "a\\n"}')
    poll = ("DO", "WAIT", "READ (lun, handle, 1) $line", "status = IOSTAT(lun)", "count = count+1", "UNTIL status == 1")
    first = ("READ (lun, handle, 1) $line", *STATUS, "TYPE /I0, GETC(lun, 1)")
    assert typed(session, "count = 0", *OPEN, *first, *poll) == (str(NoDataReceived.code), str(NoDataReceived.code))
    assert value(session, "count") == 19.0  # the first tick after 0.5 s tells the connection, the next one the line


def test_a_task_that_polls_without_a_pause_leaves_time_to_others(monkeypatch: pytest.MonkeyPatch) -> None:
    turns = count_turns(monkeypatch)
    session = session_with(COMES, '{"data": "go\\n"}')
    load(session, "WHILE run DO", "WAIT.EVENT , 0.1", "sent = sent+1", "END", name="feedback")
    load(
        session,
        "WHILE run DO",
        *("WAIT 2", "IF TASK(1, 3) <> 4 THEN", "EXECUTE 3 feedback()", "END"),
        "END",
        name="restart",
    )
    poll = ("DO", "READ (lun, handle, 1) $line", "UNTIL IOSTAT(lun) == 1", "t = TIME()", "run = FALSE")
    assert typed(session, "run = TRUE", "sent = 0", "EXECUTE 2 restart()", *OPEN, *poll, "TYPE $line") == ("go",)
    assert value(session, "t") == pytest.approx(0.5, abs=0.03)
    assert value(session, "sent") == 5.0
    assert sum(turns) < 19 * 110


def count_turns(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Return a list that gets a 1 for each thing that a driver lets happen."""
    turns, happen = list[int](), Driver._happen

    def counted(driver: Driver, budget: int) -> None:
        turns.append(1)
        happen(driver, budget)

    monkeypatch.setattr(Driver, "_happen", counted)
    return turns


def test_a_script_answers_what_the_program_writes() -> None:
    session = session_with(
        '{"time": 0, "device": "TCP:7", "event": "opened"}',
        '{"after": "name?\\r\\n", "in": 0.1, "data": "ada\\n"}',
        '{"after": "bye", "event": "closed"}',
    )
    dialogue = (
        "READ (lun, h) $line",
        'WRITE (lun, h) "name?"',
        *READ,
        'WRITE (lun, h) "good", /S',
        'WRITE (lun, h) "bye"',
    )
    assert typed(session, *OPEN, *dialogue, *READ) == ("1 1 ada", "101 1 ")


def test_a_line_that_is_waited_for_in_vain() -> None:
    session = session_with(COMES, patience=2.0)
    waits = (*READ, *READ, "t = TIME()", "x = GETC(lun)", "TYPE /I0, x", "t2 = TIME()")
    assert typed(session, *OPEN, *waits) == ("100 1 ", f"{NetworkTimeout.code} 1 ", str(NetworkTimeout.code))
    assert [value(session, "t"), value(session, "t2")] == pytest.approx([2.5, 4.5])


def test_a_program_that_waits_for_ever_is_stopped_by_the_limit_of_its_time() -> None:
    session = session_with(COMES, patience=float("inf"), limits=Limits(max_time=100.0))
    load(session, *OPEN, *READ, *READ)
    fault = session.execute("main").fault
    assert fault is not None
    assert fault.code in (LimitReached.code, EndlessWait.code)
    assert "READ (lun, handle) $line" in fault.message


def test_a_step_with_characters_that_have_not_all_come_is_done_again() -> None:
    session = session_with(COMES, '{"data": "a"}', '{"in": 1, "data": "b"}', '{"in": 1, "data": "c"}')
    typed(session, *OPEN, "x = GETC(lun)*10000+GETC(lun)*100+GETC(lun)", "t = TIME()")
    assert value(session, "x") == 97 * 10000 + 98 * 100 + 99
    assert value(session, "t") == pytest.approx(2.5)


def test_a_serial_line_is_open_when_it_is_attached() -> None:
    session = session_with('{"time": 0.1, "device": "SERIAL:1", "data": "7 8\\r"}')
    assert typed(session, *SERIAL, "READ (lun) x, y", 'WRITE (lun) "K"', *STATUS) == ("1",)
    assert [value(session, "x"), value(session, "y")] == [7.0, 8.0]


def test_a_serial_line_is_closed_by_detach_and_can_be_attached_again() -> None:
    session = session_with('{"time": 0.1, "device": "SERIAL:1", "data": "1\\n2\\n"}')
    lines = ("READ (lun) x", "FCLOSE (lun)", *STATUS, "READ (lun) y", *STATUS, "DETACH (lun)", *SERIAL, *STATUS)
    assert typed(session, *SERIAL, *lines) == (str(FileError.code), "1", "1")


def test_a_device_that_was_missing_is_missing_when_it_is_attached_again() -> None:
    session = Session(RecordingTerminal())
    attach = ('ATTACH (9) "TCP"', "TYPE /I0, IOSTAT(9)")
    assert typed(session, *attach, *attach) == (str(DeviceNotReady.code),) * 2


def test_one_task_has_a_serial_line() -> None:
    session = session_with('{"time": 0.1, "device": "SERIAL:1", "data": "x"}')
    load(session, *SERIAL, "WAIT.EVENT", name="other")
    session.start(1, "other")
    assert typed(session, *SERIAL, *STATUS, 'WRITE (lun) "?"', *STATUS) == (str(UnitAttached.code),) * 2


@pytest.mark.parametrize("device", ["TCP", "SERIAL:1", "VISION", "SERIAL:", "tape"])
def test_a_device_that_is_not_to_be_had_is_a_status_and_the_program_goes_on(device: str) -> None:
    terminal = RecordingTerminal()
    session = Session(terminal, outside=Outside("a hint"))
    operations = ('FOPEN (lun, 16) "/LOCAL_PORT 7"', "READ (lun, handle) $line", 'WRITE (lun) "x"', "FCLOSE (lun)")
    lines = [line for operation in operations for line in (operation, *STATUS)]
    code = str(DeviceNotReady.code)
    attach = (f'ATTACH (lun, 4) "{device}"', *STATUS)
    assert typed(session, *attach, *lines, "TYPE /I0, GETC(lun)", "DETACH (lun)", *attach) == (code,) * 7
    told = [reply.text for reply in terminal.replies if isinstance(reply, Message)]
    assert len([text for text in told if device.upper() in text]) == 1, "once"


def test_the_text_of_the_codes() -> None:
    session = session_with(COMES)
    assert typed(session, "TYPE $ERROR(-508)", "TYPE $ERROR(-562)", "TYPE $ERROR(100)", "TYPE $ERROR(-526)") == (
        "Device not ready",
        "Network connection closed",
        "Network connection opened",
        "No data received",
    )


def test_a_port_that_was_in_use_is_so_again() -> None:
    session = session_with(f'{{"device": "TCP:7", "event": "open", "code": {PortTaken.code}}}', COMES)
    assert typed(session, *OPEN, *STATUS, OPEN[1], *STATUS) == (str(PortTaken.code), "1")


@pytest.mark.parametrize(
    ("line", "status"),
    [
        ("FCMND (lun, 600) $INTB(1)", 1),
        ("FCMND (lun, 600) $INTB(99)", 1),
        ("FCMND (lun, 600) $INTB(1), $said", 1),
        ("FCMND (lun, 600)", FileError.code),
        ("FCMND (lun, 4711) $INTB(1)", FileError.code),
        ('WRITE (lun, 99) "x"', NetworkClosed.code),
        ('WRITE (lun) "x", /N', NetworkClosed.code),
        ("FCLOSE (lun)", 1),
        ('FOPENR (lun) "x"', -516),
        (OPEN[1], -506),
    ],
)
def test_what_is_asked_of_a_port(line: str, status: int) -> None:
    session = session_with(COMES)
    load(session, *OPEN, line, *STATUS)
    result = session.execute("main")
    assert (result.fault.code if result.fault else int(result.typed[-1])) in (status, IllegalValue.code)


def test_a_disk_has_no_ports() -> None:
    session = session_with(COMES)
    assert typed(session, "ATTACH (5)", OPEN[1].replace("lun", "5"), "TYPE /I0, IOSTAT(5)") == (str(FileError.code),)


def test_mode_4_wants_a_free_unit_of_those_of_other_devices() -> None:
    session = session_with(COMES)
    attach = [f'ATTACH (lun[{k}], 4) "TCP"' for k in range(8)]
    assert typed(session, *attach, "TYPE /I0, lun[0], lun[7]") == ("916",)
    load(session, *attach, attach[0])
    fault = session.execute("main").fault
    assert fault is not None
    assert fault.code == -516


def test_a_program_with_its_port_open_pauses_and_goes_on() -> None:
    session = session_with(COMES, '{"in": 1, "data": "late\\n"}')
    load(session, *OPEN, *READ, "PAUSE", *READ)
    session.execute("main")
    result = session.converse(session.wait(session.resume()))
    assert result.typed == ("1 1 late",)


def test_a_port_of_an_ended_program_is_closed() -> None:
    session = session_with(COMES)
    for _ in range(2):
        assert typed(session, *OPEN, *STATUS, *READ)[0] == "1"
    load(session, "READ (9) $line")
    fault = session.execute("main").fault
    assert fault is not None
    assert fault.code == -516


def test_units_of_the_prompt_stay_open_from_line_to_line() -> None:
    session = session_with(COMES, '{"data": "x\\n"}')
    for line in (*OPEN, "READ (lun, handle) $line", "READ (lun, handle) $line"):
        session.perform(line)
    assert value(session, "$line") == "x"


def test_what_is_real_wants_a_clock_of_real_time() -> None:
    with pytest.raises(UsageError):
        Session(RecordingTerminal(), outside=Sockets())
