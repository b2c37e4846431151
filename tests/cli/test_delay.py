"""`vrs lab delay` as a process between two others."""

from __future__ import annotations

import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from threading import Thread

import pytest

from tests.live import PATIENCE
from vrs_cli.cli.main import run

LOOPBACK = "127.0.0.1"


@contextmanager
def echo() -> Iterator[int]:
    """A server that sends back what it gets; its port."""
    with socket.create_server((LOOPBACK, 0)) as server:

        def serve() -> None:
            connection, _ = server.accept()
            with connection, suppress(ConnectionError):
                while data := connection.recv(1000):
                    connection.sendall(data)

        Thread(target=serve, daemon=True).start()
        yield server.getsockname()[1]


@contextmanager
def delayed(*arguments: str) -> Iterator[tuple[subprocess.Popen[str], int]]:
    """The process, and where it listens."""
    command = (sys.executable, "-m", "vrs_cli", "lab", "delay", *arguments)
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        try:
            first = process.stdout.readline()
            assert first.startswith(f"{LOOPBACK}:"), first + process.stderr.read()  # type: ignore[union-attr]
            yield process, int(first.split()[0].split(":")[1])
        finally:
            process.kill()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_what_is_sent_comes_back_later_and_a_signal_ends_it(number: signal.Signals) -> None:
    with echo() as port, delayed("0", str(port), "--forward", "60ms", "--backward", "40ms") as (process, listens):
        with socket.create_connection((LOOPBACK, listens)) as connection:
            began = time.monotonic()
            connection.sendall(b"WHERE")
            assert connection.recv(100) == b"WHERE"
            assert time.monotonic() - began >= 0.1
            process.send_signal(number)
            out, err = process.communicate(timeout=PATIENCE)
        assert process.returncode == (0 if number is signal.SIGINT else 143)
        assert "1: 127.0.0.1:" in out
        assert "1: over, 5 bytes there, 5 back" in out
        assert err == ("" if number is signal.SIGINT else "vrs lab delay: terminated\n")


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((), "the following arguments are required: LISTEN, TARGET"),
        (("7001", "nowhere"), "TARGET: 'nowhere' is no address, as 127.0.0.1:7000 or 7000"),
        (("7001", "ws://127.0.0.1:7000"), "TARGET: 'ws://127.0.0.1:7000' is no address"),
        (("99999", "7000"), "LISTEN: '99999' is no address"),
        (("0", "7000", "--forward", "soon"), "--forward: 'soon' is no kind of delays"),
        (("192.0.2.1:0", "7000"), "192.0.2.1:0 cannot be listened at"),
    ],
)
def test_what_is_wrong_is_told(arguments: tuple[str, ...], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(("lab", "delay", *arguments)) == 2
    assert said in capsys.readouterr().err
