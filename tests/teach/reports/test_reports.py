"""Test reports: hidden checks stay hidden, text of students is harmless, formats follow their documents."""

from __future__ import annotations

import csv
import json
import unicodedata
from html.parser import HTMLParser
from io import StringIO
from xml.etree import ElementTree

import jsonschema
import pytest
from msgspec import structs

from tests.teach.runs import PICK
from vrs_cli.teach.exercise import Exercise, read_exercise
from vrs_cli.teach.grading import Grading, Mark, VariantMarks
from vrs_cli.teach.reports.pages import Replay, student_page, teacher_page
from vrs_cli.teach.reports.results import (
    Likeness,
    cell,
    check50,
    file_stem,
    gradebook,
    gradescope,
    junit,
    plain,
    shown_marks,
)

HOSTILE = (
    "<script>alert(1)</script>",
    "</textarea></title><img src=x onerror=alert(1)>",
    "\"><svg onload='alert(1)'>",
    "'; DROP TABLE marks; --",
    "=HYPERLINK(\"http://evil\",\"click\")",
    "+1+cmd|' /C calc'!A0",
    "-2+3",
    "@SUM(1)",
    "\t=1+1",
    " =1+1",
    "\x1b]0;owned\x07\x1b[2J\x1b[31m",
    "\x9b31m",
    "\u202eevil\u202c",
    "a\nb\r\nc",
    "\x00\x01\x7f",
    "]]>",
    "&lt;b&gt; &amp; &#60;",
    "![x](javascript:alert(1)) **bold** `code` | table |",
    "\ud800 lone",
    "\ufffe\uffff",
    "x" * 5000,
    "../../../etc/passwd",
    "CON",
    "{{7*7}} ${7*7} %s %n {0}",
)  # fmt: skip


@pytest.fixture(scope="module")
def exercise() -> Exercise:
    """Return an exercise with two open and two hidden checks."""
    read = read_exercise(PICK)
    checks = (*read.checks[:2], *(structs.replace(one, hidden=True) for one in read.checks[2:4]))
    return structs.replace(read, checks=checks)


def grading(exercise: Exercise, text: str = "a reason", student: str = "ann") -> Grading:
    """Return marks with this text wherever students can write; the second variant earns less."""
    secret = "the hidden reason"

    def marks(share: float) -> tuple[Mark, ...]:
        return tuple(
            Mark(one.name, one.points * share, one.points, secret if one.hidden else text, 1.5, "a hint", one.hidden)
            for one in exercise.checks
        )

    variants = (VariantMarks(None, marks(1.0)), VariantMarks(1, marks(0.5), text), VariantMarks(2, marks(0.5)))
    return Grading(student, f"{student}.v2", "0" * 64, "", variants)


def lost(student: str = "ann", why: str = "it took longer than 120 s") -> Grading:
    return Grading(student, f"{student}.v2", "0" * 64, why)


REPLAY = Replay(1, 1.5, ("<svg></svg>",), "replay({})\n")


# --- hidden checks ---------------------------------------------------------------------------------------------------


def test_students_see_of_hidden_checks_their_points_alone(exercise: Exercise) -> None:
    one = grading(exercise)
    assert [(it.name, it.points, it.of) for it in shown_marks(exercise, one)] == [
        ("The box is on the stand", 2.0, 4.0),
        ("The arm is above the stand", 0.5, 1.0),
        ("other checks", 1.0, 2.0),
    ]
    hidden = [check.name for check in exercise.checks if check.hidden]
    for_students = (
        json.dumps(gradescope(exercise, one)),
        json.dumps(check50(exercise, one)),
        student_page(exercise, one, REPLAY, "ann"),
        json.dumps(check50(exercise, lost())),
        student_page(exercise, lost(), None, "ann"),
    )
    for text in for_students:
        assert "hidden reason" not in text
        assert not any(name in text for name in hidden)
    for text in (gradebook(exercise, [one]), junit(exercise, [one]), teacher_page(exercise, [one], (), "d", {})):
        assert all(name in text for name in hidden)


# --- hostile text ----------------------------------------------------------------------------------------------------


