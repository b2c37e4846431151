"""`vrs run` and the shell with units of the world outside: who may have them, and what is said where nobody may."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from math import inf
from pathlib import Path

import pytest

from tests.cli.conftest import Vrs
from tests.live import PATIENCE
from vrs_cli.cli.command_line import Parser, chosen_outside
from vrs_cli.cli.main import OK, USAGE
from vrs_cli.errors import DeviceNotReady, NetworkTimeout

SERVER = """\
.PROGRAM server()
    ATTACH (lun, 4) "TCP"
    FOPEN (lun, 16) "/LOCAL_PORT 0"
    TYPE IOSTAT(lun), /S
    READ (lun, handle) $line
    TYPE IOSTAT(lun)
.END
"""
PEER = '{"device": "TCP:0", "event": "opened"}\n'


@pytest.fixture
def server(tmp_path: Path) -> str:
    path = tmp_path / "server.v2"
    path.write_text(SERVER)
    return str(path)


def test_programs_have_no_network_unless_it_is_allowed(vrs: Vrs, server: str) -> None:
    run = vrs("run", server)
    assert run.status == OK
    assert f"{DeviceNotReady.code}{DeviceNotReady.code}\n" in run.out
    assert run.out.count("--allow-net") == 1


def test_a_port_is_told_and_waited_at_for_so_long(vrs: Vrs, server: str) -> None:
    run = vrs("run", server, "--allow-net", "--patience", "0.05")
    assert run.status == OK
    assert "TCP port " in run.out
    assert f" 1{NetworkTimeout.code}\n" in run.out


def test_a_script_stands_for_peers(vrs: Vrs, server: str, tmp_path: Path) -> None:
    (tmp_path / "peers.jsonl").write_text(PEER)
    first, second = (vrs("run", server, "--replay-units", str(tmp_path / "peers.jsonl"), "--json") for _ in range(2))
    assert json.loads(first.out)["typed"] == [" 1 100"]
    assert first.out == second.out


def test_what_units_are_given_is_recorded(vrs: Vrs, server: str, tmp_path: Path) -> None:
    (tmp_path / "peers.jsonl").write_text(PEER)
    again = str(tmp_path / "again.jsonl")
    run = vrs("run", server, "--replay-units", str(tmp_path / "peers.jsonl"), "--record-units", again)
    assert run.status == OK
    assert vrs("run", server, "--replay-units", again).out == run.out


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (["--allow-net", "--sandbox", "box"], "--sandbox has no connections"),
        (["--serial", "1=pty", "--sandbox", "box"], "--sandbox has no connections"),
        (["--allow-net", "--replay-units", "f"], "--replay-units stands for others"),
        (["--net-host", "0.0.0.0"], "give --allow-net too"),
        (["--allow-net", "--net-host", "cell"], "an address as"),
        (["--serial", "pty"], "1=pty"),
        (["--record-units", "f"], "nothing to record"),
        (["--replay-units", "nothing.jsonl"], "cannot be read"),
        (["--allow-net", "--patience", "0"], "not above 0"),
    ],
)
def test_what_does_not_go_together(vrs: Vrs, server: str, options: list[str], told: str) -> None:
    run = vrs("run", server, *options)
    assert run.status == USAGE
    assert told in run.err
    assert len(run.err.splitlines()) == 1


def test_a_sandbox_has_peers_that_are_written_down(vrs: Vrs, server: str, tmp_path: Path) -> None:
    (tmp_path / "peers.jsonl").write_text(PEER)
    run = vrs("run", server, "--sandbox", str(tmp_path / "box"), "--replay-units", str(tmp_path / "peers.jsonl"))
    assert " 1 100\n" in run.out


def test_a_driver_serves_until_it_is_stopped(server: str) -> None:
    command = [sys.executable, "-m", "vrs_cli", "run", server, "--allow-net"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        told = process.stdout.readline()
        assert "TCP port" in told, told
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=PATIENCE)
    assert process.returncode != OK
    assert "Traceback" not in err


@pytest.mark.parametrize(
    ("words", "patience"),
    [(["--allow-net"], inf), (["--allow-net", "--patience", "5"], 5.0), (["--serial", "1=pty"], inf)],
)
def test_how_long_units_wait(words: list[str], patience: float) -> None:
    assert chosen_outside(Parser("run", "vrs run").parse(["a.v2", *words])).patience == patience
