"""What has arrived on a device, line by line, whatever pieces it came in."""

from __future__ import annotations

import random

import pytest

from vrs_cli.devices.arrivals import MAX_LINE_BYTES, Address, Arrival, DeviceEvent, read_address
from vrs_cli.devices.device import CONFIRM_BYTES, FULL, Device
from vrs_cli.devices.outside import YET, Outside, Waits
from vrs_cli.errors import DeviceNotReady, FileNotOpened, FileOpened, IllegalValue, NetworkClosed, NoDataReceived
from vrs_cli.language.run.effects import CLOSED, OPENED, SUCCESS

NAME = "TCP:7"


class Stand(Outside):
    """Hears what a device asks for, and has all there is."""

    def __init__(self) -> None:
        super().__init__()
        self.asked: list[tuple[object, ...]] = []

    def check(self, device: str) -> None: ...
    def open(self, device: str, address: Address | None) -> None: ...
    def send(self, device: str, handle: int, data: bytes, *, ask: bool = False) -> None:
        self.asked.append(("ask", device, handle) if ask else ("send", device, handle, data))

    def confirm_read(self, device: str, handle: int, count: int) -> None:
        self.asked.append(("confirm_read", device, handle, count))

    def release(self, device: str, handle: int) -> None:
        self.asked.append(("release", device, handle))

    def close(self, device: str) -> None:
        self.asked.append(("close", device))


@pytest.fixture
def stand() -> Stand:
    return Stand()


@pytest.fixture
def device(stand: Stand) -> Device:
    one = Device("TCP", "TCP", stand)
    one.begin()
    one.open_at("/LOCAL_PORT 7 /CLIENTS 3 /BUFFER_SIZE 16")
    assert one.dial_result() is None
    return one


def come(device: Device, handle: int, *pieces: bytes) -> None:
    for piece in pieces:
        device.arrive(Arrival(NAME, DeviceEvent.CAME, handle, piece))


def arrive(device: Device, event: DeviceEvent, handle: int = 1) -> None:
    device.arrive(Arrival(NAME, event, handle))


def lines(device: Device) -> list[str]:
    read = list[str]()
    while isinstance(line := device.read(notices=False, wait=True), str):
        read.append(line)
    return read


@pytest.mark.parametrize("seed", range(20))
def test_the_pieces_do_not_matter(device: Device, seed: int) -> None:
    rng = random.Random(seed)
    texts = ["".join(rng.choices("ab\0\xff", k=rng.randrange(17))) for _ in range(rng.randrange(12))]
    ends = [rng.choice(["\n", "\r\n"] if following == "" else ["\n", "\r\n", "\r"]) for following in [*texts[1:], ""]]
    said = "".join(text + end for text, end in zip(texts, ends, strict=False)).encode("latin-1")
    cuts = sorted(rng.randrange(len(said) + 1) for _ in range(rng.randrange(9)))
    arrive(device, DeviceEvent.OPENED)
    read = list[str]()
    for piece in [said[a:b] for a, b in zip([0, *cuts], [*cuts, len(said)], strict=True)]:
        come(device, 1, piece)
        read += lines(device) if rng.random() < 0.5 else []
    assert read + lines(device) == texts


def test_a_line_that_is_longer_than_the_longest_comes_in_several(device: Device) -> None:
    arrive(device, DeviceEvent.OPENED)
    come(device, 1, b"0123456789abcdef\n", b"0123456789abcdefX", b"Y\n")
    assert lines(device) == ["0123456789abcdef", "0123456789abcdef", "XY"]


def test_a_line_without_an_end_comes_when_its_peer_has_closed(device: Device) -> None:
    arrive(device, DeviceEvent.OPENED)
    come(device, 1, b"half")
    assert device.read(notices=True, wait=True) is None
    assert device.status == OPENED
    assert device.read(notices=True, wait=True) is YET
    arrive(device, DeviceEvent.ENDED)
    assert device.read(notices=True, wait=True) == "half"
    assert device.read(notices=True, wait=True) is None
    assert (device.status, device.handle) == (CLOSED, 1)


def test_a_packet_without_an_end_of_line_comes_when_its_peer_pauses(device: Device) -> None:
    arrive(device, DeviceEvent.OPENED)
    come(device, 1, b"\0\0\0\1")
    assert lines(device) == []
    arrive(device, DeviceEvent.PAUSED)
    assert lines(device) == ["\0\0\0\1"]
    come(device, 1, b"\0\0", b"\0\2")
    assert lines(device) == [], "the next one goes on"


def test_connections_have_their_turns(device: Device) -> None:
    for handle in (1, 2, 3):
        arrive(device, DeviceEvent.OPENED, handle)
    come(device, 1, b"a\nb\nc\n")
    come(device, 3, b"d\n")
    come(device, 2, b"e\n")
    assert lines(device) == ["a", "e", "d", "b", "c"]


def test_a_handle_is_free_for_another_once_its_end_was_told(device: Device, stand: Stand) -> None:
    arrive(device, DeviceEvent.OPENED)
    arrive(device, DeviceEvent.ENDED)
    assert ("release", NAME, 1) not in stand.asked
    device.read(notices=False, wait=True)
    assert device.status == NetworkClosed.code
    assert stand.asked == [("release", NAME, 1)]


