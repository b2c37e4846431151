from __future__ import annotations

import json
import os
import re
from itertools import product
from pathlib import Path

import pytest

from tests.cli.conftest import Vrs

GOOD = """\
.PROGRAM  good ; the best
  type  "x"  ;say it
if n>2 then
MOVE a
end
.END
.locations
a 1 2 3 90 -90 0
.end
"""
BAD = '.PROGRAM bad\n  MOVEE a\n  TYPE "x\n  GOTO 7\n.END\n'


@pytest.fixture(autouse=True)
def _files(tmp_path: Path) -> None:
    (tmp_path / "good.v2").write_text(GOOD)
    (tmp_path / "bad.v2").write_text(BAD)


def test_check_finds_every_mistake_with_its_place(vrs: Vrs) -> None:
    ended = vrs("check", "bad.v2")
    assert (ended.status, ended.err) == (1, "")
    places = [line.split(" ")[0] for line in ended.out.splitlines() if line.startswith("bad.v2:")]
    assert [place.split(":")[1] for place in places] == ["2", "3", "4"]
    assert "*Unknown instruction*" in ended.out
    assert ended.out.splitlines()[-1] == "3 errors, 0 warnings"


def test_a_file_without_fault_is_silent(vrs: Vrs, tmp_path: Path) -> None:
    (tmp_path / "ok.v2").write_text('.PROGRAM ok\n    TYPE "x"\n.END\n')
    assert vrs("check", "ok.v2") == (0, "", "")


def test_warnings_alone_are_no_failure(vrs: Vrs, tmp_path: Path) -> None:
    (tmp_path / "warn.v2").write_text(".PROGRAM warn\n    MOVE never.set\n.END\n")
    ended = vrs("check", "warn.v2")
    assert ended.status == 0
    assert "warning: " in ended.out
    assert ended.out.endswith("0 errors, 1 warning\n")


def test_what_the_cell_fills_has_a_value(vrs: Vrs, tmp_path: Path) -> None:
    (tmp_path / "seen.v2").write_text(".PROGRAM seen\n    TYPE found.x, $kind, other\n.END\n")
    (tmp_path / "cell.toml").write_text(
        '[[follow]]\nwhen = 4\nvariables = ["found.x", "$kind"]\nrows = [[400, "nut"], [420, "bolt"]]\n'
    )
    assert vrs("check", "seen.v2").out.endswith("0 errors, 3 warnings\n")
    ended = vrs("check", "seen.v2", "--cell", "cell.toml")
    assert "*Undefined value* other is given a value nowhere" in ended.out
    assert ended.out.endswith("0 errors, 1 warning\n")
    (tmp_path / "cell.toml").write_text("[[follow]]\nwhen = 4\n")
    refused = vrs("check", "seen.v2", "--cell", "cell.toml")
    assert (refused.status != 0, "nothing follows" in refused.err) == (True, True)


def test_check_in_json(vrs: Vrs) -> None:
    ended = vrs("check", "good.v2", "bad.v2", "--format", "json")
    assert ended.status == 1
    good, bad = json.loads(ended.out)["files"]
    assert good["path"] == "good.v2"
    assert [one["line"] for one in bad["diagnostics"]] == [2, 3, 4]
    first = bad["diagnostics"][0]
    assert (first["severity"], first["code"], first["column"], first["end"]) == ("error", -452, 3, 8)


def test_fmt_prints_and_changes_nothing(vrs: Vrs) -> None:
    ended = vrs("fmt", "good.v2")
    assert (ended.status, ended.err) == (0, "")
    assert Path("good.v2").read_text() == GOOD
    assert 'TYPE "x"' in ended.out
    assert "the best" in ended.out
    assert "say it" in ended.out


def test_fmt_writes_once_and_for_all(vrs: Vrs) -> None:
    printed = vrs("fmt", "good.v2").out
    assert vrs("fmt", "--check", "good.v2") == (1, "good.v2 would change\n", "")
    assert vrs("fmt", "--write", "good.v2") == (0, "good.v2 rewritten\n", "")
    assert Path("good.v2").read_text() == printed
    assert vrs("fmt", "--check", "good.v2") == (0, "", "")
    assert vrs("fmt", "--write", "good.v2") == (0, "", "")
    assert sorted(os.listdir()) == ["bad.v2", "good.v2"]