class Elements(HTMLParser):
    """The elements, attributes and text of a page."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.tags, self.attributes, self.data = list[str](), list[str](), ""
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.attributes += [name for name, _ in attrs]

    def handle_data(self, data: str) -> None:
        self.data += data


@pytest.mark.parametrize("text", HOSTILE, ids=range(len(HOSTILE)))
def test_pages_have_no_element_of_a_student(exercise: Exercise, text: str) -> None:
    harmless, hostile = grading(exercise), grading(exercise, text, text)
    for make in (
        lambda one: student_page(exercise, one, REPLAY, "ann"),
        lambda one: student_page(exercise, structs.replace(one, lost=one.stopped, variants=()), None, "ann"),
        lambda one: teacher_page(exercise, [one], [Likeness(one.student, one.student, 0.5)], "d", {one.student: "x"}),
    ):
        page, expected = Elements(make(hostile)), Elements(make(harmless))
        assert (page.tags, page.attributes) == (expected.tags, expected.attributes)
        assert not any(unicodedata.category(one) in ("Cc", "Cf", "Cs", "Cn") for one in page.data.rstrip("\n"))
        assert plain(text) in page.data


@pytest.mark.parametrize("text", HOSTILE, ids=range(len(HOSTILE)))
def test_tables_compute_nothing_of_a_student(exercise: Exercise, text: str) -> None:
    rows = list(csv.reader(StringIO(gradebook(exercise, [grading(exercise, text, text), lost(text, text)]))))
    assert [len(row) for row in rows] == [10, 10, 10]
    cells = [one for row in rows for one in row]
    assert not any(one.lstrip()[:1] in ("=", "+", "-", "@") and one for one in cells)
    assert all(one.isprintable() for one in cells)


@pytest.mark.parametrize("text", HOSTILE, ids=range(len(HOSTILE)))
def test_xml_holds_text_of_students_as_text(exercise: Exercise, text: str) -> None:
    root = ElementTree.fromstring(junit(exercise, [grading(exercise, text, text), lost(text, text)]).encode())
    suites = root.findall("testsuite")
    assert [suite.get("name") for suite in suites] == [plain(text)] * 2
    (error,) = suites[1].findall("testcase/error")
    assert error.get("message") == plain(text)


@pytest.mark.parametrize("text", HOSTILE, ids=range(len(HOSTILE)))
def test_json_for_students_has_nothing_that_is_obeyed(exercise: Exercise, text: str) -> None:
    for found in (gradescope, check50):
        for one in (grading(exercise, text, text), lost(text, text)):
            assert json.dumps(found(exercise, one)).isprintable()
    assert plain(text).isprintable()


def test_joined_letters_and_accents_stay() -> None:
    assert plain("نیم\u200cفاصله Zoë 李雷 👩\u200d🔬") == "نیم\u200cفاصله Zoë 李雷 👩\u200d🔬"


def test_only_what_a_spreadsheet_would_compute_is_marked() -> None:
    assert [cell(text) for text in ("=1", "ann", "a=b", "-x", "5")] == ["'=1", "ann", "a=b", "'-x", "5"]


def test_names_of_files_are_good_everywhere_and_differ() -> None:
    taken = set[str]()
    names = [file_stem(text, taken) for text in (*HOSTILE, "Ann", "ann", "", "..", "nul.txt")]
    assert len({name.casefold() for name in names}) == len(names)
    assert all(name and set(name) <= set(map(chr, range(45, 127))) and "/" not in name for name in names)
    assert not any(name.startswith(".") or len(name) > 80 for name in names)
    assert "CON" not in names


# --- documented formats ----------------------------------------------------------------------------------------------

TEXT, NUMBER = {"type": "string"}, {"type": "number"}
SHOWN = {"enum": ["hidden", "after_due_date", "after_published", "visible"]}
FORMATS = {"enum": ["text", "html", "simple_format", "md", "ansi"]}
GRADESCOPE = {  # "Autograder Specifications", Output format
    "type": "object",
    "anyOf": [{"required": ["score"]}, {"required": ["tests"]}],
    "additionalProperties": False,
    "properties": {
        "score": NUMBER,
        "execution_time": NUMBER,
        "output": TEXT,
        "output_format": FORMATS,
        "test_output_format": FORMATS,
        "test_name_format": FORMATS,
        "visibility": SHOWN,
        "stdout_visibility": SHOWN,
        "extra_data": {"type": "object"},
        "leaderboard": {"type": "array"},
        "tests": {
            "type": "array",
            "items": {
                "type": "object",
                "additionalProperties": False,
                "properties": {
                    "score": NUMBER,
                    "max_score": NUMBER,
                    "status": {"enum": ["passed", "failed"]},
                    "name": TEXT,
                    "name_format": FORMATS,
                    "number": TEXT,
                    "output": TEXT,
                    "output_format": FORMATS,
                    "tags": {"type": "array", "items": TEXT},
                    "visibility": SHOWN,
                    "extra_data": {"type": "object"},
                },
            },
        },
    },
}
CHECK50 = {  # "JSON specification" of check50 3
    "type": "object",
    "additionalProperties": False,
    "required": ["slug", "results", "version"],
    "properties": {
        "slug": TEXT,
        "version": TEXT,
        "results": {
            "type": "array",
            "items": {
                "type": "object",
                "additionalProperties": False,
                "required": ["name", "description", "passed", "log", "cause", "data", "dependency"],
                "properties": {
                    "name": {"type": "string", "pattern": "^[a-z0-9_]+$"},
                    "description": TEXT,
                    "passed": {"type": ["boolean", "null"]},
                    "log": {"type": "array", "items": TEXT},
                    "cause": {
                        "type": ["object", "null"],
                        "required": ["rationale"],
                        "properties": {"rationale": TEXT, "help": {"type": ["string", "null"]}},
                    },
                    "data": {"type": "object"},
                    "dependency": {"type": ["string", "null"]},
                },
                # "cause will be null if passed is true, and never null if it is not"
                "if": {"properties": {"passed": {"const": True}}},
                "then": {"properties": {"cause": {"type": "null"}}},
                "else": {"properties": {"cause": {"type": "object"}}},
            },
        },
    },
}
JUNIT = {  # junit-10.xsd of Jenkins: the attributes of each element, those that are required with a !, and its children
    "testsuites": ({"name", "time", "tests", "failures", "errors"}, set(), {"testsuite"}),
    "testsuite": (
        {"name", "tests", "failures", "errors", "group", "time", "skipped", "timestamp", "hostname", "id", "package"},
        {"name", "tests", "failures", "errors"},
        {"testsuite", "properties", "testcase", "system-out", "system-err"},
    ),
    "testcase": ({"name", "time", "classname", "group"}, {"name"}, {"skipped", "error", "failure", "system-out"}),
    "failure": ({"type", "message"}, set(), set()),
    "error": ({"type", "message"}, set(), set()),
}  # fmt: skip


@pytest.mark.parametrize("text", ["a reason", HOSTILE[0]])
def test_formats_for_students_are_as_documented(exercise: Exercise, text: str) -> None:
    for one in (grading(exercise, text), lost()):
        jsonschema.validate(gradescope(exercise, one), GRADESCOPE)
        jsonschema.validate(check50(exercise, one), CHECK50)
    found = gradescope(exercise, grading(exercise))
    assert found["score"] == sum(test["score"] for test in found["tests"])
    names = [one["name"] for one in check50(exercise, grading(exercise))["results"]]
    assert len(set(names)) == len(names) == 3


def test_the_xml_is_that_of_junit(exercise: Exercise) -> None:
    root = ElementTree.fromstring(junit(exercise, [grading(exercise), lost("bob")]).encode())
    for element in root.iter():
        may, must, children = JUNIT[element.tag]
        assert must <= set(element.keys()) <= may
        assert {child.tag for child in element} <= children
    for suite in root:
        assert int(suite.get("tests", "")) == len(suite)
        assert int(suite.get("failures", "")) == len(suite.findall("testcase/failure"))
        assert int(suite.get("errors", "")) == len(suite.findall("testcase/error"))
    assert [root.get(name) for name in ("tests", "failures", "errors")] == ["5", "4", "1"]
