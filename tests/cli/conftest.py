from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import pytest

from tests.files.trajectories import initial, planned, puma
from vrs_cli.__main__ import main
from vrs_cli.files.trajectory_file import write_trajectory


class Ended(NamedTuple):
    """What a command line left: exit status, standard output, standard error."""

    status: int
    out: str
    err: str


Vrs = Callable[..., Ended]


@pytest.fixture
def vrs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Vrs:
    """Run a command line in this process, in an empty folder: vrs("where", "t.vrst", "--at", 1)."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments: object) -> Ended:
        words: Sequence[str] = [str(argument) for argument in arguments]
        status = main(words)
        out, err = capsys.readouterr()
        assert "Traceback" not in out + err
        return Ended(status, out, err)

    return run


@pytest.fixture
def saved(tmp_path: Path) -> Path:
    """A trajectory file of six motions, t.vrst in the folder where `vrs` runs."""
    path = tmp_path / "t.vrst"
    write_trajectory(path, puma(), [initial()], planned(6)[1])
    return path
