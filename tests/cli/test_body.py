"""`vrs body`: a simulated arm, or another program, as the body of a robot that is served."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from socket import create_server
from typing import Any

import pytest

from tests.cli.conftest import Vrs
from tests.live import PATIENCE, until
from tests.net.serving import Serving, serving
from vrs_cli.engine.position import joints_at
from vrs_cli.values.measured import BodyMode


@contextmanager
def body(address: str, *words: str) -> Iterator[subprocess.Popen[str]]:
    """A body in a process of its own, once it has told that it is one."""
    command = [sys.executable, "-m", "vrs_cli", "body", address, *words]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        try:
            assert process.stderr is not None
            told = process.stderr.readline()
            assert "is the body of" in told, told
            yield process
        finally:
            process.kill()


def robot_body(it: Serving) -> Any:
    return it.hub.rooms["cell1"].session.body


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Serving]:
    with serving(tmp_path_factory.mktemp("served"), realtime=1.0) as it:
        yield it


@pytest.mark.long
def test_a_simulated_arm_follows_and_is_disturbed(served: Serving) -> None:
    pytest.importorskip("mujoco")
    with served.call() as hand, body(served.address, "--mujoco", "--rate", "200") as process:
        record = robot_body(served).record
        hand.lines("DRIVE 1, 20")
        until(lambda: len(record) and abs(record.view.arrays().joints[-1][0] - 0.349) < 1e-3)
        assert process.stdin is not None
        process.stdin.write("stop\nnonsense\n")
        process.stdin.flush()
        until(lambda: robot_body(served).view.mode is BodyMode.STOPPED)
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=PATIENCE)
        assert process.returncode == 0
        assert "nonsense" in err
        assert "Traceback" not in err
    until(lambda: robot_body(served).name == "")


def test_another_program_reports_and_reads_set_points(served: Serving) -> None:
    with body(served.address, "--stream", "--format", "json", "--rate", "50") as process:
        assert process.stdin is not None
        assert process.stdout is not None
        point = json.loads(process.stdout.readline())
        assert point.keys() == {"t", "joints", "velocity", "mode"}
        report = {"t": point["t"], "joints": [1, 2, 3, 4, 5, 6]}
        process.stdin.write(f"{json.dumps(report)}\n1,2\n1e9,1,2,3,4,5,6\n")
        process.stdin.flush()
        until(lambda: robot_body(served).view.counts.received == 1)
        _, err = process.communicate(timeout=PATIENCE)
        assert process.returncode == 1
        assert "standard input:2:" in err
        assert "standard input:3: *Illegal value* a report of 1e+09 s" in err


@pytest.mark.parametrize(
    ("words", "status", "told"),
    [
        (["ws://127.0.0.1:9"], 2, "which body? (give --mujoco or --stream or --rosbridge)"),
        (["ftp://a", "--stream"], 2, "is no address of a robot"),
        (["ws://127.0.0.1:9", "--stream"], 1, "does not answer"),
        (["ws://127.0.0.1:9", "--stream", "--mujoco"], 2, "not allowed with"),
        (["ws://127.0.0.1:9", "--stream", "--rate", "2001"], 2, "2000 at most"),
    ],
)
def test_what_is_no_body(vrs: Vrs, words: list[str], status: int, told: str) -> None:
    ended = vrs("body", *words)
    assert ended.status == status
    assert told in ended.err
    assert ended.err.count("\n") == 1


def test_without_mujoco(vrs: Vrs, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "vrs_cli.bodies.mujoco_arm", None)
    ended = vrs("body", "ws://127.0.0.1:9", "--mujoco")
    assert (ended.status, "pip install" in ended.err) == (2, True)


def test_a_scenario_that_is_not_there(vrs: Vrs, served: Serving) -> None:
    pytest.importorskip("mujoco")
    ended = vrs("body", served.address, "--mujoco", "--scenario", Path("none.toml"))
    assert ended.status == 2
    assert "none.toml" in ended.err


@contextmanager
def stand_in(port: str) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """A stand-in for rosbridge in a process of its own, and its address."""
    command = [sys.executable, "-m", "tests.bodies.bridge", port]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        try:
            yield process, process.stdout.readline().split()[-1]
        finally:
            process.kill()


@pytest.mark.long
def test_an_arm_of_ros_follows_and_its_server_may_be_killed(tmp_path: Path) -> None:
    with create_server(("127.0.0.1", 0)) as free:
        port = str(free.getsockname()[1])
    with ExitStack() as stack:
        served = stack.enter_context(serving(tmp_path, realtime=1.0))
        first, url = stack.enter_context(stand_in(port))
        hand = stack.enter_context(served.call())
        process = stack.enter_context(body(served.address, "--rosbridge", url))
        assert process.stderr is not None
        record, engine = robot_body(served).record, served.hub.rooms["cell1"].session.engine
        until(lambda: len(record) and robot_body(served).view.mode is BodyMode.FOLLOWS)
        hand.lines("DRIVE 1, 5", "DRIVE 1, -5")
        end = engine.timeline.end
        until(lambda: robot_body(served).view.last > end)
        assert max(one.joints[0] for one in record.view) > 0.08
        assert record.view[-1].joints == pytest.approx(joints_at(engine.arm, engine.timeline, end), abs=1e-6)
        first.kill()
        first.wait(PATIENCE)
        assert "is gone" in process.stderr.readline()
        stack.enter_context(stand_in(port))
        assert "is back" in process.stderr.readline()
        last = robot_body(served).view.last
        until(lambda: robot_body(served).view.last > last + 0.2)
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=PATIENCE)
        assert process.returncode == 0
        assert "Traceback" not in err


@pytest.mark.parametrize(
    ("words", "status", "told"),
    [
        (["--rosbridge", "arm:9090"], 2, "--rosbridge arm:9090 is no address (give ws://HOST:PORT"),
        (["--rosbridge", "ws://127.0.0.1:9"], 1, "no rosbridge answers at ws://127.0.0.1:9"),
        (["--rosbridge", "ws://127.0.0.1:9", "--joints", "a,b"], 2, "6 different names, one for each joint"),
        (["--rosbridge", "ws://127.0.0.1:9", "--joints", "none.toml"], 2, "none.toml"),
    ],
)
def test_an_arm_of_ros_that_cannot_be_is_told_in_a_line(
    served: Serving, vrs: Vrs, words: list[str], status: int, told: str
) -> None:
    found = vrs("body", served.address, *words)
    assert found.status == status
    assert told in found.err
    assert "Traceback" not in found.err
