"""The audit: a line a deed, bounded, and never in the way."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from vrs_cli.errors import FileError
from vrs_cli.net.audit import Audit

MOVE = ("cell1", "ada", "10.0.0.7:51344", "MOVE part", "done")


def rows(path: Path) -> list[dict[str, str]]:
    return [json.loads(line) for line in path.read_text().splitlines()]


def audit(path: Path | None, told: list[str], most: int = 10_000) -> Audit:
    return Audit(path, lambda: 1_800_000_000.123, told.append, most)


def test_a_line_says_when_who_where_what_and_what_became_of_it(tmp_path: Path) -> None:
    path = tmp_path / "journal" / "audit.jsonl"
    audit(path, []).note(*MOVE)
    assert rows(path) == [
        {
            "when": "2027-01-15T08:00:00.123Z",
            "robot": "cell1",
            "who": "ada",
            "from": "10.0.0.7:51344",
            "what": "MOVE part",
            "result": "done",
        }
    ]


def test_it_is_there_at_once_and_goes_on_in_the_same_file(tmp_path: Path) -> None:
    path = tmp_path / "audit.jsonl"
    for _ in range(2):
        audit(path, []).note(*MOVE)
    assert len(rows(path)) == 2


def test_what_is_typed_cannot_forge_a_line(tmp_path: Path) -> None:
    path = tmp_path / "audit.jsonl"
    audit(path, []).note("cell1", "ada", "x", 'MOVE p"}\n{"who": "bob\x1b[2J', "done")
    assert len(rows(path)) == 1
    assert "\x1b" not in path.read_text()


def test_long_commands_are_cut_and_say_so(tmp_path: Path) -> None:
    path = tmp_path / "audit.jsonl"
    audit(path, []).note("cell1", "ada", "x", "y" * 5000, "done")
    assert rows(path)[0]["what"].endswith("yyy... (5000 characters)")
    assert path.stat().st_size < 2000


def test_a_stranger_cannot_fill_it_with_his_name(tmp_path: Path) -> None:
    path = tmp_path / "audit.jsonl"
    audit(path, []).note(30_000 * "r", 30_000 * "\0", "10.0.0.7:1", "(enter)", "refused")
    (row,) = rows(path)
    assert row["robot"] == 40 * "r"
    assert row["who"] == 40 * "\0"


def test_it_is_bounded(tmp_path: Path) -> None:
    path = tmp_path / "audit.jsonl"
    it = audit(path, [], most=1000)
    for number in range(100):
        it.note("cell1", "ada", "x", f"MOVE p{number}", "done")
    assert sorted(one.name for one in tmp_path.iterdir()) == ["audit.1.jsonl", "audit.jsonl"]
    assert all(one.stat().st_size <= 1000 for one in tmp_path.iterdir())
    kept = [row["what"] for one in ("audit.1.jsonl", "audit.jsonl") for row in rows(tmp_path / one)]
    assert kept == [f"MOVE p{number}" for number in range(100 - len(kept), 100)]


def test_what_cannot_be_written_is_told_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path, told = tmp_path / "audit.jsonl", list[str]()
    it = audit(path, told)

    def full(_handle: int, _data: bytes) -> int:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as broken:
        broken.setattr("vrs_cli.net.audit.os.write", full)
        it.note(*MOVE)
        it.note(*MOVE)
    assert len(told) == 1
    assert "no space left" in told[0]
    it.note(*MOVE)
    assert len(told) == 2
    assert len(rows(path)) == 1


def test_half_a_line_does_not_stay(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import os

    path, write = tmp_path / "audit.jsonl", os.write
    it = audit(path, [])
    with monkeypatch.context() as short:
        short.setattr("vrs_cli.net.audit.os.write", lambda handle, data: write(handle, data[:5]))
        it.note(*MOVE)
    it.note(*MOVE)
    assert len(rows(path)) == 1


def test_a_place_that_cannot_be_written_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(FileError):
        audit(tmp_path / "file" / "audit.jsonl", [])
    audit(None, []).note(*MOVE)
