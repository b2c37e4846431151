"""The short part of fuzzing (`python -m tests.fuzz.long MINUTES` is the long one), and every case it has found."""

from __future__ import annotations

from pathlib import Path
from random import Random

import pytest

from tests.fuzz.probe import probe
from tests.fuzz.texts import text

TEXTS, PARTS = 600, 6


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize("part", range(PARTS))
def test_any_text(part: int) -> None:
    for seed in range(part, TEXTS, PARTS):
        probe(text(Random(seed)))


def test_a_seed_names_its_text() -> None:
    assert [text(Random(seed)) for seed in range(20)] == [text(Random(seed)) for seed in range(20)]


@pytest.mark.parametrize(
    "found",
    [".PROGRAM p\nDETACH ,TATE(#q[0], DEFINED())\n.END\n", ".PROGRAM p\nFCLOSE , (5)\n.END\n"],
)
def test_what_was_found(found: str) -> None:
    probe(found)
