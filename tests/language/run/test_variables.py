"""Variables as programs share them."""

from __future__ import annotations

import pytest

from tests.language.running import program, run
from vrs_cli.errors import IllegalArrayIndex, StringOverflow, TypeMismatch, UndefinedValue
from vrs_cli.kinematics.transform import IDENTITY, translation
from vrs_cli.language.run.environment import Environment
from vrs_cli.language.text.ast import Entry, Number, Variable
from vrs_cli.language.words.values import Kind
from vrs_cli.values.diagnostics import Span
from vrs_cli.values.numbers import Value

NOWHERE = Span(1, 1, 1)


def names(environment: Environment, kind: Kind) -> list[str]:
    return [variable.name for variable in environment.variables(kind)]


def test_the_four_kinds_are_apart() -> None:
    environment = Environment()
    values: dict[str, Value] = {"count": 3.0, "part": translation(1, 2, 3), "#safe": (0.0, 1.0), "$name": "x"}
    for name, value in values.items():
        environment.reference(name).assign(value)
    for (name, value), kind in zip(
        values.items(), (Kind.REAL, Kind.LOCATION, Kind.PRECISION, Kind.STRING), strict=True
    ):
        assert environment.kind_of(name) is kind
        assert list(environment.variables(kind)) == [(name, value)]
    assert environment.kind_of("missing") is None


def test_a_hash_or_dollar_name_is_not_the_bare_name() -> None:
    environment = Environment()
    environment.reference("x").assign(1.0)
    environment.reference("#x").assign((0.0,))
    environment.reference("$x").assign("x")
    assert environment.kinds == {"x": Kind.REAL, "#x": Kind.PRECISION, "$x": Kind.STRING}


def test_a_bare_name_is_a_real_or_a_transformation() -> None:
    environment = Environment()
    environment.reference("a").assign(1.0)
    with pytest.raises(TypeMismatch, match="a is a real"):
        environment.reference("a").assign(IDENTITY)
    environment.delete("a")
    environment.reference("a").assign(IDENTITY)
    with pytest.raises(TypeMismatch, match="a is a transformation"):
        environment.reference("A").assign(2.0)


def test_a_name_holds_its_own_kind_only() -> None:
    with pytest.raises(TypeMismatch, match="string"):
        Environment().reference("$s").assign(1.0)
    with pytest.raises(TypeMismatch, match="precision point"):
        Environment().reference("#p").assign(IDENTITY)


def test_names_are_the_same_in_any_case_up_to_15_characters() -> None:
    environment = Environment()
    environment.reference("Distance.to.part.33").assign(5.0)
    assert environment.reference("DISTANCE.TO.PART.34").value() == 5.0
    assert names(environment, Kind.REAL) == ["Distance.to.part.33"]


def test_reading_what_is_not_there_names_it_and_what_is_near() -> None:
    environment = Environment()
    environment.reference("Counter").assign(1.0)
    with pytest.raises(UndefinedValue) as caught:
        environment.reference("countr").value()
    assert str(caught.value) == "*Undefined value* countr (did you mean Counter?)"


def test_arrays_are_listed_element_by_element_in_order() -> None:
    environment = Environment()
    for index in (10, 2, 0):
        environment.reference("row", index).assign(float(index))
    environment.reference("grid", (1, 2)).assign(5.0)
    environment.reference("a").assign(1.0)
    assert names(environment, Kind.REAL) == ["a", "grid[1,2]", "row[0]", "row[2]", "row[10]"]


def test_an_element_that_is_not_there_is_named() -> None:
    environment = Environment()
    environment.reference("row", 1).assign(1.0)
    with pytest.raises(UndefinedValue, match=r"row\[2\]"):
        environment.reference("row", 2).value()
    with pytest.raises(IllegalArrayIndex, match=r"row\[-1\]"):
        environment.reference("row", -1).value()
    with pytest.raises(IllegalArrayIndex, match=r"row\[-1\]"):
        environment.reference("row", -1).assign(1.0)
    with pytest.raises(IllegalArrayIndex, match=r"row\[\]"):
        environment.reference("row", array=True).assign(1.0)


def test_variables_can_be_deleted() -> None:
    environment = Environment()
    for index in (1, 2):
        environment.reference("row", index).assign(1.0)
    assert environment.delete("row", 1)
    assert not environment.delete("row", 1)
    assert names(environment, Kind.REAL) == ["row[2]"]
    assert environment.delete("ROW")
    assert environment.kind_of("row") is None
    assert not environment.delete("row")


def test_clearing_forgets_all_kinds() -> None:
    environment = Environment()
    environment.reference("x").assign(1.0)
    environment.reference("$x", 1).assign("x")
    assert environment.kinds == {"x": Kind.REAL, "$x": Kind.STRING}
    environment.clear_variables()
    assert environment.kinds == {}


def test_strings_longer_than_128_characters_are_not_stored() -> None:
    with pytest.raises(StringOverflow, match="129"):
        Environment().reference("$s").assign("x" * 129)


@pytest.mark.parametrize(
    ("name", "sigil", "numbers", "text", "kind"),
    [
        ("count", "", (12.0,), None, Kind.REAL),
        ("a", "", (500.0, 0.0, 0.0, 90.0, -90.0, 0.0), None, Kind.LOCATION),
        ("safe", "#", (0.0, -90.0), None, Kind.PRECISION),
        ("part", "$", (), "A-17", Kind.STRING),
    ],
)
def test_entries_of_a_file_replace_what_was_there(
    name: str, sigil: str, numbers: tuple[float, ...], text: str | None, kind: Kind
) -> None:
    environment = Environment()
    if not sigil:
        environment.reference(name).assign(IDENTITY if kind is Kind.REAL else 1.0)
    environment.define(Entry(Variable(name, sigil, None, span=NOWHERE), numbers, text, span=NOWHERE))
    assert environment.kind_of(sigil + name) is kind


def test_an_entry_may_be_an_element() -> None:
    environment = Environment()
    row = Variable("row", "", (Number(3.0, "3", span=NOWHERE),), span=NOWHERE)
    environment.define(Entry(row, (7.0,), None, span=NOWHERE))
    assert environment.reference("row", 3).value() == 7.0


def test_a_program_may_not_turn_a_location_into_a_real() -> None:
    text = program("SET p = NULL", "CALL other") + program("p = 1", name="other")
    assert str(run(text).error) == "*Variable type mismatch* p is a transformation (a real is wanted here)"


def test_a_program_may_not_read_a_real_as_a_location() -> None:
    text = program("p = 1", "CALL other") + program("MOVE p", name="other")
    assert str(run(text).error) == "*Variable type mismatch* p is a real (a transformation is wanted here)"


@pytest.mark.parametrize(("index", "element"), [("2.4", 2), ("2.5", 3), ("0-0.3", 0), ("i", 3), ("i+0.6", 4)])
def test_indexes_are_rounded_in_reading_as_in_assigning(index: str, element: int) -> None:
    lines = ("i = 3", "FOR k = 0 TO 5", "a[k] = k*10", "b[k, k] = k", "END")
    done = run(program(*lines, f"x = a[{index}]", f"y = b[{index}, {index}]", f"a[{index}] = -1", f"z = a[{element}]"))
    assert (done.value("x"), done.value("y"), done.value("z")) == (10.0 * element, float(element), -1.0)


def test_an_index_below_0_is_refused_in_reading_and_in_assigning() -> None:
    for line in ("x = a[i]", "a[i] = 1", "x = a[1, i]"):
        error = run(program("i = -1", "a[1] = 0", line)).error
        assert isinstance(error, IllegalArrayIndex), line