def test_a_peer_that_has_said_all_hears_the_answers(device: Device, stand: Stand) -> None:
    arrive(device, DeviceEvent.OPENED)
    come(device, 1, b"question\n")
    arrive(device, DeviceEvent.ENDED)
    assert lines(device)[0] == "question"
    arrive(device, DeviceEvent.OPENED)
    come(device, 1, b"again\n")
    arrive(device, DeviceEvent.ENDED)
    assert device.read(notices=False, wait=True) == "again"
    assert device.write("answer", newline=True, handle=None, wait=True) is None
    assert stand.asked[-1] == ("send", NAME, 1, b"answer\r\n")


def test_who_is_gone_is_told_when_something_is_written(device: Device, stand: Stand) -> None:
    arrive(device, DeviceEvent.OPENED)
    arrive(device, DeviceEvent.GONE)
    with pytest.raises(NetworkClosed):
        device.write("x", newline=True, handle=1, wait=True)
    with pytest.raises(NetworkClosed):
        device.write("x", newline=True, handle=1, wait=True)
    assert stand.asked == [("release", NAME, 1)]


def test_nothing_has_come(device: Device) -> None:
    assert device.read(notices=True, wait=True) is YET
    assert device.write("x", newline=True, handle=None, wait=True) is YET
    with pytest.raises(NoDataReceived):
        device.read(notices=True, wait=False)
    with pytest.raises(NetworkClosed):
        device.write("x", newline=True, handle=None, wait=False)
    assert isinstance(device.character(wait=True), Waits)


def test_what_was_read_makes_room_now_and_then(device: Device, stand: Stand) -> None:
    arrive(device, DeviceEvent.OPENED)
    come(device, 1, b"123456789012345\n" * (CONFIRM_BYTES // 16))
    lines(device)
    assert stand.asked == [("confirm_read", NAME, 1, CONFIRM_BYTES)]


def test_a_program_that_writes_more_than_its_peer_takes_waits(device: Device, stand: Stand) -> None:
    arrive(device, DeviceEvent.OPENED)
    text, count = "x" * 998, 0
    while device.write(text, newline=True, handle=1, wait=True) is None:
        count += 1
    assert count == FULL // 1000 + 1
    assert device.write(text, newline=True, handle=1, wait=True) is YET
    assert stand.asked.count(("ask", NAME, 1)) == 1
    arrive(device, DeviceEvent.WRITTEN)
    assert device.write(text, newline=True, handle=1, wait=True) is None


def test_a_character_that_is_put_back_is_read_again(device: Device) -> None:
    arrive(device, DeviceEvent.OPENED)
    come(device, 1, b"abc")
    assert [device.character(wait=True), device.character(wait=True)] == [97, 98]
    device.put_back([97, 98])
    assert device.character(wait=True) == 97


def test_opening_and_closing(device: Device, stand: Stand) -> None:
    with pytest.raises(FileOpened):
        device.open_at("/LOCAL_PORT 8")
    device.close()
    device.close()
    assert stand.asked == [("close", NAME)]
    with pytest.raises(FileNotOpened):
        device.read(notices=False, wait=False)


def test_a_connection_that_is_asked_for(stand: Stand) -> None:
    device = Device("TCP", "TCP", stand)
    device.open_at("h /REMOTE_PORT 7")
    assert device.dial_result() is YET
    device.arrive(Arrival("TCP:h:7", DeviceEvent.REFUSED, code=NetworkClosed.code))
    assert device.dial_result() is None
    assert (device.status, device.open) == (NetworkClosed.code, False)
    device.open_at("h /REMOTE_PORT 7")
    device.arrive(Arrival("TCP:h:7", DeviceEvent.OPENED))
    assert device.dial_result() is None
    assert device.status == SUCCESS


def test_a_device_that_is_not_to_be_had_says_so_of_all() -> None:
    device = Device("TCP", "TCP", Outside(), DeviceNotReady("TCP"))
    for _ in range(2):
        with pytest.raises(DeviceNotReady):
            device.open_at("/LOCAL_PORT 7")
        with pytest.raises(DeviceNotReady):
            device.read(notices=False, wait=False)


@pytest.mark.parametrize(
    ("how", "address"),
    [
        ("/LOCAL_PORT 11000", Address("", 11000)),
        ("/LOCAL_PORT11000 /CLIENTS 1 /BUFFER_SIZE 512", Address("", 11000, 1, 512)),  # as $ENCODE may write it
        ("/local_port = 0 /clients=5", Address("", 0, 5)),
        ("127.0.0.1 /REMOTE_PORT 3000", Address("127.0.0.1", 3000)),
        ("/REMOTE_PORT 3000 cell-7.example", Address("cell-7.example", 3000, 1, MAX_LINE_BYTES)),
        ("::1 /REMOTE_PORT 3000", Address("::1", 3000)),
    ],
)
def test_an_address(how: str, address: Address) -> None:
    assert read_address(how) == address


@pytest.mark.parametrize(
    "how",
    ["", "11000", "/LOCAL_PORT", "/LOCAL_PORT 65536", "/LOCAL_PORT 99999999999999999999", "/PORT 5", "/CLIENTS 1",
     "/LOCAL_PORT 1 /CLIENTS 0", "/LOCAL_PORT 1 /CLIENTS 65", "/LOCAL_PORT 1 /BUFFER_SIZE 40000", "/REMOTE_PORT 3000",
     "a b /REMOTE_PORT 1", "a /REMOTE_PORT 0", "a /LOCAL_PORT 5"],
)  # fmt: skip
def test_no_address(how: str) -> None:
    with pytest.raises(IllegalValue):
        read_address(how)


def test_the_name_in_a_recording() -> None:
    assert [read_address(how).name for how in ("/LOCAL_PORT 7", "h /REMOTE_PORT 8")] == ["TCP:7", "TCP:h:8"]
