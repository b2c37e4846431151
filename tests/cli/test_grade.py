from __future__ import annotations

import csv
import json
import os
import random
import re
import shutil
import signal
import subprocess
import sys
from io import StringIO
from pathlib import Path

import pytest

from tests.cli.conftest import Vrs
from tests.live import until
from tests.page.browser import page_folder
from tests.teach.runs import PICK
from tests.teach.test_grading import COPIED, LOOP
from vrs_cli.cli.grade import find_submissions

MODEL = (PICK / "teacher" / "model.v2").read_text(encoding="utf-8")
BAD = ".PROGRAM pick()\n  MOVEE part\n.END\n"


@pytest.fixture
def school(tmp_path: Path) -> Path:
    """A class: files, a folder with a file, a folder without one, a link."""
    folder = tmp_path / "class"
    (folder / "carl").mkdir(parents=True)
    (folder / "dora").mkdir()
    for name, text in (("ann.v2", MODEL), ("bob.v2", BAD), ("carl/robot.v2", COPIED)):
        (folder / name).write_text(text, encoding="utf-8")
    return folder


def test_a_class_becomes_a_table_and_files(vrs: Vrs, school: Path, tmp_path: Path) -> None:
    ended = vrs("grade", PICK, school.name, "--json", "all.json", "--csv", "all.csv", "--junit", "all.xml")
    assert (ended.status, ended.err) == (1, "")  # dora's was not graded
    head, *rows = ended.out.splitlines()
    assert head.split() == ["student", "points", "of", "why"]
    assert [row.split()[:3] for row in rows[:4]] == [
        ["ann", "8", "8"],
        ["bob", "0", "8"],
        ["carl", "3.5", "8"],
        ["dora", "-", "8"],
    ]
    assert "not executed: line 2: *Unknown instruction* MOVEE" in rows[1]
    assert rows[3].endswith("not graded: the folder holds 0 program files, and one is wanted")
    assert rows[4] == "3 submissions graded, 1 not, 3.83 of 8 points on the average"
    found = json.loads((tmp_path / "all.json").read_text())
    assert rows[5] == f"digest {found['digest']}"
    assert [one["student"] for one in found["submissions"]] == ["ann", "bob", "carl", "dora"]
    table = list(csv.reader(StringIO((tmp_path / "all.csv").read_text())))
    assert [row[3] for row in table] == ["points", "8", "0", "3.5", ""]
    assert (tmp_path / "all.xml").read_text().startswith("<?xml")


