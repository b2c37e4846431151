"""Pipes and folders where subcommands want files."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.cli.conftest import Vrs
from vrs_cli.files import opening

pytestmark = pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no pipes with names")

DOORS = (
    ("run", "pipe.v2"),
    ("check", "pipe.v2"),
    ("fmt", "pipe.v2"),
    ("fmt", "--write", "pipe.v2"),
    ("where", "pipe.v2", "--at", "1"),
    ("replay", "pipe.v2"),
    ("export", "pipe.v2", "--to", "csv"),
    ("run", "p.v2", "--signals", "pipe.v2"),
    ("run", "p.v2", "--robot", "pipe.toml"),
    ("run", "p.v2", "--robot", "pipe.urdf"),
    ("run", "p.v2", "--save", "pipe.v2"),
    ("run", "p.v2", "--csv", "pipe.v2"),
    ("lab", "steer", "t.csv", "--robot", "pipe.toml"),
    ("robots", "pipe.toml"),
    ("shell", "--save", "pipe.v2"),
)


@pytest.mark.parametrize("made", [os.mkfifo, os.mkdir], ids=["pipe", "folder"])
@pytest.mark.parametrize("arguments", DOORS, ids=" ".join)
def test_no_subcommand_hangs(
    vrs: Vrs, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: tuple[str, ...], made: Callable[[Path], None]
) -> None:
    monkeypatch.setattr(opening, "PIPE_WAIT_S", 0.0)
    (tmp_path / "p.v2").write_text(".PROGRAM p\nDRIVE 1, 1, 100\n.END\n")
    (tmp_path / "t.csv").write_text("0,0,-90,90,0,0,0\n")
    for ending in ("v2", "toml", "urdf"):
        made(tmp_path / f"pipe.{ending}")
    ended = vrs(*arguments)
    assert ended.status in (1, 2)
    assert ended.err.count("\n") == 1
    assert "pipe." in ended.err
