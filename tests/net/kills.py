"""Kill a server that is being driven, again and again, and look whether all that it has answered is there afterwards.

    python -m tests.net.kills 200 [SEED]

Callers command motions and changes of variables without a pause; after a random while the process is killed (SIGKILL).
It must come back from its journal with every answered command: the timeline that a mirror would have at that version,
to the bit, and the last answered value of each variable.
"""

from __future__ import annotations

import random
import signal
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

from tests.by_hand import command
from tests.live import PATIENCE
from tests.net.serving import Caller
from vrs_cli.engine.book import WindowSize
from vrs_cli.engine.engine import Engine
from vrs_cli.files.journal import keep_journal, take_up
from vrs_cli.files.past import GrowingFile, resume_journal
from vrs_cli.files.trajectory_file import read_trajectory
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.net.messages import Hello, Shown, Window
from vrs_cli.values.commands import JointTarget, Move
from vrs_cli.wire.messages import snapshot_of
from vrs_cli.wire.records import Form

ROBOTS = ("cell1", "cell2")
BEFORE = 1700  # changes of each robot before the first kill: a restart begins at a checkpoint
THOROUGH = 5  # after so many kills the journal is read as a whole, which takes seconds
LONGEST = 0.6  # [s] of work before a server is killed


class Driver:
    """Somebody who drives one robot as fast as it answers. `known`: what was answered last."""

    def __init__(self, robot: str, random: random.Random) -> None:
        self.robot, self.random = robot, random
        self.version, self.value, self.answered = 0, 0, 0
        self.asked = 0  # the value that was asked for last

    def drive(self, address: str) -> None:
        """Until the server is gone."""
        try:
            caller = Caller(f"{address}/robots/{self.robot}", Hello((1,)))
            while True:
                self.step(caller)
        except Exception:
            return  # the server was killed

    def step(self, caller: Caller) -> None:
        if self.random.random() < 0.5:
            self.asked += 1
            done = caller.line(f"x = {self.asked}")
            if done.ok:
                self.value = self.asked
        else:
            joint, angle = self.random.randint(1, 6), self.random.uniform(-5.0, 5.0)
            done = caller.line(f"DRIVE {joint}, {angle:.3f}, 100 AT {self.random.uniform(0.0, 20.0):.3f}")
        if done.ok:
            self.version, self.answered = done.version, self.answered + 1

    def check(self, address: str, folder: Path, *, thorough: bool = True) -> None:
        """All that was answered is there; if `thorough`, what is served is what the journal says, to the bit."""
        with Caller(f"{address}/robots/{self.robot}", Hello((1,))) as caller:
            version = caller.line("WHERE").version
            caller.line("TYPE x")
            found = int(float(caller.said[-1])) if self.value else 0
            shown = caller.ask(lambda id: Window(id, -1.0))
        assert isinstance(shown, Shown)
        if thorough:
            recording = read_trajectory(folder / f"{self.robot}.vrst")
            snapshot = snapshot_of(shown.snapshot, Form.of(arm_for(recording.model)))
            if snapshot.segments != tuple(recording.timeline)[snapshot.first :]:
                raise SystemExit(f"{self.robot}: what is served is not what the journal says")
        if version < self.version:
            raise SystemExit(f"{self.robot}: version {self.version} was answered, {version} came back")
        if not self.value <= found <= self.asked:
            raise SystemExit(f"{self.robot}: x = {self.value} was answered, {found} came back")
        self.version, self.value, self.asked = version, found, found


def started(folder: Path) -> tuple[subprocess.Popen[str], str]:
    robots = [word for name in ROBOTS for word in ("--robot", f"{name}=puma560")]
    command = [sys.executable, "-m", "vrs_cli", "serve", "--port", "0", "--journal", str(folder), *robots]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stdout is not None
    line = process.stdout.readline()
    if "ws://" not in line:
        raise SystemExit(f"the server did not come back: {line}{process.stderr and process.stderr.read()}")
    return process, line.split()[2].rstrip(",")


def begin(path: Path) -> None:
    """A journal of a robot that has moved before."""
    engine, reach = Engine(load_robot("puma560")), WindowSize()
    journal = keep_journal(take_up(path, changes=reach.changes), engine, together=True, reach=reach)
    _, *others = engine.position().joints
    for number in range(BEFORE):
        engine.perform(Move(JointTarget((0.02 * (number % 2), *others)), False))
    journal.settle()
    journal.close()
    file = GrowingFile(path)
    assert resume_journal(file, reach.changes) is not None
    file.close()


def kill(times: int, seed: int, folder: Path) -> int:
    """How many commands were answered."""
    for robot in ROBOTS:
        begin(folder / f"{robot}.vrst")
    chance = random.Random(seed)
    drivers = [Driver(robot, random.Random(f"{seed} {robot}")) for robot in ROBOTS]
    before: dict[str, bytes] = {}
    for number in range(times):
        process, address = started(folder)
        for driver in drivers:
            driver.check(address, folder, thorough=not number % THOROUGH)
        threads = [threading.Thread(target=driver.drive, args=(address,), daemon=True) for driver in drivers]
        for thread in threads:
            thread.start()
        time.sleep(chance.uniform(0.0, LONGEST))
        process.send_signal(signal.SIGKILL)
        process.wait()
        for thread in threads:
            thread.join()
        for robot in ROBOTS:
            before[robot] = grown(folder / f"{robot}.vrst", before.get(robot, b""))
        if not (number + 1) % 10:
            print(f"{number + 1} kills, {sum(driver.answered for driver in drivers)} commands answered", flush=True)
    process, address = started(folder)
    for driver in drivers:
        driver.check(address, folder)
    process.terminate()
    if process.wait(PATIENCE):
        raise SystemExit(f"the server ended with {process.returncode}")
    for robot in ROBOTS:
        read_trajectory(folder / f"{robot}.vrst")
    return sum(driver.answered for driver in drivers)


def grown(path: Path, before: bytes) -> bytes:
    """The lines of a journal, which begins as it was: what was answered is there to the bit."""
    data = path.read_bytes()
    whole = data[: data.rfind(b"\n") + 1]
    if not whole.startswith(before):
        raise SystemExit(f"{path} does not go on from what it was")
    return whole


def main(times: int = 20, seed: int = 1) -> None:
    with tempfile.TemporaryDirectory() as folder:
        answered = kill(times, seed, Path(folder))
    print(f"{times} kills, {answered} commands answered, nothing lost")


if __name__ == "__main__":
    command(main)
