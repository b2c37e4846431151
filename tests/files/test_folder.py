"""Files of a folder: listed, copied, renamed, deleted."""

from __future__ import annotations

from pathlib import Path

import pytest

from vrs_cli.errors import FileError, NonexistentFile
from vrs_cli.files import folder


def test_folders_come_first_and_hidden_files_not_at_all(tmp_path: Path) -> None:
    (tmp_path / "b.v2").write_text("12345")
    (tmp_path / "a.V2").write_text("")
    (tmp_path / ".secret").write_text("")
    (tmp_path / "sub").mkdir()
    assert [(row.name, row.size) for row in folder.entries(tmp_path)] == [("sub", None), ("a.V2", 0), ("b.v2", 5)]
    assert [row.name for row in folder.entries(tmp_path / "*.v2")] == ["a.V2", "b.v2"]


def test_what_is_not_there_is_named_with_what_is_near(tmp_path: Path) -> None:
    (tmp_path / "cell.v2").write_text("")
    with pytest.raises(NonexistentFile, match=r"did you mean cell\.v2"):
        folder.existing(tmp_path / "cel.v2")
    with pytest.raises(NonexistentFile):
        folder.entries(tmp_path / "nowhere" / "*.v2")
    with pytest.raises(FileError, match="folder"):
        folder.existing(tmp_path)


def test_a_target_has_the_extension_of_its_source_or_its_name_in_a_folder(tmp_path: Path) -> None:
    old = tmp_path / "cell.v2"
    old.write_text("x")
    (tmp_path / "sub").mkdir()
    assert folder.target(old, tmp_path / "new") == tmp_path / "new.v2"
    assert folder.target(old, tmp_path / "new.txt") == tmp_path / "new.txt"
    assert folder.target(old, tmp_path / "sub") == tmp_path / "sub" / "cell.v2"
    with pytest.raises(FileError, match="one file"):
        folder.target(old, old)


def test_copy_rename_delete(tmp_path: Path) -> None:
    old, copy, other = tmp_path / "a.v2", tmp_path / "b.v2", tmp_path / "c.v2"
    old.write_bytes(b"\xff\r\n")
    folder.copy(old, copy)
    assert copy.read_bytes() == b"\xff\r\n"
    folder.rename(copy, other)
    assert not copy.exists()
    folder.delete(other)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.v2"]
    with pytest.raises(FileError, match=r"c\.v2 cannot be deleted"):
        folder.delete(other)
