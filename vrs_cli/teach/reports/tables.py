"""All marks for teachers: a table of CSV for a gradebook, and JUnit's XML."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from io import StringIO
from xml.sax.saxutils import quoteattr

from vrs_cli.teach.exercise import Exercise
from vrs_cli.teach.grading import Grading, total_of
from vrs_cli.teach.marking import Mark
from vrs_cli.teach.reports.texts import cell, plain, points_text


def gradebook(exercise: Exercise, gradings: Sequence[Grading]) -> str:
    """Return a table of CSV (RFC 4180): a row for each student, with the points of each check, hidden ones too."""
    stream = StringIO()
    table = csv.writer(stream)
    names = (cell(one.name) for one in exercise.checks)
    table.writerow(("student", "file", "status", "points", "of", *names, "reason"))
    of = points_text(total_of(exercise))
    for one in gradings:
        status, points = ("not graded", "") if one.lost else ("graded", points_text(one.points))
        marks = [points_text(found.points) for _, found in one.marks] or [""] * len(exercise.checks)
        row = (cell(one.student), cell(one.file), status, points, of, *marks, cell(one.lost or one.stopped))
        table.writerow(row)
    return stream.getvalue()


def junit(exercise: Exercise, gradings: Sequence[Grading]) -> str:
    """Return the XML of JUnit (junit-10.xsd of Jenkins): a suite for each student, a case for each check. What was not
    graded is an error, a check without all its points a failure.
    """
    lines, tests, failed, errors = list[str](), 0, 0, 0
    for one in gradings:
        wrong = [found for _, found in one.marks if not found.passed]
        cases = [_case(exercise, one, *pair) for pair in one.marks] or [_lost_case(exercise, one)]
        counts = f'tests="{len(cases)}" failures="{len(wrong)}" errors="{int(bool(one.lost))}"'
        lines += [f"  <testsuite name={_attribute(one.student)} {counts}>", *cases, "  </testsuite>"]
        tests, failed, errors = tests + len(cases), failed + len(wrong), errors + bool(one.lost)
    counts = f'tests="{tests}" failures="{failed}" errors="{errors}"'
    head = f"<testsuites name={_attribute(exercise.title)} {counts}>"
    return "\n".join(('<?xml version="1.0" encoding="UTF-8"?>', head, *lines, "</testsuites>", ""))


def _case(exercise: Exercise, grading: Grading, seed: int | None, found: Mark) -> str:
    names = f"name={_attribute(found.name)} classname={_attribute(f'{exercise.name}.{grading.student}')}"
    if found.passed:
        return f"    <testcase {names}/>"
    variant = exercise.seeds.index(seed)
    where = f" (variant {variant}, seed {seed})" if variant else ""
    said = f"{points_text(found.points)} of {points_text(found.of)} points: {found.reason}{where}"
    return f'    <testcase {names}><failure type="check" message={_attribute(said)}/></testcase>'


def _lost_case(exercise: Exercise, grading: Grading) -> str:
    names = f'name="graded" classname={_attribute(f"{exercise.name}.{grading.student}")}'
    return f'    <testcase {names}><error type="not graded" message={_attribute(grading.lost)}/></testcase>'


def _attribute(text: str) -> str:
    return quoteattr(plain(text))
