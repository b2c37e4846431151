"""A server, a body, an operator and a viewer, the first two as processes of their own, the last three behind a delay
line each: `python -m tests.laws.real_twin [RUNS]`. The operator moves the arm, the arm stops in an emergency, and
RESYNC brings it back. At each look of the viewer that is not flagged, the error of what was seen has to be the body's
own error, of each joint.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from random import Random
from tempfile import TemporaryDirectory
from threading import Event, Thread
from typing import NamedTuple

import numpy as np

import vrs_cli as vrs
from tests.by_hand import command
from tests.live import until
from vrs_cli.errors import RequestRefused, TooLate

LINE = "gamma 200ms 80ms"
LEADS, PAUSE, LOOK = (0.4, 1.5), 1.2, 0.05  # [s] a command is ahead; between two commands; between two looks
ROUNDED = 1e-9  # [deg] of numbers that are the same
ARRIVED = 0.1  # [deg] that the body may be off at rest
MOVES = 4  # before the emergency stop, and after RESYNC


class TwinRun(NamedTuple):
    """`looks` of the viewer, how many were `flagged`, and at how many of those something wrong was shown. `excess`
    [deg]: the greatest difference, at looks that are not flagged, of the error of what was seen from the error of the
    body's tracking, which is at most `tracking`. `late`: commands that the robot refused. `resync` [s]: from the
    operator's request to the answer. `after` [deg]: how far the body is off in the end.
    """

    looks: int
    flagged: int
    wrong: int
    excess: float
    tracking: float
    late: int
    resync: float
    after: float


@contextmanager
def process(*words: str) -> Iterator[subprocess.Popen[str]]:
    """Start vrs with these words, and kill it in the end."""
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.STDOUT}
    with subprocess.Popen([sys.executable, "-m", "vrs_cli", *words], text=True, **pipes) as it:  # type: ignore[call-overload]
        try:
            yield it
        finally:
            it.kill()


class Viewer(Thread):
    """Looks at a robot until it is stopped. `seen`: the time of each look [s], and the joints that were shown [deg]."""

    def __init__(self, robot: vrs.Robot) -> None:
        super().__init__()
        self.robot, self.seen, self._stopped = robot, list[tuple[float, np.ndarray]](), Event()

    def run(self) -> None:
        while not self._stopped.wait(LOOK):
            preview, t = self.robot.preview(), self.robot.now
            self.seen.append((t, preview.where(t).joints))

    def stop(self) -> None:
        self._stopped.set()
        self.join()


def run(seed: int, line: str = LINE) -> TwinRun:
    random = Random(seed)
    with ExitStack() as stack:
        folder = stack.enter_context(TemporaryDirectory())

        def start(*words: str) -> subprocess.Popen[str]:
            return stack.enter_context(process(*words))

        def delayed(port: str, number: int) -> str:
            words = ("--forward", line, "--backward", line, "--seed", str(3 * seed + number))
            it = start("lab", "delay", "0", port, *words)
            return f"ws://{it.stdout.readline().split()[0]}"  # type: ignore[union-attr]

        server = start("serve", "--port", "0", "--realtime", "--journal", folder)
        address = server.stdout.readline().split()[2].rstrip(",")  # type: ignore[union-attr]
        port = address.rsplit(":", 1)[1]
        body = start("body", delayed(port, 0), "--mujoco")
        near = stack.enter_context(vrs.connect(address, name="near"))
        operator = stack.enter_context(vrs.connect(delayed(port, 1), name="operator"))
        viewer = Viewer(stack.enter_context(vrs.connect(delayed(port, 2), name="viewer")))
        until(lambda: len(near.measured))
        viewer.start()
        stack.callback(viewer.stop)
        late = 0

        def moves() -> None:
            nonlocal late
            for _ in range(MOVES):
                joints = operator.where(operator.end).joints + np.array([random.uniform(-8, 8) for _ in range(6)])
                begin = max(operator.now + random.uniform(*LEADS), operator.end)
                try:
                    with operator.without_waiting():
                        operator.move(*joints, at=begin, speed=50)
                except TooLate:
                    late += 1
                time.sleep(PAUSE)

        time.sleep(1.0)
        moves()
        with operator.without_waiting():  # the arm stops in the middle of this
            joints = operator.where(operator.end).joints + 20.0
            operator.move(*joints, at=max(operator.now + LEADS[1], operator.end), speed=10)
        until(lambda: near.now > near.end - 1.0)
        assert body.stdin is not None
        print("stop", file=body.stdin, flush=True)
        time.sleep(1.0)
        print("release stop", file=body.stdin, flush=True)
        time.sleep(1.0)
        begun = time.monotonic()
        operator.resync()
        taken = time.monotonic() - begun
        moves()
        time.sleep(4.0)
        viewer.stop()
        flags = viewer.robot.preview().flagged
        times, shown = np.array([t for t, _ in viewer.seen]), np.array([q for _, q in viewer.seen])
        until(lambda: near.measured.unknown_since > times[-1])
        true, real = near.where(times).joints, near.measured.at(times)
        flagged = np.array([any(a <= t <= b for a, b in flags) for t in times])
        assert real is not None
        known = ~np.isnan(real).any(axis=1)
        tracking = np.abs(true - real).max(axis=1)
        apart = np.abs((shown - real) - (true - real)).max(axis=1)
        return TwinRun(
            len(times),
            int(flagged.sum()),
            int((apart[known & flagged] > ROUNDED).sum()),
            float(apart[known & ~flagged].max(initial=0.0)),
            float(tracking[known].max()),
            late,
            taken,
            float(tracking[known][-1]),
        )


def main(runs: int = 6) -> int:
    failed = 0
    for seed in range(runs):
        try:
            it = run(seed)
        except RequestRefused as refusal:
            print(f"run {seed}: {refusal}", flush=True)
            failed += 1
            continue
        failed += it.excess > ROUNDED or not it.wrong or it.after > ARRIVED
        print(
            f"run {seed}: {it.looks} looks, {it.flagged} flagged, {it.wrong} of them wrong; else seen minus tracking "
            f"error {it.excess:.2g} deg, tracking at most {it.tracking:.3f} deg; {it.late} commands too late; RESYNC "
            f"answered after {it.resync:.2f} s, then off by {it.after:.4f} deg (load {os.getloadavg()[0]:.1f})",
            flush=True,
        )
    return failed


if __name__ == "__main__":
    command(main)
