"""An arm of ROS as the body, with server, stand-in and body as processes: RESYNC after an emergency stop, and after the
body or the server was killed.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from socket import create_server

import numpy as np
import pytest

import vrs_cli as vrs
from tests.live import until
from vrs_cli.kinematics.robot_file import load_robot

WAY = np.array([6.0, 4.0, -5.0, 3.0, 3.0, 10.0])  # [deg]
NEAR = 0.01  # [deg]
FASTEST = np.degrees(load_robot("puma560").max_velocity)  # [deg/s]


@contextmanager
def process(*words: str) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """Run a module of Python; yield it and the first line that it writes."""
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.STDOUT}
    with subprocess.Popen([sys.executable, "-m", *words], text=True, **pipes) as it:  # type: ignore[call-overload]
        try:
            yield it, it.stdout.readline()  # type: ignore[union-attr]
        finally:
            it.kill()


def free_port() -> str:
    with create_server(("127.0.0.1", 0)) as socket:
        return str(socket.getsockname()[1])


def error(r: vrs.Robot, t: float) -> float:
    """How far the measured arm was from the timeline at a time [deg]; infinite where that is not known."""
    joints = r.measured.at(t)
    return float(np.abs(joints - r.where(t).joints).max()) if joints is not None else float("inf")


@pytest.mark.long
def test_resync_brings_an_arm_of_ros_back(tmp_path: Path) -> None:
    port = free_port()
    with ExitStack() as stack:
        bridge, told = stack.enter_context(process("tests.bodies.bridge", free_port()))

        def server() -> tuple[subprocess.Popen[str], vrs.Robot]:
            words = ("vrs_cli", "serve", "--port", port, "--realtime", "--journal", str(tmp_path))
            it, _ = stack.enter_context(process(*words))
            r = stack.enter_context(vrs.connect(f"ws://127.0.0.1:{port}"))
            return it, r

        def body() -> subprocess.Popen[str]:
            words = ("vrs_cli", "body", f"ws://127.0.0.1:{port}", "--rosbridge", told.split()[-1])
            it, said = stack.enter_context(process(*words))
            assert "is the body of" in said, said
            return it

        def reports(r: vrs.Robot) -> None:
            count = len(r.measured)
            until(lambda: len(r.measured) > count + 10)

        def move(r: vrs.Robot, way: np.ndarray, speed: float = 60.0) -> None:
            with r.without_waiting():
                r.move(*(r.where(r.end).joints + way), at=max(r.now + 0.3, r.end), speed=speed)

        def follows(r: vrs.Robot) -> None:
            """Wait until the arm stands where the timeline ends."""
            until(lambda: error(r, r.end + 0.3) < NEAR)

        it, r = server()
        arm = body()
        reports(r)
        move(r, WAY)
        follows(r)

        move(r, -WAY, speed=10.0)
        until(lambda: error(r, r.measured.unknown_since or 0.0) < NEAR and r.measured.velocity[-1].any())
        print("stop", file=bridge.stdin, flush=True)
        until(lambda: r.measured.modes[-1] == "stopped")
        with pytest.raises(vrs.VrsError, match="stopped"):
            r.resync()
        print("release", file=bridge.stdin, flush=True)
        until(lambda: r.measured.modes[-1] == "holds")
        r.resync()
        follows(r)

        arm.kill()
        arm.wait()
        move(r, 2.0 * WAY)  # the arm does not hear of it
        until(lambda: r.now > r.end)
        arm = body()
        reports(r)
        assert error(r, r.measured.unknown_since or 0.0) > 1.0
        assert r.measured.modes[-1] == "holds"
        r.resync()
        follows(r)

        move(r, -3.0 * WAY, speed=5.0)
        until(lambda: np.any(r.measured.velocity[-1]))
        it.kill()
        it.wait()
        _, r = server()
        reports(r)
        r.resync()
        follows(r)
        move(r, WAY)
        follows(r)
        assert np.max(np.abs(r.measured.velocity) / FASTEST) < 1.2
