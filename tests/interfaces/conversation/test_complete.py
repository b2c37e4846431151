"""What may come next on a line."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrs_cli.files.opening import Folder
from vrs_cli.interfaces.conversation.complete import DefinedNames, suggestions
from vrs_cli.language.words.values import Kind

NAMES = DefinedNames(
    programs={"pick.place": "5 steps", "part.in": "1 step"},
    variables={
        Kind.REAL: {"count": "12"},
        Kind.LOCATION: {"part": "1.0 2.0 3.0", "pallet[1]": ""},
        Kind.PRECISION: {"#safe": ""},
        Kind.STRING: {"$msg": '"hello"'},
    }.get,
    switches={"CP": "continuous path", "POWER": "arm power"},
    branches={"trial": "branch"},
    parts={"box": "part", "part.1": "part", '"old box"': "part"},
    parameters={"HAND.TIME": "", "PROFILE": ""},
)


def words(text: str, **options: bool) -> list[str]:
    return [suggestion.text for suggestion in suggestions(text, NAMES, **options)]


EXACT = [
    ("MO", ["MOVE", "MOVES", "MOVET", "MOVEST"]),
    ("mov", ["move", "moves", "movet", "movest"]),
    ("MOVE pa", ["part", "pallet[1]"]),
    ("move PA", ["part", "pallet[1]"]),
    ("MOVE #s", ["#safe"]),
    ("MOVE part ", ["AT", "IN"]),
    ("MOVE part A", ["AT"]),
    ("APPRO pa", ["part", "pallet[1]"]),
    ("APPRO part, 50 ", ["AT", "IN"]),
    ("APPRO part, cou", ["count"]),
    ("READ (cou", ["count"]),
    ("READ (5) cou", ["count"]),
    ("READ (count) part, $", ["$msg"]),
    ("FOPENR (5) $ms", ["$msg"]),
    ("EXECUTE ", ["pick.place", "part.in"]),
    ("EXEC pi", ["pick.place"]),
    ("DELETEP ", ["pick.place", "part.in"]),
    ("ENABLE ", ["CP", "POWER"]),
    ("EN P", ["POWER"]),
    ("DISABLE CP, P", ["POWER"]),
    ("MERGE ", ["trial"]),
    ("COMPARE tr", ["trial"]),
    ("PARAMETER PRO", ["PROFILE"]),
    ("HELP MOVES", ["MOVEST", "MOVESF"]),
    ("HELP HAND", ["HAND.TIME"]),
    ("PLOT V", ["VELOCITY"]),
    ("PLOT X, T", ["TOOL"]),
    ("WHERE ", ["FROM", "TO", "STEP", "AT", "IN", "box", "part.1", '"old box"', "MEASURED"]),
    ("WHERE p", ["part.1"]),
    ("WHERE box ", ["FROM", "TO", "STEP", "AT", "IN"]),
    ("WHERE FROM 0 ", ["TO", "STEP", "AT", "IN"]),
    ("WHERE FROM 0 TO 2 S", ["STEP"]),
    ("POINT pall", ["pallet[1]"]),
    ("POINT part = pal", ["pallet[1]"]),
    ("SET a = TR", ["TRANS(", "TRANSB("]),
    ("count = cou", ["count"]),
    ("$msg = $m", ["$msg", "$mid("]),
    ("MOVE SHIFT(pa", ["part", "pallet[1]"]),
    ("MOVE SHIFT(part BY cou", ["count"]),
    ("DO MOVE pa", ["part", "pallet[1]"]),
    ("DO DRI", ["DRIVE"]),
    ("EXPLAIN SP", ["SPLICE"]),
    ("EXPLAIN DRI", ["DRIVE"]),
    ("EXPLAIN MOVE pa", ["part", "pallet[1]"]),
    ("EXPLAIN IK pa", ["part", "pallet[1]"]),
    ("EXPLAIN MOVES part A", ["AT"]),
    (".", [".PROGRAM"]),
    ("TIMELINE ", []),
    ("READY ", ["AT", "IN"]),
    ('TYPE "MO', []),
    ("WHERE ; MO", []),
    ("NOSUCHWORD pa", []),
]


@pytest.mark.parametrize(("text", "expected"), EXACT)
def test_at_the_prompt(text: str, expected: list[str]) -> None:
    assert words(text) == expected


IN_PROGRAM = [
    ("EL", ["ELSE"]),
    ("CALL pi", ["pick.place"]),
    ("10 MOVE pa", ["part", "pallet[1]"]),
    ("IF count > 2 ", ["THEN", "GOTO"]),
    ("WHILE count ", ["DO"]),
    ("FOR i = 1 ", ["TO", "STEP"]),
    ("CASE count ", ["OF"]),
    (".", [".END"]),
    ("SPEED 30 MM", ["MMPS"]),
    ("AUTO R", ["REAL"]),
    ("LOCAL dou", ["double"]),
    ("GLOBAL L", ["LOC"]),
    ("AUTO REAL i, L", []),
    ("AUTO x, R", []),
    ("SPEED 30 MMPS ALW", ["ALWAYS"]),
]


@pytest.mark.parametrize(("text", "expected"), IN_PROGRAM)
def test_in_a_program(text: str, expected: list[str]) -> None:
    assert words(text, in_program=True) == expected


@pytest.mark.parametrize("word", ["AUTO", "LOCAL", "GLOBAL"])
def test_a_declaration_begins_with_a_sort_or_a_name(word: str) -> None:
    assert words(f"{word} ", in_program=True)[:3] == ["REAL", "DOUBLE", "LOC"]


def test_monitor_commands_are_no_steps() -> None:
    assert "TIMELINE" in words("TIM")
    assert "TIMELINE" not in words("TIM", in_program=True)


def test_after_at_a_number_is_wanted() -> None:
    assert "count" in words("MOVE part AT ")
    assert "part" not in words("MOVE part AT ")


def test_functions_wait_until_they_are_begun() -> None:
    assert "SIN(" in words("APPRO part, ")
    assert "SIN(" not in words("APPRO part, ", everything=False)
    assert "SIN(" in words("APPRO part, SI", everything=False)
    assert words("MOVE TRANS(0, ", everything=False) == ["count"]
    assert "RANDOM" in words("MOVE TRANS(0, RA", everything=False)


def test_a_real_is_assigned_reals_first() -> None:
    assert words("x = ", everything=False)[0] == "count"
    assert words("$x = ", everything=False)[0] == "$msg"


def test_words_carry_their_form_and_meaning() -> None:
    (move, *_) = suggestions("MOVE", NAMES)
    assert move.text == "MOVES"
    assert move.meta.startswith("MOVES location")


def test_a_suggestion_takes_the_place_of_what_was_typed() -> None:
    (suggestion,) = suggestions("MOVE #s", NAMES)
    assert (suggestion.text, suggestion.length) == ("#safe", 2)


def test_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("pick.v2", "points.lc", "demo.vrst", "notes.txt", ".hidden.v2"):
        (tmp_path / name).touch()
    (tmp_path / "programs").mkdir()
    (tmp_path / "programs" / "weld.v2").touch()
    assert words("LOAD ") == ["demo.vrst", "pick.v2", "points.lc", "programs/"]
    assert words("FLIST ") == ["pick.v2", "points.lc", "programs/"]
    assert words("LOAD pi") == ["pick.v2"]
    assert words("LOAD programs/") == ["weld.v2"]
    assert words("REPLAY ") == ["demo.vrst", "programs/"]
    assert words("LOAD nowhere/") == []


def test_files_of_a_closed_folder_and_no_others(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    inside = tmp_path / "cell1"
    for folder in (inside, tmp_path / "secret", inside / "mine"):
        folder.mkdir()
        (folder / f"{folder.name}.v2").touch()
    (inside / "way").symlink_to(tmp_path / "secret")
    monkeypatch.chdir(tmp_path)

    def offered(text: str) -> list[str]:
        return [one.text for one in suggestions(text, DefinedNames(), Folder(inside, closed=True))]

    assert offered("LOAD ") == ["cell1.v2", "mine/"]
    assert offered("LOAD mine/") == ["mine.v2"]
    for outside in ("secret/", "../", "../secret/", f"{tmp_path}/", "/", "~/", "way/", "mine/../../", "a\0b/"):
        assert offered(f"LOAD {outside}") == [], outside


def test_a_giant_line_is_not_completed() -> None:
    """Searches from its end would cost the square of its length."""
    assert words("MOVE" + 10 * " ")
    assert words("MOVE" + 5000 * " ") == []


@given(st.text(alphabet="MOVEATpart #$\"'(),:=[].;0123456789\t", max_size=40), st.booleans())
def test_law_suggestions_go_on_from_the_text(text: str, in_program: bool) -> None:
    for suggestion in suggestions(text, NAMES, in_program=in_program):
        begun = text[len(text) - suggestion.length :]
        assert suggestion.text.upper().startswith(begun.upper())


def test_while_a_number_is_typed_nothing_is_suggested() -> None:
    assert suggestions("MOVE TRANS(0,55", DefinedNames()) == []
    assert suggestions("SPEED 3", DefinedNames()) == []


def test_an_empty_line_lists_motions_first() -> None:
    assert [one.text for one in suggestions("", DefinedNames())][:3] == ["MOVE", "MOVES", "DRIVE"]
    assert [one.text for one in suggestions("", DefinedNames(), in_program=True)][:2] == ["MOVE", "MOVES"]
