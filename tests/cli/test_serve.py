"""`vrs serve` as a command: what its command line refuses, and a server that begins and ends well."""

from __future__ import annotations

import json
import re
import shutil
import signal
import ssl
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest
from websockets.exceptions import InvalidHandshake

import vrs_cli as vrs
from tests.live import PATIENCE
from tests.net.serving import Caller
from vrs_cli.cli.main import run
from vrs_cli.errors import RequestRefused
from vrs_cli.net import http
from vrs_cli.net.messages import Closing, Hello, Sample, Subscribe
from vrs_cli.net.tokens import add_tokens

WRONG = (
    (["--host", "0.0.0.0"], "without --tokens"),
    (["--host", "0.0.0.0", "--tokens", "t.toml"], "without TLS"),
    (["--robot", "a=puma560", "--robot", "a=cobra600"], "there twice"),
    (["--robot", "a=puma560", "--robot", "b=cobra600", "--tip", "hand"], "choose of one robot"),
    (["--task", "pose"], "choose of one robot"),
    (["--robot", "a b=puma560"], "no name for a robot"),
    (["--cell", "x=none.toml"], "there is no such robot"),
    (["--cell", "puma560=none.toml"], "none.toml"),
    (["--cell", "a.toml", "--cell", "b.toml"], "twice for all robots"),
    (["--cell", "puma560=a.toml", "--cell", "puma560=b.toml"], "twice for robot puma560"),
    (["--robot", "a=puma561"], "no robot is called"),
    (["--robots-per-token", "1"], "without --tokens"),
    (["--tls-key", "key.pem"], "without --tls-cert"),
    (["--tls-cert", "none.pem"], "none.pem"),
    (["--port", "70000"], "no port"),
    (["--tokens", "none.toml"], "none.toml"),
    (["--causality", "NEVER"], "NEVER"),
    (["--journal", "file"], "file"),
    (["--folder", "file"], "file"),
    (["--pages"], "hatch_build.py"),
)