@pytest.mark.long
def test_marks_are_the_same_wherever_and_however_they_are_made(
    vrs: Vrs, school: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (school / "loop.v2").write_text(LOOP)
    files = sorted(str(path.relative_to(school.parent)) for path in school.iterdir())
    first = vrs("grade", PICK, *files, "--json", "-", "--jobs", 1).out
    random.Random(1).shuffle(files)
    for name, value in (("TZ", "Asia/Kathmandu"), ("LC_ALL", "tr_TR.UTF-8"), ("PYTHONHASHSEED", "77")):
        monkeypatch.setenv(name, value)
    shutil.move(school, school.parent / "elsewhere")
    moved = [name.replace("class", "elsewhere") for name in files]
    assert vrs("grade", PICK, *moved, "--json", "-", "--jobs", 3).out == first


@pytest.mark.usefixtures("school")
def test_files_for_students_of_one_and_of_several(vrs: Vrs, tmp_path: Path) -> None:
    assert vrs("grade", PICK, "class/ann.v2", "--gradescope", "r.json", "--check50", "-").status == 0
    assert json.loads((tmp_path / "r.json").read_text())["score"] == 8.0
    ended = vrs("grade", PICK, "class", "--gradescope", "marks", "--quiet")
    assert (ended.status, ended.out, ended.err) == (1, "", "")
    assert sorted(path.name for path in (tmp_path / "marks").iterdir()) == [
        "ann.json",
        "bob.json",
        "carl.json",
        "dora.json",
    ]
    refused = vrs("grade", PICK, "class", "--check50", "r.json")
    what = "--check50 r.json is one file, and there are several submissions"
    assert refused == (2, "", f"vrs grade: {what} (name a folder, in which each has a file: --check50 marks)\n")


def test_what_is_wrong_is_said_in_one_line(vrs: Vrs, school: Path) -> None:
    for words, said in (
        (["grade"], "an exercise and submissions are wanted (vrs grade pick class)"),
        (["grade", PICK], "an exercise and submissions are wanted (vrs grade pick class)"),
        (["grade", "nothing", "class"], "*Nonexistent file* there is no exercise nothing"),
        (["grade", "class", "class"], "is no exercise: it has no folder teacher"),
        (["grade", PICK, "nobody.v2"], "*Nonexistent file* nobody.v2"),
        (["grade", PICK, "class/*.pg"], "no file fits class/*.pg"),
        (["grade", PICK, "class", "--json", "-", "--csv", "-"], "two outputs want standard output"),
        (["grade", PICK, "class", "--json", "x", "--csv", "x"], "x is named twice"),
        (["grade", PICK, "class", "--json", "none/x"], "none"),
    ):
        ended = vrs(*words)
        assert (ended.status, ended.out) == (2, "")
        assert said in ended.err
        assert ended.err.count("\n") == 1
    assert list(school.iterdir())


# --- which submissions are meant -------------------------------------------------------------------------------------


def students(*named: str) -> list[str]:
    """The students that words of a command line mean."""
    return [f"{one.student}: {'-' if one.unread else one.file}" for one in find_submissions(named)]


def test_submissions_are_called_after_their_files_or_folders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("a/ann.v2", "a/.hidden.v2", "a/notes.txt", "b/ben/robot.v2", "b/bea/x/robot.V2", "c/robot.v2"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(BAD)
    assert students("a/ann.v2") == ["ann: ann.v2"]
    assert students("c") == ["c: robot.v2"]
    assert students("b") == ["bea: robot.V2", "ben: robot.v2"]
    assert students("b/b*n", "c") == ["ben: robot.v2", "c: robot.v2"]
    assert students("b/ben/robot.v2", "c/robot.v2") == ["ben: robot.v2", "c: robot.v2"]
    assert students("b/ben", "c", "b", "./c") == ["bea: robot.V2", "ben: robot.v2", "c: robot.v2"]
    assert students("b/ben/robot.v2", "c/robot.v2", "a/ann.v2") == [
        "a/ann: ann.v2",
        "ben/robot: robot.v2",
        "c/robot: robot.v2",
    ]


@pytest.mark.skipif(os.name == "nt", reason="links and pipes of POSIX systems")
def test_links_and_pipes_are_not_read(tmp_path: Path) -> None:
    (tmp_path / "class").mkdir()
    (tmp_path / "class" / "ann.v2").write_text(BAD)
    (tmp_path / "class" / "bob.v2").symlink_to("ann.v2")
    (tmp_path / "class" / "eve").symlink_to(tmp_path)
    os.mkfifo(tmp_path / "class" / "pipe.v2")
    (tmp_path / "class" / "long.v2").write_bytes(b"; " * 600_000)
    found = find_submissions([str(tmp_path / "class")])
    assert [one.student for one in found if not one.unread] == ["ann"]
    assert {one.student: one.unread for one in found if one.unread} == {
        "bob": "the file cannot be read: it is a link, a device or a pipe",
        "eve": "the file cannot be read: it is a link, a device or a pipe",
        "pipe": "the file cannot be read: it is a link, a device or a pipe",
        "long": "the file cannot be read: it has more than 1000000 bytes",
    }


def test_an_exercise_is_checked(vrs: Vrs, tmp_path: Path) -> None:
    assert vrs("grade", "--check", PICK).out == "Pick and place: no mistakes in 5 checks\n"
    shutil.copytree(PICK, tmp_path / "mine")
    checks = tmp_path / "mine" / "teacher" / "checks.toml"
    checks.write_text(
        checks.read_text().replace('lines = ["done"]', 'lines = ["ready"]').replace("seed = [1, 2]", "seed = 1")
    )
    ended = vrs("grade", "--check", "mine")
    assert ended.status == 1
    first, last = ended.out.splitlines()
    assert f'{checks}:25: It says done: the model fails it: "ready" was not typed' in first
    assert last == "1 mistake and 0 warnings"
    checks.write_text(checks.read_text().replace("mm = 2", "mm = 2\nfoo = 3").replace("[similar]", ""))
    ended = vrs("grade", "--check", "mine")
    assert (ended.status, ended.err) == (1, "")
    assert "checks.toml:15: [[check]] 1: foo: there are kind, name" in ended.out
    assert ended.out.endswith("1 mistake (docs/exercises.md describes the files of an exercise)\n")
    ended = vrs("grade", "--check", "nowhere")
    assert ended.status == 2
    assert "there is no exercise nowhere" in ended.err


def test_an_exercise_is_proposed_from_a_solution(vrs: Vrs, tmp_path: Path) -> None:
    (tmp_path / "turn.v2").write_text(".PROGRAM turn()\n  DRIVE 1, 30, 100\n.END\n")
    ended = vrs("grade", "--new", "mine", "turn.v2")
    assert (ended.status, ended.err) == (0, "")
    assert ended.out.endswith("mine is written: complete exercise/text.md; then vrs grade --check mine\n")
    checked = vrs("grade", "--check", "mine")
    assert checked.status == 0
    assert checked.out.endswith("0 mistakes and 1 warning\n")
    again = vrs("grade", "--new", "mine", "turn.v2")
    what = "*File already exists* mine is there already (give another name: nothing is overwritten)"
    assert again == (2, "", f"vrs grade: {what}\n")
    refused = vrs("grade", "--new", "other")
    assert refused == (2, "", "vrs grade: --new wants a name and one solution (vrs grade --new pick solution.v2)\n")
    assert vrs("grade", PICK, "turn.v2", "--cell", "c.toml").status == 2


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX systems")
def test_a_signal_ends_all_and_what_was_graded_is_told(tmp_path: Path) -> None:
    (tmp_path / "class").mkdir()
    for number in range(8):
        (tmp_path / "class" / f"{number}.v2").write_text(MODEL)
    command = [sys.executable, "-m", "vrs_cli", "grade", str(PICK), "class", "--jobs", "1", "--json", "all.json"]
    environment = {**os.environ, "TMPDIR": str(tmp_path)}
    running = subprocess.Popen(
        command, cwd=tmp_path, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    until(lambda: list(tmp_path.glob("vrs-grade-*/1")), "the second one is graded")
    running.send_signal(signal.SIGTERM)  # Ctrl-C goes the same way
    out, err = running.communicate(timeout=60)
    assert running.returncode == 143
    assert out.splitlines()[1].split()[1:] == ["8", "8"]
    assert re.fullmatch(
        r"vrs grade: [1-7] of 8 submissions graded; no file of results is written\nvrs grade: terminated\n", err
    )
    assert [path.name for path in tmp_path.iterdir()] == ["class"]


def test_pages_share_a_viewer_and_students_get_a_folder(vrs: Vrs, school: Path, tmp_path: Path) -> None:
    (school / "<b>eve.v2").write_text(LOOP)
    page_folder()
    assert vrs("grade", PICK, "class/carl", "class/<b>eve.v2", "class/dora", "--html", "pages").status == 1
    pages = tmp_path / "pages"
    names = {str(path.relative_to(pages)) for path in pages.rglob("*") if path.is_file()}
    students = {f"students/{name}" for name in ("carl.html", "_b_eve.html", "dora.html", "viewer.html")}
    assert names == {"teacher.html", *students, "students/replays/carl.js"}
    assert 'src="viewer.html#carl"' in (pages / "students" / "carl.html").read_text()
    replay = (pages / "students" / "replays" / "carl.js").read_text()
    assert len(replay) < 30_000, "the robot is in the viewer, once for all"
    shown = json.loads(replay.removeprefix("replay(").removesuffix(")\n"))
    begin, end = shown["between"]
    segments = shown["snapshot"]["segments"]
    assert segments[0]["start"] <= begin < end <= segments[-1]["finish"]
    assert "model" not in shown
    assert shown["world"]["rows"]["parts"].keys() == {"box"}
    assert 'href="students/_b_eve.html"><bdi>&lt;b&gt;eve' in (pages / "teacher.html").read_text()
