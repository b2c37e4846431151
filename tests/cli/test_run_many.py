from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.cli.conftest import Vrs

GOOD = '.PROGRAM one()\n    TYPE "one"\n    DRIVE 1, 10, 100\n.END\n.PROGRAM other()\n    TYPE "other"\n.END\n'
STOPS = '.PROGRAM two()\n    TYPE "two"\n    MOVE nowhere\n.END\n'
BAD = ".PROGRAM three()\n    MOVEE a\n.END\n"


@pytest.fixture(autouse=True)
def _files(tmp_path: Path) -> None:
    (tmp_path / "cell").mkdir()
    for name, text in (("1.v2", GOOD), ("2.v2", STOPS), ("3.v2", BAD)):
        (tmp_path / "cell" / name).write_text(text)


def test_each_file_is_executed_and_one_summary_ends_it(vrs: Vrs) -> None:
    ended = vrs("run", "cell")
    assert ended.status == 1
    assert ended.out == "==> cell/1.v2 <==\none\nProgram completed\n==> cell/2.v2 <==\ntwo\n==> cell/3.v2 <==\n"
    *_, first, second, third, last = ended.err.splitlines()
    assert (first[:9], first[-17:]) == ("cell/1.v2", "Program completed")
    assert (second[:9], second[-10:]) == ("cell/2.v2", " at step 2")
    assert third.split() == ["cell/3.v2", "not", "executed"]
    assert last == "3 files, 2 failures"
    assert "cell/3.v2:2:5: V452 *Unknown instruction* MOVEE" in ended.err


def test_a_run_of_several_does_what_each_does_alone(vrs: Vrs) -> None:
    alone = [json.loads(vrs("run", f"cell/{name}.v2", "--json").out) for name in (1, 2, 3)]
    together = json.loads(vrs("run", "cell/*.v2", "--json").out)["files"]
    assert together == [{"file": f"cell/{i}.v2", **found} for i, found in enumerate(alone, 1)]


def test_a_file_that_is_not_there_holds_up_no_other(vrs: Vrs) -> None:
    ended = vrs("run", "none.v2", "cell/1.v2", "--quiet")
    assert (ended.status, ended.out, ended.err) == (2, "one\n", "vrs run: *Nonexistent file* none.v2\n")


def test_a_name_behind_one_file_is_its_program(vrs: Vrs) -> None:
    assert vrs("run", "cell/1.v2", "other", "--quiet").out == "other\n"
    told = "other is no program file (of several files the first program of each is executed)"
    assert vrs("run", "cell/1.v2", "cell/2.v2", "other") == (2, "", f"vrs run: {told}\n")


@pytest.mark.parametrize("option", ["--save", "--csv", "--plot", "--report", "--record-units"])
def test_one_file_of_many_runs_is_refused(vrs: Vrs, tmp_path: Path, option: str) -> None:
    ended = vrs("run", "cell", option, "out.x")
    assert (ended.status, ended.out) == (2, "")
    assert ended.err == f"vrs run: {option} is for one file (run the files one by one for it)\n"
    assert not (tmp_path / "out.x").exists()
