from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.cli.conftest import Vrs
from vrs_cli.cli.run import UNWATCHED_LIMITS
from vrs_cli.interfaces.tasks.limits import OWN, Limits

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


def test_a_name_behind_files_is_their_program(vrs: Vrs) -> None:
    assert vrs("run", "cell/1.v2", "other", "--quiet").out == "other\n"
    assert vrs("run", "cell/2.v2", "cell/1.v2", "other", "--quiet").out == "other\n"


# --- files of one name space ---

MAIN = """\
.PROGRAM main()
    CALL grip(3)
    TYPE total
.END
"""
LIB = """\
.PROGRAM grip(n)
    total = n+step
    IF n > 5 THEN
        MOVE nowhere
    END
.END
.REALS
step = 2
.END
"""


@pytest.fixture
def project(tmp_path: Path) -> Path:
    folder = tmp_path / "project"
    (folder / "more").mkdir(parents=True)
    (folder / "main.v2").write_text(MAIN)
    (folder / "lib.v2").write_text(LIB)
    (folder / "with.v2").write_text(f"; with: lib.v2\n{MAIN}".replace("main()", "with()"))
    return folder


@pytest.mark.usefixtures("project")
def test_files_that_are_named_are_one_name_space(vrs: Vrs) -> None:
    ended = vrs("run", "project/main.v2", "project/lib.v2", "--quiet")
    assert (ended.status, ended.out) == (0, " 5\n")
    alone = vrs("run", "project/main.v2")
    assert alone.status == 1
    assert "grip is not in memory (lib.v2 has it: `; with: lib.v2` above the first program loads it)" in alone.err


def test_a_comment_names_files_that_belong_to_a_file(vrs: Vrs, project: Path) -> None:
    (project / "more" / "top.v2").write_text(f"; with: ../with.v2, ../lib.v2\n{MAIN}".replace("main()", "top()"))
    (project / "lib.v2").write_text(f"; with: with.v2\n{LIB}")  # a circle
    assert vrs("run", "project/with.v2", "--quiet").out == " 5\n"
    assert vrs("run", "project/more/top.v2", "--quiet").out == " 5\n"
    assert vrs("run", "project/more/top.v2", "--sandbox", "box").status != 0  # leads out of its folder
    (project / "with.v2").write_text("; with: gone.v2\n.PROGRAM with()\n.END\n")
    ended = vrs("run", "project/with.v2")
    assert (ended.status, ended.err.count("*Nonexistent file* project/with.v2:1: project/gone.v2")) == (2, 1)


def test_a_folder_is_one_name_space_when_it_is_asked_for(vrs: Vrs, project: Path) -> None:
    assert vrs("run", "project", "--project", "--quiet").out == " 5\n"  # main
    assert vrs("run", "project", "with", "--project", "--quiet").out == " 5\n"
    (project / "main.v2").write_text(MAIN.replace("main()", "first()"))
    ended = vrs("run", "project", "--project")
    assert ended.status == 2
    assert ended.err.endswith("vrs run: which program of the project? (name one behind the folder: first, with)\n")
    apart = vrs("run", "project", "--quiet")
    assert apart.status == 1, "each file by itself"


def test_a_fault_is_told_with_its_file(vrs: Vrs, project: Path) -> None:
    (project / "main.v2").write_text(MAIN.replace("3", "7"))
    ended = vrs("run", "project/main.v2", "project/lib.v2")
    assert ended.status == 1
    assert "project/lib.v2:4: *Undefined value* nowhere" in ended.err
    (error,) = json.loads(vrs("run", "project/main.v2", "project/lib.v2", "--json").out)["errors"]
    assert (error["file"], error["line"]) == ("project/lib.v2", 4)


def test_mistakes_across_files_keep_them_from_running(vrs: Vrs, project: Path) -> None:
    (project / "main.v2").write_text(MAIN.replace("grip(3)", "grip(3, 4)"))
    ended = vrs("run", "project/main.v2", "project/lib.v2")
    assert ended.status == 1
    assert "project/main.v2:2:10: V408 *Program argument mismatch* grip is given 2 arguments" in ended.err
    (project / "main.v2").write_text(MAIN + LIB)
    ended = vrs("run", "project/main.v2", "project/lib.v2")
    assert "project/lib.v2:1:10: V309 *Program already exists* grip is in another of these files too" in ended.err
    checked = vrs("check", "project/main.v2", "project/lib.v2")
    assert checked.status == 1
    assert "grip is in another of these files too" in checked.out


@pytest.mark.parametrize("option", ["--save", "--csv", "--plot", "--report", "--record-units"])
def test_one_file_of_many_runs_is_refused(vrs: Vrs, tmp_path: Path, option: str) -> None:
    ended = vrs("run", "cell", option, "out.x")
    assert (ended.status, ended.out) == (2, "")
    assert ended.err == f"vrs run: {option} is for one file (run the files one by one for it)\n"
    assert not (tmp_path / "out.x").exists()


LOGS = """\
.PROGRAM {name}()
    ATTACH (5)
    FOPENR (5) "given.txt"
    READ (5) $given
    FCLOSE (5)
    FOPENW (5) "log.txt"
    TYPE $given, IOSTAT(5)
    WRITE (5) "{name}"
    FCLOSE (5)
    FDELETE (5) "{other}.v2"
    TYPE IOSTAT(5)
    FDELETE (5) "given.txt"
.END
"""


