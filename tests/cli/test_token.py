"""`vrs class token`."""

from __future__ import annotations

from pathlib import Path

import pytest

from vrs_cli.cli.main import run
from vrs_cli.net.tokens import read_tokens


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
