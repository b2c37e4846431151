"""The text of FOPEN for TCP."""

from __future__ import annotations

import pytest

from vrs_cli.devices.device import MAX_LINE_BYTES, Address, read_address
from vrs_cli.errors import IllegalValue


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
