"""The short part of fuzzing (`tests.fuzz.long` is the long one), and every case it has found."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path
from random import Random

import pytest

from tests.examples import first, some
from tests.fuzz import cells
from tests.fuzz.agreement import CHANGES, Agreement, disagreements
from tests.fuzz.lines import line
from tests.fuzz.probe import Probe, probe, typed
from tests.fuzz.texts import KINDS, text
from vrs_cli.engine.settings import PARAMETERS

TEXTS, PARTS = some(720), 6
VARIANTS = some(1000)
SESSIONS = some(60)  # of lines with extreme numbers


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize("part", first(2, range(PARTS)))
def test_any_text(part: int, tmp_path: Path) -> None:
    probed = Probe(tmp_path)
    for seed in range(part, TEXTS, PARTS):
        probed(text(Random(seed)).text)
    assert all(probed.counted[done] > 0 for done in ("checked", "formatted", "printed and read again", "run", "typed"))


def test_check_and_run_agree() -> None:
    law, made = Agreement(), Counter[str]()
    assert list(disagreements(VARIANTS, 1, law, made)) == []
    assert set(made) == set(CHANGES)
    assert (
        min(law.counted[found] for found in ("both find errors", "both find none", "programs primed")) > VARIANTS / 10
    )


def test_any_number() -> None:
    for seed in range(SESSIONS):
        typed(Random(seed))


def test_every_setting_gets_its_extremes() -> None:
    typed = "\n".join(line(Random(seed)) for seed in range(9000))
    for word in ("SPEED", "ACCEL", "DURATION", "DELAY", "TOOL", "BASE", "DRIVE", "JOG", *PARAMETERS):
        assert re.search(rf"{re.escape(word)}[^\n]* -?1E-320|{re.escape(word)}[^\n]* -?\dE-3\d\d", typed), word


def test_texts_are_of_all_kinds() -> None:
    made = [text(Random(seed)) for seed in range(200)]
    assert {one.kind for one in made} == set(KINDS)
    assert {one.mutations > 0 for one in made} == {True, False}


def test_a_seed_names_its_text() -> None:
    assert [text(Random(seed)) for seed in range(20)] == [text(Random(seed)) for seed in range(20)]


@pytest.mark.parametrize(
    "found",
    [".PROGRAM p\nDETACH ,TATE(#q[0], DEFINED())\n.END\n", ".PROGRAM p\nFCLOSE , (5)\n.END\n"],
)
def test_what_was_found(found: str) -> None:
    probe(found)


def test_any_cell() -> None:
    counted = Counter(map(cells.trial, range(some(1400))))
    assert min(counted["read"], counted["refused"]) > 10
