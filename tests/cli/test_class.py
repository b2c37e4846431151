"""`vrs class`, from the names of students to their removal."""

from __future__ import annotations

from pathlib import Path
from urllib.parse import unquote

import pytest

from vrs_cli.cli.main import run
from vrs_cli.net.tokens import ClassFolder, read_tokens


def test_a_class_from_its_names_to_its_programs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("names.txt").write_text("bob\n\ncarl\n")
    assert run(["class", "new", "9b", "ada", "--names", "names.txt"]) == 0
    assert "3 students" in capsys.readouterr().out
    assert (Path("9b").stat().st_mode & 0o77, Path("9b/tokens.toml").stat().st_mode & 0o77) == (0, 0)
    assert run(["class", "new", "9b", "dora"]) == 0
    capsys.readouterr()
    assert run(["class", "links", "9b", "--at", "https://robots.school:8765"]) == 0
    links = dict(line.split() for line in capsys.readouterr().out.splitlines())
    assert list(links) == ["teacher", "ada", "bob", "carl", "dora"]
    assert links["teacher"].startswith("https://robots.school:8765/wall#token=")
    assert links["ada"].startswith("https://robots.school:8765/view/ada#token=")
    for name, link in links.items():
        grant = read_tokens(Path("9b/tokens.toml")).find(unquote(link.partition("#token=")[2]), 0.0)
        assert grant is not None
        assert (grant.name, grant.teacher) == (name, name == "teacher")
    ClassFolder(Path("9b")).hand_in("ada", "pick", "DRIVE 1, 10", 0.0)
    assert run(["class", "collect", "9b", "--to", "monday"]) == 0
    assert "1 program in monday; nothing of bob, carl, dora" in capsys.readouterr().out
    assert Path("monday/ada.v2").read_text() == "DRIVE 1, 10"
    assert run(["class", "forget", "9b", "ada"]) == 0
    assert not Path("9b/hand-ins/ada").exists()
    assert run(["class", "links", "9b", "ada"]) == 2


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["new", "new"], "students"),
        (["new", "9b", "ada"], "ada"),
        (["new", "9b", "x y"], "no name"),
        (["new", "9b", "Teacher"], "no name"),
        (["new", "9b", "eve", "EVE"], "twice"),
        (["new", "9b", "ada-2"], "for itself"),
        (["new", "9b", "--names", "none.txt"], "none.txt"),
        (["links", "none"], "no class"),
        (["links", "9b", "eve"], "eve"),
        (["links", "9b", "--at", "robots.school"], "--at"),
        (["links", "9b", "--to", "x"], "--to"),
        (["collect", "9b", "ada"], "all"),
        (["forget", "9b"], "whom"),
        (["forget", "9b", "../9b"], "no student"),
        (["burn", "9b"], "burn"),
    ],
)
def test_mistakes_change_nothing(
    arguments: list[str], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    ClassFolder(Path("9b")).make(["ada"])
    before = Path("9b/tokens.toml").read_bytes()
    assert run(["class", *arguments]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1
    assert Path("9b/tokens.toml").read_bytes() == before


def test_tokens_for_a_class(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "class.toml"
    assert run(["class", "token", "ada", "bob", "--file", str(path)]) == 0
    assert run(["class", "token", "tom", "--file", str(path), "--role", "teacher", "--expires", "2027-07-31"]) == 0
    assert run(["class", "token", "eve", "--file", str(path), "--role", "observer", "--robots", "cell1,cell2"]) == 0
    printed = dict(line.split() for line in capsys.readouterr().out.splitlines())
    found = read_tokens(path)
    for name, token in printed.items():
        grant = found.find(token, 0.0)
        assert grant is not None and grant.name == name  # noqa: PT018
    assert [grant.teacher for grant in found.grants] == [False, False, True, False]
    assert found.grants[3].robots == {"cell1", "cell2"}
    assert run(["class", "token", "ada", "--file", str(path), "--revoke"]) == 0
    assert [grant.name for grant in read_tokens(path).grants] == ["bob", "tom", "eve"]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["ada"], "--file"),
        (["ada b", "--file", "x.toml"], "no name"),
        (["ada", "--file", "x.toml", "--expires", "soon"], "no day"),
        (["ada", "--file", "x.toml", "--revoke"], "x.toml"),
        (["ada", "--file", "x.toml", "--role", "king"], "king"),
    ],
)
def test_mistakes(
    arguments: list[str], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(["class", "token", *arguments]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1