def test_fmt_leaves_a_file_with_mistakes_alone(vrs: Vrs) -> None:
    ended = vrs("fmt", "--write", "bad.v2", "good.v2")
    assert ended.status == 1
    assert "bad.v2:2:" in ended.err
    assert Path("bad.v2").read_text() == BAD
    assert ended.out == "good.v2 rewritten\n"


@pytest.mark.parametrize("body", ["FOR i = 1 TO 3\n  move a\n", "move a\nEND\n", "IF TRUE THEN\nUNTIL TRUE\nEND\n"])
@pytest.mark.parametrize("option", ["--write", "--check"])
def test_fmt_refuses_blocks_that_do_not_pair(vrs: Vrs, tmp_path: Path, body: str, option: str) -> None:
    text = f".PROGRAM p\n{body}.END\n"
    (tmp_path / "open.v2").write_text(text)
    ended = vrs("fmt", option, "open.v2")
    assert (ended.status, ended.out) == (1, "")
    assert "*Control structure error*" in ended.err
    assert (tmp_path / "open.v2").read_text() == text


@pytest.mark.parametrize("command", ["check", "fmt"])
@pytest.mark.parametrize(
    ("name", "status", "told"),
    [
        ("none.v2", 2, "*Nonexistent file* none.v2"),
        ("folder", 2, "*Nonexistent file* folder holds no program file (program files end in .v2 or .pg)"),
    ],
)
def test_a_file_that_is_not_there(vrs: Vrs, tmp_path: Path, command: str, name: str, status: int, told: str) -> None:
    (tmp_path / "folder").mkdir()
    ended = vrs(command, name)
    assert (ended.status, ended.out) == (status, "")
    assert ended.err.startswith(f"vrs {command}: {told}")


@pytest.mark.parametrize(("command", "output"), [("check", "out"), ("fmt", "err"), ("run", "err")])
def test_a_control_character_is_told_with_its_place(vrs: Vrs, tmp_path: Path, command: str, output: str) -> None:
    (tmp_path / "nul.v2").write_bytes(b'.PROGRAM a()\nTYPE "\x00"\n.END\n')
    ended = vrs(command, "nul.v2")
    assert ended.status == 1
    assert "nul.v2:2:7: V503 *File is not what it should be* character 0 in a text" in getattr(ended, output)


@pytest.mark.parametrize(
    "step",
    [
        "ENABLE COLOR.SPEED",
        "DISABLE FOO",
        "SWITCH FOO = ON",
        "PARAMETER FOO = 3",
        "IF x = = 3 THEN\nEND",
        "JMOVE a\nJMOVE b",
        "DRIVE 7, 10, 10",  # a warning: no run need come to it
        "ENABLE BELT",
        "CALL nowhere",
    ],
)
def test_run_executes_what_check_finds_no_error_in(vrs: Vrs, tmp_path: Path, step: str) -> None:
    (tmp_path / "a.v2").write_text(f'.PROGRAM a()\nTYPE "begun"\n{step}\n.END\n')
    checked, ran = vrs("check", "--format", "json", "a.v2"), vrs("run", "a.v2")
    (file,) = json.loads(checked.out)["files"]
    wrong = [one for one in file["diagnostics"] if one["severity"] == "error"]
    assert checked.status == (1 if wrong else 0)
    assert ran.out.startswith("begun") is not bool(wrong)
    assert all(f"a.v2:{one['line']}:{one['column']}: {one['label']}" in ran.err for one in wrong)


@pytest.mark.parametrize(("name", "line", "code"), [("nul.v2", 2, -503), ("none.v2", 1, -501)])
def test_json_tells_what_is_wrong_with_every_file(vrs: Vrs, tmp_path: Path, name: str, line: int, code: int) -> None:
    (tmp_path / "nul.v2").write_bytes(b'.PROGRAM a()\nTYPE "\x00"\n.END\n')
    ended = vrs("check", "--format", "json", name)
    (file,) = json.loads(ended.out)["files"]
    assert file["path"] == name
    assert [(one["line"], one["code"]) for one in file["diagnostics"]] == [(line, code)]
    assert ended.status != 0


def test_fmt_cannot_write_standard_input(vrs: Vrs) -> None:
    assert vrs("fmt", "--write", "-").err == "vrs fmt: --write cannot change standard input (leave --write out)\n"


def test_check_goes_on_after_a_file_that_cannot_be_read(vrs: Vrs, tmp_path: Path) -> None:
    (tmp_path / "bad.v2").write_text(BAD)
    ended = vrs("check", "none.v2", "bad.v2")
    assert ended.status == 2
    assert ended.err == "vrs check: *Nonexistent file* none.v2 (its folder has bad.v2, good.v2)\n"
    assert "bad.v2:2:" in ended.out


