"""Test that data in the user's cache folder is used only for the same source and version, and that the folder may be
missing, damaged or shared.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from vrs_cli import extras
from vrs_cli.extras import cached
from vrs_cli.kinematics import robot_file
from vrs_cli.kinematics.robot_file import load_robot, robot_names

MADE = {"a": [1.5, -0.0, "x"], "b": ({1: True}, None)}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return tmp_path / "vrs"


def never() -> Any:
    pytest.fail("it is in the cache")


def test_the_result_is_computed_once(folder: Path) -> None:
    assert cached("one.table", "source", lambda: MADE) is MADE
    assert cached("one.table", "source", never) == MADE
    assert [path.name for path in folder.iterdir()] == ["one.table"]


def test_another_source_or_version_is_computed_again(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert cached("one.table", "source", lambda: 1) == 1
    assert cached("one.table", "source 2", lambda: 2) == 2
    monkeypatch.setattr(extras, "__version__", "99.0")
    assert cached("one.table", "source 2", lambda: 3) == 3
    assert cached("one.table", "source 2", never) == 3
    assert len(list(folder.iterdir())) == 1


@pytest.mark.parametrize(
    "spoil", [lambda data: data[:0], lambda data: data[:-9], bytes.upper, lambda data: bytes(len(data))]
)
def test_a_damaged_file_is_written_again(folder: Path, spoil: Callable[[bytes], bytes]) -> None:
    cached("one.table", "source", lambda: MADE)
    whole = (folder / "one.table").read_bytes()
    (folder / "one.table").write_bytes(spoil(whole))
    assert cached("one.table", "source", lambda: MADE) == MADE
    assert (folder / "one.table").read_bytes() == whole


def test_a_result_of_none_is_not_written(folder: Path) -> None:
    assert cached("one.table", "source", lambda: None) is None
    assert not folder.exists()


def test_a_folder_that_cannot_be_written_is_no_error(folder: Path) -> None:
    folder.write_bytes(b"a file in the place of the folder")
    assert cached("one.table", "source", lambda: MADE) is MADE


def test_a_user_without_a_home_has_no_cache(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    for name in ("XDG_CACHE_HOME", "LOCALAPPDATA"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(os.path, "expanduser", lambda path: path)  # as it does for such a user
    monkeypatch.chdir(tmp_path)
    assert cached("one.table", "source", lambda: MADE) is MADE
    assert not list(tmp_path.iterdir())


def test_an_error_of_the_computation_passes_through(folder: Path) -> None:
    def wrong() -> None:
        raise ValueError("wrong")

    with pytest.raises(ValueError, match="wrong"):
        cached("one.table", "source", wrong)
    assert not folder.exists()


def test_several_processes_share_the_folder(folder: Path) -> None:
    code = "from vrs_cli.extras import cached; assert cached('one.table', 's', lambda: list(range(9999)))[-1] == 9998"
    processes = [subprocess.Popen([sys.executable, "-c", code]) for _ in range(4)]
    assert [process.wait() for process in processes] == [0] * 4
    assert cached("one.table", "s", never) == list(range(9999))
    assert len(list(folder.iterdir())) == 1


def test_a_built_in_robot_of_the_cache_is_the_robot_of_its_file(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(robot_file, "_built_in", robot_file._built_in.__wrapped__)
    parsed = {name: load_robot(name) for name in robot_names()}
    assert {path.stem for path in folder.iterdir()} == set(robot_names())
    monkeypatch.setattr(robot_file, "_parse", lambda *_: never())
    for name, model in parsed.items():
        assert load_robot(name) == model
        assert repr(load_robot(name)) == repr(model)
