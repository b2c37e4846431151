"""Every program of programs/ runs, types what its `; expect:` lines say, and leaves a lawful timeline."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.devices.outside import Outside
from vrs_cli.devices.script import read_script
from vrs_cli.engine.position import position_at
from vrs_cli.files.opening import Folder
from vrs_cli.interfaces.inspection import warnings_before_run
from vrs_cli.interfaces.session.session import Session
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.values.results import RunOutcome

PROGRAMS = Path(__file__).parents[2] / "programs"
SAMPLES = sorted(PROGRAMS.glob("*.v2"))
EXPECT, ROBOT, PEERS = "; expect:", "; robot:", "; peers:"
LIMIT = 1.0 + 1e-5


def expectations(text: str) -> list[str]:
    return [line.removeprefix(EXPECT).strip() for line in text.splitlines() if line.startswith(EXPECT)]


def robot_for(text: str) -> RobotModel:
    """The robot that a sample is written for: what `; robot:` says, else the usual one."""
    said = [line.removeprefix(ROBOT).strip() for line in text.splitlines() if line.startswith(ROBOT)]
    return load_robot(said[0] if said else "puma560")


def peers_of(text: str) -> Outside | None:
    """Whom a sample talks to: the script that `; peers:` names."""
    said = [line.removeprefix(PEERS).strip() for line in text.splitlines() if line.startswith(PEERS)]
    return read_script(str(PROGRAMS / said[0])) if said else None


def test_there_are_samples() -> None:
    assert len(SAMPLES) >= 8


@pytest.mark.parametrize("path", SAMPLES, ids=lambda path: path.stem)
def test_sample(path: Path, tmp_path: Path) -> None:
    text = path.read_text()
    expected = expectations(text)
    assert expected, f"{path.name} says nothing of what it does"
    terminal = RecordingTerminal()
    session = Session(terminal, robot_for(text), folder=Folder(tmp_path), outside=peers_of(text))
    assert session.load_text(text) == ()
    programs = tuple(session.environment.programs.values())
    assert warnings_before_run(programs, session.engine.model) == ()
    first = programs[0].name
    result = session.execute(first)
    assert result.fault is None
    assert result.outcome is RunOutcome.COMPLETED
    assert [line.strip() for line in result.typed] == expected
    keeps_limits(session)


def keeps_limits(session: Session) -> None:
    """At many times: twenty a segment."""
    engine = session.engine
    looks = min(20 * len(engine.timeline), 2000)
    for k in range(looks + 1):
        here = position_at(engine.arm, engine.timeline, engine.end * k / looks)
        for v, v_max in zip(here.velocity, engine.model.max_velocity, strict=True):
            assert abs(v) <= v_max * LIMIT
        for a, a_max in zip(here.acceleration, engine.model.max_acceleration, strict=True):
            assert abs(a) <= a_max * LIMIT
