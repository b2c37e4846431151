"""vrs connect URL --put FILE, --get NAME: files go to a robot that is served and come back, whole or not at all."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.net.serving import Serving, serving
from vrs_cli.cli.main import run
from vrs_cli.cli.remote import token_of


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Serving]:
    folder = tmp_path_factory.mktemp("served")
    tokens = folder / "tokens.toml"
    tokens.write_text(
        '[[token]]\nname = "ada"\ntoken = "the token of ada"\n'
        '[[token]]\nname = "bob"\ntoken = "the token of bob"\nrole = "observer"\n'
    )
    with serving(folder, tokens=tokens) as it:
        yield it


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("VRS_TOKEN", "the token of ada")
    return tmp_path


def test_a_file_there_and_back(served: Serving, here: Path, capfdbinary: pytest.CaptureFixture[bytes]) -> None:
    data = bytes(range(256)) * 1000
    (here / "a.bin").write_bytes(data)
    assert run(["connect", served.address, "--put", "a.bin"]) == 0
    assert run(["connect", served.address, "--get", "a.bin", "-o", "b.bin"]) == 0
    assert (here / "b.bin").read_bytes() == data
    assert run(["connect", served.address, "--put", "a.bin", "--as", "c.bin"]) == 0
    assert run(["connect", served.address, "--get", "c.bin", "-o", "-"]) == 0
    assert capfdbinary.readouterr() == (data, b"")


def test_nothing_is_overwritten_unless_that_is_said(
    served: Serving, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (here / "d.v2").write_text("one")
    assert run(["connect", served.address, "--put", "d.v2"]) == 0
    (here / "d.v2").write_text("two")
    assert run(["connect", served.address, "--put", "d.v2"]) != 0
    assert "d.v2 (--replace overwrites it)" in capsys.readouterr().err
    assert run(["connect", served.address, "--get", "d.v2"]) != 0
    assert "d.v2 (--replace overwrites it, -o names another)" in capsys.readouterr().err
    assert (here / "d.v2").read_text() == "two"
    assert run(["connect", served.address, "--get", "d.v2", "--replace"]) == 0
    assert (here / "d.v2").read_text() == "one"


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["connect", "{url}", "--put", "none.v2"], "none.v2 cannot be read: no such file or directory"),
        (["connect", "{url}", "--get", "none.v2"], "Nonexistent file"),
        (["connect", "{url}", "--get", "../secret"], "File outside"),
        (["connect", "ws://127.0.0.1:1", "--get", "a"], "ws://127.0.0.1:1 does not answer: connection refused"),
        (["connect", "http://127.0.0.1", "--get", "a"], "http://127.0.0.1 is no address of a robot"),
        (["connect", "{url}/robots/none", "--get", "a"], "there is no robot none"),
        (["connect", "{url}/elsewhere", "--get", "a"], "/elsewhere answers 404"),
        (["connect", "{url}", "--get", "a", "--token-file", "none"], "--token-file: none cannot be read"),
        (
            ["connect", "wss://127.0.0.1", "--get", "a", "--ca", "none"],
            "none cannot be read: no such file or directory",
        ),
        (["connect", "--get", "a"], "the following arguments are required: URL"),
    ],
)
def test_what_is_wrong_is_one_line(
    served: Serving, capsys: pytest.CaptureFixture[str], arguments: list[str], said: str
) -> None:
    assert run([word.replace("{url}", served.address) for word in arguments]) != 0
    shown = capsys.readouterr()
    assert said in shown.err
    assert shown.err.count("\n") == 1
    assert not shown.out


@pytest.mark.parametrize("before", ["", "ada "])
def test_a_token_file_is_also_what_vrs_token_wrote(tmp_path: Path, before: str) -> None:
    token, file = "abcdefghijklmnopqrstuvwxyz012345", tmp_path / "token"
    file.write_text(f"{before}{token}\n")
    assert token_of(str(file)) == token


def test_who_may_not_is_told(
    served: Serving, here: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (here / "token").write_text("the token of bob\n")
    (here / "a.v2").write_text("")
    assert run(["connect", served.address, "--put", "a.v2", "--token-file", "token"]) != 0
    assert "is for a supervisor" in capsys.readouterr().err
    monkeypatch.setenv("VRS_TOKEN", "no such token here")
    assert run(["connect", served.address, "--get", "b.v2"]) != 0
    assert "this token is not known here" in capsys.readouterr().err