def test_lines_of_old_systems_are_shown_one_by_one(vrs: Vrs, tmp_path: Path) -> None:
    (tmp_path / "old.v2").write_bytes(b".PROGRAM a()\rTYPE 1\rMOVEX b\r.END\r")
    assert vrs("check", "old.v2").out.splitlines()[1:3] == ["MOVEX b", "^^^^^"]


def test_check_for_github(vrs: Vrs) -> None:
    ended = vrs("check", "bad.v2", "--format", "github")
    assert ended.status == 1
    first, *rest = ended.out.splitlines()
    place = "file=bad.v2,line=2,col=3,endColumn=8,title=Unknown instruction (V452)"
    assert first.startswith(f"::error {place}::*Unknown instruction* MOVEE")
    assert len(rest) == 2


def test_github_commands_are_escaped(vrs: Vrs, tmp_path: Path) -> None:
    (tmp_path / "a,b.v2").write_text(".PROGRAM p\n    %belt = 1\n.END\n")
    ended = vrs("check", "a,b.v2", "--format", "github")
    assert ended.out.startswith("::error file=a%2Cb.v2,line=2,")
    assert "%25belt" in ended.out


def test_check_knows_the_robot(vrs: Vrs, tmp_path: Path) -> None:
    (tmp_path / "far.v2").write_text(".PROGRAM p\n  MOVE a\n.END\n.LOCATIONS\na 5000 0 0 90 -90 0\n.END\n")
    ended = vrs("check", "far.v2")
    assert ended.status == 0
    assert "*Location too far*" in ended.out
    assert vrs("check", "far.v2", "--robot", "nobody").status == 2


# --- folders, codes, mends --------------------------------------------------------------------------------------

WARNS = """\
.PROGRAM warn
    MOVE a ; vrs: ignore V401
    WAIT 3
    b = 2
    IF b > 1 AND -b**2 < 3 THEN
        MOVE c
    END
.END
"""


def _codes(out: str) -> list[str]:
    return re.findall(r"\.v2:\d+:\d+: (V\d{3}) ", out)


def test_a_folder_stands_for_its_program_files(vrs: Vrs, tmp_path: Path) -> None:
    (tmp_path / "cell" / "deep").mkdir(parents=True)
    (tmp_path / "cell" / ".hidden").mkdir()
    for name in ("cell/a.v2", "cell/deep/b.PG", "cell/.hidden/c.v2", "cell/notes.txt"):
        (tmp_path / name).write_text(BAD)
    for named in (["cell"], ["cell/a.v2", "cell"], ["cell/**/*.[vP]*"]):
        found = json.loads(vrs("check", "--format", "json", *named).out)["files"]
        assert [one["path"] for one in found] == ["cell/a.v2", "cell/deep/b.PG"]
    assert vrs("fmt", "--check", "cell").err.count("*Unknown instruction*") == 2
    ended = vrs("check", "x*.v2")
    assert (ended.status, ended.err.split(" (")[0]) == (2, "vrs check: *Nonexistent file* no file fits x*.v2")


def test_files_that_are_named_are_checked_together(vrs: Vrs, tmp_path: Path) -> None:
    (tmp_path / "main.v2").write_text(".PROGRAM main()\n    CALL grip(1, 2)\n    TYPE total\n.END\n")
    (tmp_path / "lib.v2").write_text(".PROGRAM grip(n)\n    total = n\n.END\n")
    alone = vrs("check", "main.v2")
    assert (alone.status, _codes(alone.out)) == (0, ["V401"]), "a program beside it may be called"
    together = vrs("check", "main.v2", "lib.v2")
    assert (together.status, _codes(together.out)) == (1, ["V408"])
    (tmp_path / "main.v2").write_text("; with: lib.v2\n" + (tmp_path / "main.v2").read_text())
    named = json.loads(vrs("check", "main.v2", "--format", "json").out)["files"]
    assert [(one["path"], len(one["diagnostics"])) for one in named] == [("main.v2", 1), ("lib.v2", 0)]
    (tmp_path / "lib.v2").unlink()
    gone = vrs("check", "main.v2")
    assert (gone.status, "*Nonexistent file* main.v2:1: lib.v2" in gone.err) == (2, True)


