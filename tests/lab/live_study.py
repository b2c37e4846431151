"""A study with a person who is played: the real server, line and prompt, a kill in the middle, and the rows at the end.

python -m tests.lab.live_study 3
"""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from time import sleep

import vrs_cli as vrs
from tests.by_hand import command

TEXT = "trials = 1\ntolerance = 15\ntimeout = 20\n[[condition]]\nname = 'near'\n[[condition]]\nname = 'far'\n"
TARGET = re.compile(r"X (\S+), Y (\S+), Z (\S+) mm\n.*O (\S+), A (\S+), T (\S+) deg")
TRIES = 50  # of a command, while the line of the next condition begins


def main(participants: int = 2) -> int:
    """Let participants do both trials; the first one is killed in the first trial. Return the exit status."""
    with TemporaryDirectory() as folder:
        study = Path(folder, "study.toml")
        study.write_text(TEXT + "forward = '200ms'\nbackward = '200ms'\n")
        drive(study, 1, killed=True)
        for participant in range(1, participants + 1):
            drive(study, participant)
        rows = [row.split(",") for row in study.with_suffix(".csv").read_text().splitlines()[1:]]
    print(*(f"{row[1]} {row[3]}: {row[9]} s" for row in rows), sep="\n")
    reached = [(row[1], row[2], row[8]) for row in rows]
    wanted = [(f"P{k:03d}", str(n), "1") for k in range(1, participants + 1) for n in (1, 2)]
    return 0 if reached == wanted else 1


def drive(study: Path, participant: int, *, killed: bool = False) -> None:
    """Do all trials of a participant, each by one motion; or kill the study in the first one."""
    words = ("lab", "experiment", "study", str(study), "--participant", str(participant))
    pipe = subprocess.PIPE
    with subprocess.Popen([sys.executable, "-m", "vrs_cli", *words], stdin=pipe, stdout=pipe, text=True) as child:
        assert child.stdin is not None
        assert child.stdout is not None
        text, robot = "", None
        while one := child.stdout.read(1):
            text += one
            if not text.endswith("begin: "):
                continue
            robot = robot or vrs.connect(re.findall(r"vrs connect (ws://\S+)", text)[0])
            child.stdin.write("\n")
            child.stdin.flush()
            if killed:
                child.kill()
                break
            do(robot, f"MOVE TRANS({','.join(TARGET.findall(text)[-1])})")
        if robot is not None:
            robot.leave()


def do(robot: vrs.Robot, line: str) -> None:
    """Do a line as soon as there is a connection."""
    for _ in range(TRIES):
        try:
            robot.do(line)
            return
        except vrs.VrsError:
            sleep(0.2)
    raise SystemExit("the line does not come back")


if __name__ == "__main__":
    command(main)
