"""A server, a body and an operator as real processes, body and operator behind a delay line each:
`python -m tests.laws.real_twin [RUNS]`. The operator moves the arm, the arm stops in an emergency, and RESYNC brings it
back. The operator does not look while RESYNC is answered.
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
from typing import NamedTuple

import numpy as np

import vrs_cli as vrs
from tests.by_hand import command
from tests.live import until
from vrs_cli.errors import RequestRefused

LINE = "gamma 200ms 80ms"
LEAD, PAUSE, LOOK = 1.5, 1.2, 0.05  # [s] a command is ahead; between two commands; between two looks
MOVES = 4  # before the emergency stop, and after RESYNC


class TwinRun(NamedTuple):
    """`looks` of the operator, and how many were `flagged`. `excess` [deg]: the greatest difference, at looks that are
    not flagged, of the error of what was seen from the error of the body's tracking, which is at most `tracking`.
    `resync` [s]: from the operator's request to the answer. `after` [deg]: how far the body is off in the end.
    """

    looks: int
    flagged: int
    excess: float
    tracking: float
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


def run(seed: int, line: str = LINE) -> TwinRun:
    random, seen = Random(seed), list[tuple[float, np.ndarray]]()
    with ExitStack() as stack:
        folder = stack.enter_context(TemporaryDirectory())

        def start(*words: str) -> subprocess.Popen[str]:
            return stack.enter_context(process(*words))

        def delayed(port: str, number: int) -> str:
            words = ("--forward", line, "--backward", line, "--seed", str(2 * seed + number))
            it = start("lab", "delay", "0", port, *words)
            return f"ws://{it.stdout.readline().split()[0]}"  # type: ignore[union-attr]

        server = start("serve", "--port", "0", "--realtime", "--journal", folder)
        address = server.stdout.readline().split()[2].rstrip(",")  # type: ignore[union-attr]
        port = address.rsplit(":", 1)[1]
        body = start("body", delayed(port, 0), "--mujoco")
        near = stack.enter_context(vrs.connect(address, name="near"))
        operator = stack.enter_context(vrs.connect(delayed(port, 1), name="operator"))
        until(lambda: len(near.measured))

        def look(seconds: float) -> None:
            end = time.monotonic() + seconds
            while time.monotonic() < end:
                preview, t = operator.preview(), operator.now
                seen.append((t, preview.where(t).joints))
                time.sleep(LOOK)

        def moves() -> None:
            for _ in range(MOVES):
                joints = operator.where(operator.end).joints + np.array([random.uniform(-8, 8) for _ in range(6)])
                with operator.without_waiting():
                    operator.move(*joints, at=max(operator.now + LEAD, operator.end), speed=50)
                look(PAUSE)

        look(1.0)
        moves()
        assert body.stdin is not None
        print("stop", file=body.stdin, flush=True)
        look(1.0)
        print("release stop", file=body.stdin, flush=True)
        look(1.0)
        begun = time.monotonic()
        operator.resync()
        taken = time.monotonic() - begun
        moves()
        look(4.0)
        times, shown = np.array([t for t, _ in seen]), np.array([q for _, q in seen])
        until(lambda: near.measured.unknown_since > times[-1])
        true, real = near.where(times).joints, near.measured.at(times)
        flags = operator.preview().flagged
        flagged = np.array([any(a <= t <= b for a, b in flags) for t in times])
        known = ~np.isnan(real).any(axis=1)
        tracking = np.abs(true - real).max(axis=1)
        apart = np.abs(np.abs(shown - real).max(axis=1) - tracking)
        excess = float(apart[known & ~flagged].max(initial=0.0))
        return TwinRun(
            len(times), int(flagged.sum()), excess, float(tracking[known].max()), taken, float(tracking[known][-1])
        )


def main(runs: int = 6) -> None:
    for seed in range(runs):
        try:
            it = run(seed)
        except RequestRefused as refusal:
            print(f"run {seed}: {refusal}", flush=True)
            continue
        print(
            f"run {seed}: {it.looks} looks, {it.flagged} flagged; seen minus tracking error {it.excess:.2g} deg, "
            f"tracking at most {it.tracking:.3f} deg; RESYNC answered after {it.resync:.2f} s, "
            f"then off by {it.after:.4f} deg (load {os.getloadavg()[0]:.1f})",
            flush=True,
        )


if __name__ == "__main__":
    command(main)