def test_the_folder_is_one_name_space_with_project(vrs: Vrs, tmp_path: Path) -> None:
    (tmp_path / "cell").mkdir()
    (tmp_path / "cell" / "main.v2").write_text(".PROGRAM main()\n    CALL grip(1, 2)\n    MOVE part\n.END\n")
    (tmp_path / "cell" / "lib.v2").write_text(".PROGRAM grip(n)\n.END\n.LOCATIONS\npart 0 2000 0 90 90 0\n.END\n")
    assert _codes(vrs("check", "cell").out) == ["V401"]
    assert _codes(vrs("check", "cell", "--project").out) == ["V408", "V619"]


def test_codes_choose_warnings_and_never_hide_errors(vrs: Vrs, tmp_path: Path) -> None:
    (tmp_path / "warn.v2").write_text(WARNS)
    assert _codes(vrs("check", "warn.v2").out) == ["V066", "V056", "V056", "V401"]
    assert _codes(vrs("check", "warn.v2", "--ignore", "v056, V066").out) == ["V401"]
    assert _codes(vrs("check", "warn.v2", "--select", "V05", "--ignore", "V066").out) == ["V056", "V056"]
    assert _codes(vrs("check", "bad.v2", "--ignore", "V").out) == ["V452", "V460", "V412"]
    assert vrs("check", "warn.v2", "--select", "E501").err.startswith("vrs check: --select: 'E501' is no code, as V401")


def test_strict_fails_for_warnings(vrs: Vrs, tmp_path: Path) -> None:
    (tmp_path / "warn.v2").write_text(WARNS)
    assert vrs("check", "warn.v2").status == 0
    assert vrs("check", "--strict", "warn.v2").status == 1
    assert vrs("check", "--strict", "--ignore", "V", "warn.v2") == (0, "", "")


@pytest.mark.parametrize(
    ("comment", "left"),
    [("ignore-file", []), ("ignore-file V056 V066", ["V401"]), ("Ignore-File v401", ["V066", "V056", "V056"])],
)
def test_a_comment_does_without_warnings_of_a_file(vrs: Vrs, tmp_path: Path, comment: str, left: list[str]) -> None:
    (tmp_path / "warn.v2").write_text(f"; the cell. vrs: {comment}\n{WARNS}")
    assert _codes(vrs("check", "warn.v2").out) == left
    assert _codes(vrs("run", "warn.v2", "--max-time", "1").err) == left


def test_fix_writes_what_is_sure(vrs: Vrs, tmp_path: Path) -> None:
    text = WARNS.replace("b > 1", "b NE 1")
    (tmp_path / "warn.v2").write_text(text)
    ended = vrs("check", "--fix", "warn.v2")
    assert (ended.status, _codes(ended.out), ended.out.splitlines()[-1]) == (
        0,
        ["V066", "V401"],
        "0 errors, 2 warnings, 2 mended",
    )
    mended = (tmp_path / "warn.v2").read_text()
    changed = [(a, b) for a, b in zip(text.split("\n"), mended.split("\n"), strict=True) if a != b]
    assert changed == [
        ("    IF b NE 1 AND -b**2 < 3 THEN", "    IF (b <> 1) AND (((-b) ** 2) < 3) THEN"),
    ]
    assert _codes(vrs("check", "--fix", "warn.v2").out) == ["V066", "V401"]
    assert (tmp_path / "warn.v2").read_text() == mended
    assert vrs("check", "--fix", "-").status == 2


def test_a_mend_means_what_the_line_means(vrs: Vrs, tmp_path: Path) -> None:
    rows = [
        f"    TYPE {' '.join(f'{sign} {name}' if i else name for i, (sign, name) in enumerate(row))}"
        for row in product(
            [("AND", "a"), ("==", "-b**2")], [("OR", "NOT c"), ("<", "d")], [("BAND", "1"), ("XOR", "e")]
        )
    ]
    given = "".join(f"    {name} = {value}\n" for name, value in zip("abcde", (1, -2, 0, 3, -1), strict=True))
    (tmp_path / "mixed.v2").write_text(f".PROGRAM mixed()\n{given}" + "\n".join(rows) + "\n.END\n")
    before = vrs("run", "mixed.v2").out
    assert "mended" in vrs("check", "--fix", "mixed.v2").out
    assert vrs("check", "--strict", "mixed.v2") == (0, "", "")
    assert vrs("run", "mixed.v2").out == before


