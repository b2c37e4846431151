"""Tokens: who gets in, as what; files of tokens, wrong ones, and ones that change."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from vrs_cli.errors import FileDamaged, FileError, UsageError
from vrs_cli.language.words.word import Role
from vrs_cli.net import tokens
from vrs_cli.net.tokens import Grant, TokenFile, Tokens, add_tokens, digest_of, good_name, read_tokens, take_out

ADA, BOB = "the long token of ada", "the long token of bob"


def written(folder: Path, text: str) -> Path:
    path = folder / "tokens.toml"
    path.write_text(text)
    return path


def row(name: str, token: str, more: str = "") -> str:
    return f'[[token]]\nname = "{name}"\ntoken = "{token}"\n{more}\n'


def changed(file: TokenFile) -> bool:
    """What two looks find: the first one sees that the file is another one, the second that it stays so."""
    return file.look() or file.look()


def test_a_token_gives_a_role_and_robots(tmp_path: Path) -> None:
    text = row("ada", ADA, 'role = "observer"\nrobots = ["cell1"]') + (
        f'[[token]]\nname = "bob"\nsha256 = "{digest_of(BOB).hex()}"\nrole = "teacher"\n'
    )
    found = read_tokens(written(tmp_path, text))
    ada, bob = found.find(ADA, 0.0), found.find(BOB, 0.0)
    assert ada is not None
    assert bob is not None
    assert (ada.name, ada.role, ada.teacher, ada.robots) == ("ada", Role.OBSERVER, False, frozenset({"cell1"}))
    assert (bob.name, bob.role, bob.teacher, bob.robots) == ("bob", Role.SUPERVISOR, True, None)
    assert found.find("", 0.0) is None
    assert found.find(ADA + " ", 0.0) is None
    assert found.find("\ud800", 0.0) is None


def test_a_designer_sees_what_he_moves(tmp_path: Path) -> None:
    grant = read_tokens(written(tmp_path, row("ada", ADA, 'role = "designer"'))).find(ADA, 0.0)
    assert grant is not None
    assert Role.OBSERVER in grant.role
    assert Role.SUPERVISOR not in grant.role


def test_every_row_is_compared_in_constant_time(monkeypatch: pytest.MonkeyPatch) -> None:
    compared: list[bytes] = []

    def compare(asked: bytes, there: bytes) -> bool:
        compared.append(there)
        return asked == there

    monkeypatch.setattr(tokens.hmac, "compare_digest", compare)
    grants = tuple(Grant(name, Role.SUPERVISOR, digest=digest_of(name)) for name in ("a", "b", "c"))
    for asked in ("a", "nobody"):
        compared.clear()
        Tokens(grants).find(asked, 0.0)
        assert compared == [grant.digest for grant in grants]


def test_an_end(tmp_path: Path) -> None:
    text = row("ada", ADA, "expires = 2027-07-31T12:00:00Z") + row("bob", BOB, "expires = 2027-07-31")
    found = read_tokens(written(tmp_path, text))
    noon = 1_817_035_200.0
    assert found.find(ADA, noon - 1.0) is not None
    assert found.find(ADA, noon) is None
    bob = found.find(BOB, noon - 86_400.0)
    assert bob is not None
    assert bob.until is not None
    assert 0.0 < bob.until - (noon - 12 * 3600.0) <= 38 * 3600.0, "the end of that day, in the zone of the server"
    assert found.holds(bob, noon - 86_400.0)
    assert not found.holds(bob, noon + 2 * 86_400.0)


WRONG = (
    ("token = 3", "[[token]]"),
    ("[[tokens]]\nname='a'", "tokens"),
    ("[[token]]\nname = 'a'\ntoken = 'short'", "16 characters"),
    ("[[token]]\nname = 'a b'\ntoken = 'x'", "name 'a b'"),
    ("[[token]]\nname = 'con'\ntoken = 'x'", "name 'con'"),
    ("[[token]]\nname = 'a'", "either token or sha256"),
    (f"[[token]]\nname = 'a'\nsha256 = '{'z' * 64}'", "64 hexadecimal"),
    (row("ada", ADA, 'role = "king"'), "role 'king'"),
    (row("ada", ADA, 'rolle = "observer"'), "rolle"),
    (row("ada", ADA, "robots = 3"), "robots 3"),
    (row("ada", ADA, "expires = 3"), "expires 3"),
    (row("ada", ADA) + row("ada", BOB), "ada is there twice"),
    (row("ada", ADA) + row("bob", ADA), "bob is there twice"),
    ("[[token", "tokens are a TOML file"),
    (f"a = {'1' * 5000}", "tokens are a TOML file"),
)


@pytest.mark.parametrize(("text", "said"), WRONG, ids=range(len(WRONG)))
def test_a_wrong_file_is_named_with_its_entry(tmp_path: Path, text: str, said: str) -> None:
    path = written(tmp_path, text)
    with pytest.raises(FileDamaged) as refused:
        read_tokens(path)
    assert said in str(refused.value)
    assert str(path) in str(refused.value)
    assert ADA not in str(refused.value)


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(FileError):
        TokenFile(tmp_path / "none.toml")


def test_a_file_that_changes_is_read_again(tmp_path: Path) -> None:
    path = written(tmp_path, row("ada", ADA) + row("bob", BOB))
    file = TokenFile(path)
    ada, bob = file.tokens.find(ADA, 0.0), file.tokens.find(BOB, 0.0)
    assert ada is not None
    assert bob is not None
    assert not file.look()
    path.write_text(row("ada", ADA))
    assert changed(file)
    assert file.tokens.holds(ada, 0.0)
    assert not file.tokens.holds(bob, 0.0)
    path.write_text(row("ada", ADA, 'role = "observer"'))
    assert changed(file)
    assert not file.tokens.holds(ada, 0.0), "who has another role enters anew"


def test_a_file_that_is_being_written_puts_nobody_out(tmp_path: Path) -> None:
    path = written(tmp_path, row("ada", ADA))
    file = TokenFile(path)
    for text in ("", row("ada", ADA) + row("bob", BOB)[:20], row("ada", ADA) + row("bob", BOB)):
        path.write_text(text)
        assert not file.look()
        assert file.tokens.find(ADA, 0.0) is not None
        assert not file.wrong
    assert file.look()
    assert file.tokens.find(BOB, 0.0) is not None


def test_a_file_that_is_emptied_while_it_is_read_puts_nobody_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = written(tmp_path, row("ada", ADA))
    file = TokenFile(path)
    path.write_text(row("ada", ADA) + row("bob", BOB))
    assert not file.look()

    def emptied(path: Path) -> Tokens:
        path.write_text("")
        return read_tokens(path)

    monkeypatch.setattr(tokens, "read_tokens", emptied)
    assert not file.look()
    monkeypatch.undo()
    assert file.tokens.find(ADA, 0.0) is not None
    path.write_text(row("bob", BOB))
    assert changed(file)


def test_a_file_that_is_wrong_now_lets_nobody_in_anew(tmp_path: Path) -> None:
    path = written(tmp_path, row("ada", ADA))
    file = TokenFile(path)
    path.write_text(row("ada", ADA) + "[[token]]\n")
    assert not changed(file)
    assert "still hold" in file.wrong
    assert file.tokens.find(ADA, 0.0) is not None
    os.remove(path)
    assert not changed(file)
    assert file.wrong
    path.write_text(row("bob", BOB))
    assert changed(file)
    assert not file.wrong


def test_new_tokens_are_hashes_in_a_private_file(tmp_path: Path) -> None:
    path = tmp_path / "tokens.toml"
    made = add_tokens(path, ["ada"]) | add_tokens(path, ["bob"], "teacher", ("cell1", "cell2"))
    again = add_tokens(path, ["carl"], robots=())
    found = read_tokens(path)
    assert [grant.name for grant in found.grants] == ["ada", "bob", "carl"]
    for name, token in {**made, **again}.items():
        grant = found.find(token, 0.0)
        assert grant is not None
        assert grant.name == name
        assert token not in path.read_text()
    assert found.grants[1].teacher
    assert found.grants[1].robots == {"cell1", "cell2"}
    assert found.grants[2].robots == set()
    if os.name == "posix":
        assert path.stat().st_mode & 0o777 == 0o600
    with pytest.raises(UsageError):
        add_tokens(path, ["ada"])


def test_tokens_are_taken_out_and_all_else_stays(tmp_path: Path) -> None:
    path = written(tmp_path, f"# the class\n\n{row('ada', ADA)}\n# bob's\n{row('bob', BOB)}")
    take_out(path, ["ada"])
    assert [grant.name for grant in read_tokens(path).grants] == ["bob"]
    assert "# the class" in path.read_text()
    with pytest.raises(UsageError, match="no token of ada"):
        take_out(path, ["bob", "ada"])
    assert [grant.name for grant in read_tokens(path).grants] == ["bob"]


def test_own_robots() -> None:
    grant = Grant("ada", Role.SUPERVISOR)
    assert [grant.own_names(most) for most in (0, 1, 2)] == [(), ("ada",), ("ada", "ada-2")]
    assert Grant("arm", Role.OBSERVER, robots=frozenset(["ada"]), body=True).own_names(2) == ()
    assert good_name("cell.1")
    assert not good_name("../x")
    assert not good_name("nul")
    assert not good_name("")


COLLIDING = (
    (("ada", "ada-2"), (), 2, "ada-2 would have ada-2 for itself, which is ada's"),
    (("ada-2", "ada"), (), 2, "ada would have ada-2 for itself, which is ada-2's"),
    (("demo",), ("demo",), 1, "demo would have demo for itself, which is the robot of all"),
    (("cell",), ("cell-2",), 2, "cell would have cell-2 for itself, which is the robot of all"),
    (("ada", "Ada"), (), 1, "Ada would have Ada for itself, which is ada's"),
)


@pytest.mark.parametrize(("names", "robots", "own", "said"), COLLIDING)
def test_a_robot_of_one_s_own_is_nobody_else_s(
    tmp_path: Path, names: tuple[str, ...], robots: tuple[str, ...], own: int, said: str
) -> None:
    path = written(tmp_path, "".join(row(name, f"the long token of {name}") for name in names))
    with pytest.raises(FileDamaged, match=said):
        TokenFile(path, robots, own)
    TokenFile(path, robots, 0)
    path.write_text(row("bob", BOB))
    file = TokenFile(path, robots, own)
    path.write_text("".join(row(name, f"the long token of {name}") for name in names))
    assert not changed(file)
    assert said in file.wrong
    assert file.tokens.find(BOB, 0.0) is not None
