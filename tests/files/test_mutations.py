from __future__ import annotations

from pathlib import Path

from tests.files.mutations import tried


def test_no_change_of_a_file_with_checksums_goes_unseen(tmp_path: Path) -> None:
    """But for a last line that is missing."""
    tally = tried(tmp_path, 300, 1, checksums=True)
    assert tally["refused"] >= 285
    assert tally["warned"] == 0


def test_what_is_read_of_a_changed_file_of_before_keeps_the_laws_or_has_warnings(tmp_path: Path) -> None:
    tally = tried(tmp_path, 300, 1, checksums=False)
    assert tally["refused"] > 150
    assert tally["warned"] > 10
    assert tally["read"] > 10