def test_watch_checks_again_when_a_file_changes(vrs: Vrs, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    changes = [lambda: None, lambda: (tmp_path / "bad.v2").write_text(GOOD), (tmp_path / "bad.v2").unlink]

    def sleep(_seconds: float) -> None:
        if not changes:
            raise KeyboardInterrupt
        changes.pop(0)()

    monkeypatch.setattr("time.sleep", sleep)
    ended = vrs("check", "--watch", "bad.v2")
    assert ended.status == 130
    assert ended.out.splitlines()[-1] == "0 errors, 2 warnings"
    assert "3 errors, 0 warnings" in ended.out
    assert ended.err.count("checked; Ctrl-C ends it") == 3
    assert "*Nonexistent file* bad.v2" in ended.err


def test_watch_looks_at_files_that_a_file_names(vrs: Vrs, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "main.v2").write_text("; with: lib.v2\n.PROGRAM main()\n    CALL grip(1)\n.END\n")
    (tmp_path / "lib.v2").write_text(".PROGRAM grip(n)\n.END\n")
    changes = [lambda: None, lambda: (tmp_path / "lib.v2").write_text(".PROGRAM grip()\n.END\n")]

    def sleep(_seconds: float) -> None:
        if not changes:
            raise KeyboardInterrupt
        changes.pop(0)()

    monkeypatch.setattr("time.sleep", sleep)
    ended = vrs("check", "--watch", "main.v2")
    assert ended.err.count("checked; Ctrl-C ends it") == 2
    assert "V408" in ended.out


def test_fmt_shows_the_difference(vrs: Vrs, tmp_path: Path) -> None:
    (tmp_path / "ragged.v2").write_text(".program a\ntype 1\n.end")
    ended = vrs("fmt", "--diff", "ragged.v2")
    assert (ended.status, ended.err) == (1, "")
    assert ended.out == (
        "--- ragged.v2\n+++ ragged.v2\n@@ -1,3 +1,3 @@\n-.program a\n-type 1\n-.end\n\\ No newline at end of file\n"
        "+.PROGRAM a()\n+    TYPE 1\n+.END\n"
    )
    vrs("fmt", "--write", "ragged.v2")
    assert vrs("fmt", "--diff", "ragged.v2") == (0, "", "")


def test_fix_with_diff_shows_and_writes_nothing(vrs: Vrs, tmp_path: Path) -> None:
    text = ".PROGRAM a()\n    x = 1\n    IF x EQ 1 THEN\n        TYPE x\n    END\n.END\n"
    (tmp_path / "a.v2").write_text(text)
    (tmp_path / "b.v2").write_text(".PROGRAM b()\n.END\n")
    ended = vrs("check", "--fix", "--diff", "a.v2", "b.v2")
    assert (ended.status, ended.err) == (1, "")
    assert ended.out.splitlines()[:2] == ["--- a.v2", "+++ a.v2"]
    assert [line for line in ended.out.splitlines() if line[0] in "+-"][2:] == [
        "-    IF x EQ 1 THEN",
        "+    IF x == 1 THEN",
    ]
    assert (tmp_path / "a.v2").read_text() == text
    assert vrs("check", "--fix", "a.v2").status == 0
    assert vrs("check", "--fix", "--diff", "a.v2") == (0, "", "")
    assert vrs("check", "--diff", "a.v2").status == 2


OLD = ".PROGRAM old()\n    a = 5\n    IF NOT a == 5 GOTO 10\n    TYPE RX(3)\n10  TYPE 1\n.END\n"


def test_the_dialect_of_files_that_say_none(vrs: Vrs, tmp_path: Path) -> None:
    (tmp_path / "old.v2").write_text(OLD.replace("    TYPE RX(3)\n", ""))
    (tmp_path / "new.v2").write_text(OLD)
    assert vrs("check", "--dialect", "val2", "old.v2").status == 0
    refused = vrs("check", "--dialect", "val2", "new.v2")
    assert refused.status == 1
    assert "RX is of V+, and this program is in VAL-II" in refused.out
    assert "IF (NOT a) == 5 GOTO 10" in vrs("fmt", "--dialect", "val2", "old.v2").out
    assert "IF NOT a == 5 GOTO 10" in vrs("fmt", "old.v2").out


def test_a_file_in_another_language_is_named(vrs: Vrs, tmp_path: Path) -> None:
    (tmp_path / "main.src").write_text("DEF main( )\nPTP HOME\nEND\n")
    ended = vrs("check", "main.src")
    assert ended.status == 1
    assert "this file is in KRL (KUKA), not in VAL-II" in ended.out
    assert ended.out.splitlines()[-1] == "1 error, 0 warnings"