@pytest.mark.parametrize(("arguments", "said"), WRONG, ids=[" ".join(row[0]) for row in WRONG])
def test_a_wrong_command_line_is_one_message(
    arguments: list[str], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(http, "BUILT_PAGE", tmp_path / "built")
    Path("file").write_text("")
    Path("t.toml").write_text("")
    assert run(["serve", "--port", "0", *arguments]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1


def test_own_robots_that_are_not_one_s_own(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    tokens = tmp_path / "ada.toml"
    add_tokens(tokens, ["ada"])
    arguments = ("--tokens", str(tokens), "--robots-per-token", "2", "--robot", "ada-2=puma560")
    assert run(["serve", "--port", "0", *arguments]) == 1
    assert "ada would have ada-2 for itself, which is the robot of all" in capsys.readouterr().err


@contextmanager
def server(*arguments: str) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """A process, and its address."""
    command = [sys.executable, "-m", "vrs_cli", "serve", "--port", "0", *arguments]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stdout is not None
    try:
        yield process, process.stdout.readline()
    finally:
        process.kill()
        process.communicate()


def address(line: str) -> str:
    return line.split()[2].rstrip(",")


def test_it_says_when_it_is_ready_and_ends_well(tmp_path: Path) -> None:
    arguments = ("--robot", "cell1=puma560", "--robot", "cobra600", "--journal", str(tmp_path))
    with server(*arguments) as (process, line):
        assert line.startswith("vrs serve: ws://127.0.0.1:")
        assert line.endswith(", robots cell1, cobra600\n")
        caller = Caller(f"{address(line)}/robots/cobra600", Hello((1,)))
        assert caller.line("DRIVE 1, 10, 50").ok
        process.send_signal(signal.SIGTERM)
        assert isinstance(caller.until(lambda one: isinstance(one, Closing)), Closing)
        assert process.wait(PATIENCE) == 0
        assert process.stderr is not None
        assert process.stderr.read() == "vrs serve: ended\n"
    rows = [json.loads(row) for row in (tmp_path / "audit.jsonl").read_text().splitlines()]
    assert [row["what"] for row in rows] == ["(enter)", "DRIVE 1, 10, 50", "(leave)"]
    assert not list(tmp_path.glob(".*")), "no lock is left"


def test_a_cell_is_around_each_robot(tmp_path: Path) -> None:
    cell = tmp_path / "cell.toml"
    cell.write_text('[[part]]\nname = "box"\nshape = "box"\nsize = [40, 40, 60]\nat = [0, 550, -250]\n')
    with server("--cell", str(cell)) as (_process, line), vrs.connect(address(line)) as robot:
        assert list(robot.parts) == ["box"]


def test_a_robot_that_is_named_has_a_cell_of_its_own(tmp_path: Path) -> None:
    for name in ("box", "ring"):
        text = f'[[part]]\nname = "{name}"\nshape = "box"\nsize = [40, 40, 60]\nat = [0, 550, -250]\n'
        (tmp_path / f"{name}.toml").write_text(text)
    robots = ("--robot", "a=puma560", "--robot", "b=puma560", "--robot", "c=puma560")
    cells = ("--cell", str(tmp_path / "box.toml"), "--cell", f"b={tmp_path / 'ring.toml'}")
    with server(*robots, *cells) as (_process, line):
        for name, part in (("a", "box"), ("b", "ring"), ("c", "box")):
            with vrs.connect(f"{address(line)}/robots/{name}") as robot:
                assert list(robot.parts) == [part]


def test_a_second_one_on_the_same_journal_is_refused(tmp_path: Path) -> None:
    with server("--journal", str(tmp_path)), server("--journal", str(tmp_path)) as (second, line):
        assert line == ""
        assert second.wait(PATIENCE) == 2
        assert second.stderr is not None
        assert "is being written by another vrs" in second.stderr.read()


@contextmanager
def on_small_disk(folder: Path, options: str = "") -> Iterator[tuple[subprocess.Popen[str], str, Path]]:
    """A server whose journal has a file system of its own; and where that is to be seen from here."""
    journal = folder / "journal"
    journal.mkdir()
    mount = f"mount -t tmpfs -o size=400k{options} tmpfs {journal}"
    if subprocess.run(["unshare", "-m", "sh", "-c", mount], capture_output=True, check=False).returncode:
        pytest.skip("file systems may not be mounted here")
    serve = f"{sys.executable} -m vrs_cli serve --port 0 --journal {journal} --folder {folder / 'files'}"
    command = ["unshare", "-m", "sh", "-c", f"{mount} && exec {serve}"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stdout is not None
    try:
        yield process, process.stdout.readline(), Path(f"/proc/{process.pid}/root{journal}")
    finally:
        process.kill()
        process.communicate()


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="file systems of one process are Linux' own")
def test_a_disk_that_is_full_keeps_what_was_answered(tmp_path: Path) -> None:
    with on_small_disk(tmp_path) as (process, line, disk):
        ada, bob = Caller(address(line), Hello((1,))), Caller(address(line), Hello((1,)))
        ada.lines("x = 1", "DRIVE 1, 5")
        filler = disk / "filler"
        with filler.open("wb", buffering=0) as file, suppress(OSError):
            while True:
                file.write(bytes(512))
        driven = 1
        while ada.line(f"DRIVE 1, {-5 if driven % 2 else 5}").ok:
            driven += 1
        assert "no space left on device" in ada.said[-1]
        assert ada.line("WHERE").ok
        assert ada.line("ABORT").ok
        assert bob.ask(lambda id: Subscribe(id, rate=50.0))
        assert isinstance(bob.until(lambda one: isinstance(one, Sample)), Sample)
        filler.unlink()
        ada.lines("DRIVE 1, 5", "x = 2")
        version = ada.line("WHERE").version
        kept = {one.name: one.read_bytes() for one in disk.iterdir()}
        process.kill()
        process.wait()
        ada.close()
        bob.close()
    after = tmp_path / "after"
    after.mkdir()
    for name in ("puma560.vrst", "puma560.v2"):
        (after / name).write_bytes(kept[name])
    with server("--journal", str(after)) as (_, line):
        again = Caller(address(line), Hello((1,)))
        assert again.line("TYPE x").version == version
        assert again.said[-1] == " 2"
        again.leave()


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="file systems of one process are Linux' own")
def test_a_disk_that_is_read_only_is_told_in_one_message(tmp_path: Path) -> None:
    with on_small_disk(tmp_path, ",ro") as (process, line, _):
        assert line == ""
        assert process.wait(PATIENCE) == 2
        assert process.stderr is not None
        said = process.stderr.read()
    assert said.count("\n") == 1
    assert "read-only file system (name another place)" in said


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="only Linux limits what another process may write")
def test_files_that_may_not_grow_refuse_commands_until_they_may(tmp_path: Path) -> None:
    import resource

    with server("--journal", str(tmp_path)) as (process, line):
        ada = Caller(address(line), Hello((1,)))
        ada.lines("x = 1", "DRIVE 1, 5")
        unlimited = resource.prlimit(process.pid, resource.RLIMIT_FSIZE)
        resource.prlimit(process.pid, resource.RLIMIT_FSIZE, (10, unlimited[1]))
        for text in ("x = 2", "DRIVE 1, 5"):
            assert not ada.line(text).ok
            assert "file too large" in ada.said[-1]
        assert ada.line("WHERE").ok
        assert ada.line("ABORT").ok
        resource.prlimit(process.pid, resource.RLIMIT_FSIZE, unlimited)
        ada.lines("x = 3", "DRIVE 1, 5", "TYPE x")
        assert ada.said[-1] == " 3"
        ada.leave()


def test_a_port_that_is_taken(tmp_path: Path) -> None:
    with server("--journal", str(tmp_path)) as (_, line):
        port = address(line).rpartition(":")[2]
        result = subprocess.run(
            [sys.executable, "-m", "vrs_cli", "serve", "--port", port],
            capture_output=True,
            text=True,
            timeout=PATIENCE,
            check=False,
        )
        assert result.returncode == 2
        assert f"127.0.0.1:{port}" in result.stderr
        assert result.stderr.count("\n") == 1


@pytest.mark.skipif(shutil.which("openssl") is None, reason="there is no openssl to make a certificate with")
def test_with_tls_and_tokens(tmp_path: Path) -> None:
    cert, key, tokens = tmp_path / "cert.pem", tmp_path / "key.pem", tmp_path / "tokens.toml"
    made = add_tokens(tokens, ["ada"])
    made_of = "req -x509 -newkey rsa:2048 -nodes -days 2 -subj /CN=localhost -addext subjectAltName=IP:127.0.0.1"
    subprocess.run(["openssl", *made_of.split(), "-keyout", key, "-out", cert], check=True, capture_output=True)
    options = ("--host", "0.0.0.0", "--tls-cert", str(cert), "--tls-key", str(key), "--tokens", str(tokens))
    with server(*options, "--robots-per-token", "1") as (_, line):
        assert line.startswith("vrs serve: wss://0.0.0.0:")
        assert line.endswith(", 1 of its own for each token\n")
        known = ssl.create_default_context(cafile=cert)
        here = address(line).replace("0.0.0.0", "127.0.0.1")
        with Caller(here, Hello((1,), token=made["ada"]), ssl=known) as caller:
            assert caller.line("WHERE").ok
        with pytest.raises((OSError, InvalidHandshake)):
            Caller(here.replace("wss", "ws"), Hello((1,), token=made["ada"]))
        for url, ca, told in (
            (here, None, "is not trusted: self-signed certificate (name its file with --ca, in Python with ca=)"),
            (here.replace("127.0.0.1", "127.0.0.2"), cert, "(say the name that the certificate is for)"),
            (here.replace("wss", "ws"), cert, f"(is it a server with TLS? {here})"),
        ):
            with pytest.raises(RequestRefused, match=re.escape(told)):
                vrs.connect(url, token=made["ada"], ca=ca)
