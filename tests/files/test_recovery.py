"""Recovery files: what a killed shell had in memory is found once, and nothing is raised where none can be kept."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from vrs_cli.files.recovery import Recovery, left_files, recovery_files


def written(folder: Path, text: str) -> Recovery:
    recovery = Recovery(folder)
    recovery.write(text)
    recovery.wait()
    return recovery


def killed(recovery: Recovery) -> None:
    """What the system does to a lock when its process ends."""
    assert recovery._held is not None
    recovery._held.release()


def test_a_shell_that_runs_is_left_alone(tmp_path: Path) -> None:
    running = written(tmp_path, "one")
    assert (len(recovery_files(tmp_path)), left_files(tmp_path)) == (1, [])
    running.remove()
    assert list(tmp_path.iterdir()) == []


def test_the_file_of_a_shell_that_was_killed_is_found_once(tmp_path: Path) -> None:
    killed(written(tmp_path, "one"))
    (one,) = left_files(tmp_path)
    assert one.text == "one"
    assert left_files(tmp_path) == []  # another shell that starts now does not ask, too
    one.remove()
    assert list(tmp_path.iterdir()) == []


def test_each_shell_has_its_own_file(tmp_path: Path) -> None:
    shells = [written(tmp_path, text) for text in ("a", "b", "c")]
    killed(shells[0])
    killed(shells[2])
    assert {one.text for one in left_files(tmp_path)} == {"a", "c"}


def test_what_is_declined_stays_and_is_not_found_again(tmp_path: Path) -> None:
    killed(written(tmp_path, "one"))
    (one,) = left_files(tmp_path)
    place = one.decline()
    assert place.read_text() == "one"
    assert recovery_files(tmp_path) == []


def test_what_nobody_wanted_goes_after_a_month(tmp_path: Path) -> None:
    old, young, kept = (tmp_path / name for name in ("declined-1-a.v2", "declined-2-b.v2", "unstored-3-c.v2"))
    for path in (old, young, kept):
        path.write_text("x")
    for path in (old, kept):
        os.utime(path, (0.0, 0.0))
    assert [one.path for one in left_files(tmp_path)] == [kept]
    assert [path.exists() for path in (old, young, kept)] == [False, True, True]


def test_the_last_of_many_is_there(tmp_path: Path) -> None:
    recovery = Recovery(tmp_path)
    for number in range(200):
        recovery.write(str(number))
    recovery.wait()
    assert [path.read_text() for path in recovery_files(tmp_path)] == ["199"]


def test_nothing_is_made_before_there_is_something_to_keep(tmp_path: Path) -> None:
    Recovery(tmp_path / "state").remove()
    assert not (tmp_path / "state").exists()


@pytest.mark.parametrize("damage", ["file", "gone"])
def test_without_a_place_nothing_is_kept_and_nothing_raised(tmp_path: Path, damage: str) -> None:
    if damage == "file":
        (tmp_path / "state").touch()
    recovery = written(tmp_path / "state" / "deeper" if damage == "file" else Path("/proc/none"), "one")
    recovery.write("two")
    recovery.remove()


def test_a_file_that_cannot_be_read_is_passed_over(tmp_path: Path) -> None:
    (tmp_path / "unstored-1-bad.v2").write_bytes(b"\xff\xfe")
    killed(written(tmp_path, "good"))
    assert [one.text for one in left_files(tmp_path)] == ["good"]
