from __future__ import annotations

from random import Random

import pytest

from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.errors import UndefinedName
from vrs_cli.files.store import EVERYTHING, MemoryPart, store
from vrs_cli.interfaces.session.session import Session
from vrs_cli.language.words.values import Kind

TEXT = """\
.PROGRAM main(p) ;does it all
    ; first
    CALL sub(3)
    APPRO p, 50
    MOVE pallet[2] ;there
.END
.PROGRAM sub(n)
    TYPE n, $name
.END
.PROGRAM alone
    MOVE #safe
.END
.LOCATIONS
pallet[1] 100 200 -300.5 90 -90 0
pallet[2] 1 2 3 10 20 30
#safe 0 -90 90 0 0 0
.END
.REALS
count = 12.5
grid[1,2] = -3
.END
.STRINGS
$name = "A-17"
.END
"""


def loaded(text: str) -> Session:
    session = Session(RecordingTerminal())
    errors = [one for one in session.load_text(text) if one.severity.value == "error"]
    assert not errors
    return session


def variables(session: Session) -> dict[str, object]:
    return {name: value for kind in Kind for name, value in session.environment.variables(kind)}


def nearly(values: dict[str, object]) -> dict[str, object]:
    """Locations to the last digit of a file; strings as they are."""
    return {name: value if isinstance(value, str) else pytest.approx(value, abs=1e-8) for name, value in values.items()}


def test_what_is_stored_comes_back() -> None:
    before = loaded(TEXT)
    text = store(before.environment)
    after = loaded(text)
    assert variables(after) == nearly(variables(before))
    assert list(after.environment.programs) == ["main", "sub", "alone"]
    assert store(after.environment) == text


def test_comments_are_kept() -> None:
    text = store(loaded(TEXT).environment)
    for comment in ("does it all", "first", "there"):
        assert comment in text


@pytest.mark.parametrize(
    ("part", "header", "absent"),
    [
        (MemoryPart.PROGRAMS, ".PROGRAM main", ".LOCATIONS"),
        (MemoryPart.LOCATIONS, ".LOCATIONS", ".REALS"),
        (MemoryPart.REALS, ".REALS", ".STRINGS"),
        (MemoryPart.STRINGS, ".STRINGS", ".PROGRAM"),
    ],
)
def test_one_part_alone(part: MemoryPart, header: str, absent: str) -> None:
    text = store(loaded(TEXT).environment, {part})
    assert text.startswith(header)
    assert absent not in text


def test_a_program_takes_along_what_it_uses() -> None:
    text = store(loaded(TEXT).environment, EVERYTHING, ["main"])
    for wanted in (".PROGRAM main", ".PROGRAM sub", "pallet[1]", "pallet[2]", "$name"):
        assert wanted in text
    for unused in (".PROGRAM alone", "#safe", "count", "grid"):
        assert unused not in text


def test_a_program_that_is_not_there() -> None:
    with pytest.raises(UndefinedName, match="did you mean main"):
        store(loaded(TEXT).environment, EVERYTHING, ["mian"])


def test_nothing_is_an_empty_text() -> None:
    assert store(loaded("").environment) == ""


def test_every_character_comes_back() -> None:
    session = loaded("")
    random = Random(7)
    texts = [chr(code) for code in range(256)]
    texts += ["".join(random.choice('"\n\r\x1a\0;.+$a ') for _ in range(random.randrange(40))) for _ in range(100)]
    for number, text in enumerate(texts):
        session.environment.reference("$s", number).assign(text)
    session.environment.reference("$last").assign("all is well")
    again = loaded(store(session.environment))
    assert again.environment.values() == session.environment.values()


@pytest.mark.parametrize(
    "value", ["$CHR(300)", "$CHR(1.5)", "$ABS(3)", '"a"+', '"a"+n', "$CHR(34", '"a" "b"', '"a"-"b"x']
)
def test_other_strings_are_refused_in_their_line(value: str) -> None:
    session = Session(RecordingTerminal())
    found, told = session.load_text(f'.STRINGS\n$s {value}\n$t "x"\n.END\n')
    assert found.span.line == 2
    assert "nothing of" in told.message
    assert session.environment.values() == {}
