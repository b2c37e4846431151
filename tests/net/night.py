"""A night of many robots whose programs go round without end: what they take of memory, and whether they know the past.

`python -m tests.net.night 200 12 1` serves 200 robots for 12 hours of their clock, one of which moves without a pause;
the others rest for two minutes after each motion. It prints the memory of each hour; status 1 for more than 500 MB, and
for an old time that is not what it was.
"""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from random import Random

import pytest

from tests.by_hand import command
from tests.live import until
from vrs_cli.engine.clock import WallClock
from vrs_cli.files.trajectory_file import read_trajectory
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.net import served_robot
from vrs_cli.net.durable_log import Audit
from vrs_cli.net.room import Room
from vrs_cli.net.served_robot import Plan

STEP = 600.0  # [s] of the clock that pass at once
MOST = 500.0  # [MB]
PROGRAM = ".PROGRAM loop()\nDO\nDRIVE 1, 20\n{0}DRIVE 1, -20\n{0}UNTIL SIG(1)\n.END\n"
REST = "DELAY 120\n"


class Night:
    """Robots on a clock that goes on when it is told to."""

    def __init__(self, folder: Path, robots: int, restless: int) -> None:
        self.now, self.folder, self.random = 0.0, folder, Random(1)
        self.seen: list[tuple[Room, float, tuple[float, ...]]] = []  # where a robot was, as it was seen then
        self.rooms = [self._begin(number, "" if number < restless else REST) for number in range(robots)]

    def _begin(self, number: int, pause: str) -> Room:
        files = self.folder / f"files{number}"
        files.mkdir()
        (files / "loop.v2").write_text(PROGRAM.format(pause), encoding="utf-8")
        plan = Plan(load_robot("puma560"), files, self._journal(number), realtime=1.0)
        audit = Audit(None, time.time, print)
        room = Room(f"robot{number}", plan, lambda: None, audit, print, lambda _: (), lambda: self.now)
        room._self.put(room.session.answers("LOAD loop")).result()
        room._self.put(room.session.answers("EXECUTE loop"))
        until(lambda: room.session.running)
        return room

    def _journal(self, number: int) -> Path:
        return self.folder / f"robot{number}.vrst"

    def go_on(self, seconds: float) -> None:
        """Let the clock go on, and wait until all robots have planned so far."""
        self.now += seconds
        for room in self.rooms:
            room.session.actor.call(lambda: None)  # it looks at the clock
        for room in self.rooms:
            until(lambda room=room: room.session.engine.end >= self.now)  # type: ignore[misc]
            room.pump()
            room.tick()
        room = self.random.choice(self.rooms)
        t = self.now - self.random.uniform(0.0, STEP)
        self.seen.append((room, t, room.session.engine.position(t).joints))

    def check(self) -> str:
        """What is wrong; empty where nothing is."""
        if any(room.session.engine.position(t).joints != joints for room, t, joints in self.seen):
            return "an old time is not what it was"
        for number in (0, len(self.rooms) - 1):
            if read_trajectory(self._journal(number)).timeline != self.rooms[number].session.engine.timeline:
                return f"robot{number} has another timeline in its journal"
        for room in self.rooms:
            room.close()
        return ""


def memory() -> float:
    """What this process takes [MB]."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def main(robots: int = 200, hours: int = 12, restless: int = 1) -> int:
    most = 0.0
    with tempfile.TemporaryDirectory() as folder, pytest.MonkeyPatch.context() as patch:
        night: Night | None = None

        class Clock(WallClock):
            def __init__(self, _wall: object, sleep: Callable[[float], None], rate: float) -> None:
                super().__init__(lambda: 0.0 if night is None else night.now, sleep, rate)

        patch.setattr(served_robot, "WallClock", Clock)
        night = Night(Path(folder), robots, restless)
        print(f"{robots} robots: {memory():.0f} MB", flush=True)
        for hour in range(1, hours + 1):
            for _ in range(int(3600.0 / STEP)):
                night.go_on(STEP)
            most = max(most, memory())
            changes = sum(room.session.engine.timeline.version for room in night.rooms)
            print(f"hour {hour}: {memory():.0f} MB, {changes} changes, {time.process_time():.0f} s of CPU", flush=True)
        wrong = night.check() or ("too much memory" if most > MOST else "")
    print(wrong or f"at most {most:.0f} MB; {len(night.seen)} old times are what they were")
    return 1 if wrong else 0


if __name__ == "__main__":
    command(main)
