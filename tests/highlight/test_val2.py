from __future__ import annotations

import tomllib
from importlib import import_module
from pathlib import Path

import pytest
from pygments.token import Comment, Keyword, Name, Number, String, Token

from vrs_cli.highlight.val2 import TOKENS, Val2Lexer
from vrs_cli.language.words.instructions import CONTROL, INSTRUCTIONS
from vrs_cli.render.colours import Ink, scan

ROOT = Path(__file__).parents[2]


def tokens(text: str) -> list[tuple[object, str]]:
    return [(token, piece) for token, piece in Val2Lexer().get_tokens(text) if piece.strip()]


def test_a_step() -> None:
    assert tokens('10 MOVE part ; "go"') == [
        (Name.Label, "10"),
        (Keyword, "MOVE"),
        (Name, "part"),
        (Comment.Single, '; "go"'),
    ]
    assert (Name.Builtin, "ABS") in tokens("x = ABS(y)")
    assert (String, '"MOVE"') in tokens('TYPE "MOVE"')
    assert (Number, "^HFF") in tokens("x = ^HFF")
    assert tokens("move = 1")[0] == (Name, "move")


def test_a_variable_with_the_name_of_a_function() -> None:
    text = ".PROGRAM p()\n    hand = 1\n    TYPE hand, dx, DX(HERE)\n.END\n"
    builtin = [piece for token, piece in tokens(text) if token is Name.Builtin]
    assert builtin == ["DX", "HERE"]


@pytest.mark.parametrize("path", sorted((ROOT / "programs").glob("*.v2")), ids=lambda path: path.name)
def test_the_pieces_are_the_text(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    pieces = list(Val2Lexer().get_tokens_unprocessed(text))
    assert "".join(piece for _, _, piece in pieces) == text
    at = 0
    for index, _, piece in pieces:
        assert index == at
        at += len(piece)
    assert Token.Error not in {token for _, token, _ in pieces}


def test_every_word_of_the_tables() -> None:
    assert not [word for word in (*INSTRUCTIONS, *CONTROL) if tokens(f"    {word} x")[0][0] not in Keyword]


def test_every_role_of_a_line_has_a_token() -> None:
    text = 'SIGNAL ABS(x)+1, "a" ; b'
    assert {ink for _, ink in scan(text)} <= set(TOKENS)
    assert Ink.COMMENT in TOKENS


def test_it_is_announced_to_pygments() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    module, _, name = project["entry-points"]["pygments.lexers"]["val2"].partition(":")
    assert getattr(import_module(module), name) is Val2Lexer
    assert set(Val2Lexer.aliases) == {"val2", "val-ii", "vplus"}