@pytest.fixture
def logs(tmp_path: Path) -> Path:
    (tmp_path / "logs").mkdir()
    (tmp_path / "logs" / "given.txt").write_text("given\n")
    for name, other in (("a", "b"), ("b", "a")):
        (tmp_path / "logs" / f"{name}.v2").write_text(LOGS.format(name=name, other=other))
    return tmp_path / "logs"


def contents(folder: Path) -> dict[str, str]:
    return {path.relative_to(folder).as_posix(): path.read_text() for path in folder.rglob("*") if path.is_file()}


def test_each_file_has_a_working_folder_of_its_own(vrs: Vrs, logs: Path) -> None:
    before = contents(logs)
    for pattern in ("logs", "logs/*.v2"):
        ended = vrs("run", pattern, "--json")
        assert [found["typed"] for found in json.loads(ended.out)["files"]] == [["given 1", " 1"]] * 2
        assert contents(logs) == before


def test_what_each_file_wrote_is_kept_on_request(vrs: Vrs, logs: Path, tmp_path: Path) -> None:
    before = contents(logs)
    assert vrs("run", "logs", "--keep", "kept").status == 0
    assert contents(tmp_path / "kept") == {"a.v2/log.txt": "a\n", "b.v2/log.txt": "b\n"}
    assert contents(logs) == before
    ended = vrs("run", "logs/a.v2", "--keep", "kept")
    assert (ended.status, "--keep is for the files of a folder" in ended.err) == (2, True)


def test_each_file_has_a_part_of_the_sandbox(vrs: Vrs, logs: Path, tmp_path: Path) -> None:
    (tmp_path / "box").mkdir()
    (tmp_path / "box" / "given.txt").write_text("boxed\n")
    ended = vrs("run", str(logs), "--sandbox", "box", "--json")
    typed = [found["typed"] for found in json.loads(ended.out)["files"]]
    assert typed == [["boxed 1", "-501"]] * 2
    assert contents(tmp_path / "box") == {"given.txt": "boxed\n", "a.v2/log.txt": "a\n", "b.v2/log.txt": "b\n"}


@pytest.mark.parametrize(
    "name", ["../secret.txt", "/etc/hostname", "link.txt", "linked/secret.txt", "below/../../secret.txt", "."]
)
@pytest.mark.parametrize("word", ["FOPENR", "FOPENW", "FOPENA", "FDELETE"])
def test_no_file_of_a_folder_run_leaves_its_folder(vrs: Vrs, logs: Path, tmp_path: Path, word: str, name: str) -> None:
    (tmp_path / "secret.txt").write_text("secret\n")
    (logs / "link.txt").symlink_to(tmp_path / "secret.txt")
    (logs / "linked").symlink_to(tmp_path)
    (logs / "a.v2").write_text(
        f'.PROGRAM a()\n ATTACH (5)\n {word} (5) "{name}"\n READ (5) $x\n'
        " IF IOSTAT(5) == 1 THEN\n  TYPE $x\n END\n.END\n"
    )
    before = contents(tmp_path)
    ended = vrs("run", "logs")
    assert "secret" not in ended.out
    assert contents(tmp_path) == before


def test_an_endless_loop_of_a_folder_run_ends_by_its_limit(vrs: Vrs, logs: Path) -> None:
    (logs / "a.v2").write_text(".PROGRAM a()\n10 GOTO 10\n.END\n")
    ended = vrs("run", "logs", "--max-steps", "100K")
    assert ended.status == 1
    assert "running after 100000 steps: a step 1 is busy at 10 GOTO 10 (give it more with --max-steps)" in ended.err
    path, *_, outcome = ended.err.splitlines()[-2].split(maxsplit=3)
    assert (path, outcome) == ("logs/b.v2", "Program completed")


def test_help_says_what_limits_hold(vrs: Vrs) -> None:
    told = " ".join(vrs("run", "--help-all").out.split())
    usual, own = Limits(), OWN
    assert (usual.max_time, own.max_time) == (3600.0, 86_400.0)
    assert "(default: a day, 86400; or an hour, 3600)" in told
    assert (usual.max_steps, own.max_steps) == (10_000_000, 100_000_000)
    assert "(default: 100M, in real time any number; or 10M)" in told
    assert usual.max_elements == own.max_elements == 10_000_000
    assert (usual.max_output, own.max_output) == (1_000_000, 100_000_000)
    assert "output of TYPE (default: 100M; or 1M)" in told
    assert (usual.max_disk, own.max_disk) == (10_000_000, 1_000_000_000)
    assert "written to files (default: 1G; or 10M)" in told
    assert (UNWATCHED_LIMITS["max_wall"], UNWATCHED_LIMITS["max_memory"]) == (300.0, 4_000_000_000)
    assert "(default: any; or 300)" in told
    assert "(default: any; or 4G)" in told


def test_a_folder_run_of_one_file_is_apart_too(vrs: Vrs, logs: Path) -> None:
    (logs / "b.v2").unlink()
    before = contents(logs)
    assert vrs("run", "logs", "--quiet").out == "given 1\n-501\n"
    assert contents(logs) == before
