"""All results as one JSON object, for teachers, with a digest; and a grading as an object and back."""

from __future__ import annotations

import csv
import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from io import StringIO
from typing import Any
from xml.sax.saxutils import quoteattr

from msgspec import Struct, structs

from vrs_cli.language.text.parser import variables_in
from vrs_cli.render.colours import Ink, scan
from vrs_cli.teach.exercise import Exercise
from vrs_cli.teach.grading import Grading, VariantMarks, total_of
from vrs_cli.teach.marking import Mark
from vrs_cli.teach.reports.students import cell, plain, points_text

RUN = 8  # words
WINDOW = 4  # of so many runs in a row one is kept
LEAST_RUNS = 5  # a submission with fewer is too short to be compared
MAX_CHARS = 20_000  # of one submission: the first ones
DECIMALS = 2


class Likeness(Struct, frozen=True):
    """Two students whose submissions are alike, the first before the second in order; `similarity` from 0 to 1."""

    first: str
    second: str
    similarity: float


def similar(texts: Mapping[str, str], given: Iterable[str], least: float | None) -> tuple[Likeness, ...]:
    """Return the pairs of students whose texts are alike by `least` or more, the most alike first; None: no pairs.
    `given`: texts that the exercise gives.
    """
    if least is None:
        return ()
    known = {run for text in given for run in _runs(_words(text))}
    kept = {
        student: _winnowed([run for run in _runs(_words(text)) if run not in known]) for student, text in texts.items()
    }
    students = sorted((one for one in kept if len(kept[one]) >= LEAST_RUNS), key=lambda one: (one.casefold(), one))
    found = [
        Likeness(first, second, share)
        for number, first in enumerate(students)
        for second in students[number + 1 :]
        if (share := _dice(kept[first], kept[second])) >= least
    ]
    return tuple(sorted(found, key=lambda one: -one.similarity))


def _dice(first: frozenset[int], second: frozenset[int]) -> float:
    return round(2.0 * len(first & second) / (len(first) + len(second)), DECIMALS)


def _words(text: str) -> list[tuple[bool, str]]:
    """The first words of a text, and whether each is a name."""
    lines = text[:MAX_CHARS].splitlines()
    variables = variables_in(lines)
    return [
        (ink is Ink.NAME, word.upper() if ink is not Ink.STRING else word)
        for line in lines
        for piece, ink in scan(line, variables)
        if ink is not Ink.COMMENT
        for word in piece.split()
    ]


def _runs(words: Sequence[tuple[bool, str]]) -> list[int]:
    """A number for each run of words: of equal runs the same, whatever their names are."""
    found = []
    for begin in range(len(words) - RUN + 1):
        names = dict[str, str]()
        run = (
            names.setdefault(word, f"name {len(names)}") if named else word
            for named, word in words[begin : begin + RUN]
        )
        found.append(int.from_bytes(hashlib.blake2b("\0".join(run).encode(), digest_size=8).digest()))
    return found


def _winnowed(runs: Sequence[int]) -> frozenset[int]:
    """The least of each `WINDOW` runs in a row."""
    if len(runs) <= WINDOW:
        return frozenset(runs)
    return frozenset(min(runs[begin : begin + WINDOW]) for begin in range(len(runs) - WINDOW + 1))


FORMAT = "vrs grades 1"
Object = dict[str, Any]


def results_object(exercise: Exercise, gradings: Sequence[Grading], alike: Iterable[Likeness]) -> Object:
    """Return all results, with `digest`: the SHA-256 of the canonical JSON of all the rest."""
    found = {
        "format": FORMAT,
        "exercise": {
            "name": exercise.name,
            "title": exercise.title,
            "points": total_of(exercise),
            "checks": [{"name": one.name, "points": one.points, "hidden": one.hidden} for one in exercise.checks],
            "seeds": list(exercise.seeds),
        },
        "submissions": [_summary(one, exercise) for one in gradings],
        "similar": [{"students": [one.first, one.second], "similarity": one.similarity} for one in alike],
    }
    return found | {"digest": hashlib.sha256(canonical_json(found).encode()).hexdigest()}


def canonical_json(found: Object) -> str:
    """Return JSON with sorted keys, without blanks, in ASCII: the same for equal objects."""
    return json.dumps(found, sort_keys=True, separators=(",", ":"))


def written_json(found: object) -> str:
    """Return JSON as a file has it."""
    return json.dumps(found, indent=2, ensure_ascii=True) + "\n"


def _summary(grading: Grading, exercise: Exercise) -> Object:
    """A submission, with what its marks come to."""
    checks = [{**structs.asdict(found), "seed": seed} for seed, found in grading.marks]
    graded = not grading.lost
    return {
        "student": grading.student,
        "file": grading.file,
        "sha256": grading.sha256,
        "status": "graded" if graded else "not graded",
        "reason": grading.lost or grading.stopped,
        "points": grading.points if graded else None,
        "of": total_of(exercise),
        "marks": checks,
        "variants": grading_object(grading)["variants"],
    }


# --- a grading on its way between processes --------------------------------------------------------------------------


def grading_object(grading: Grading) -> Object:
    """Return a grading as an object of JSON."""
    variants = [
        {**structs.asdict(one), "marks": [structs.asdict(found) for found in one.marks]} for one in grading.variants
    ]
    return structs.asdict(grading) | {"variants": variants}


def grading_from(found: Mapping[str, Any]) -> Grading:
    """Return the grading of an object."""
    variants = tuple(
        VariantMarks(**{**one, "marks": tuple(Mark(**each) for each in one["marks"])}) for one in found["variants"]
    )
    return Grading(**{**found, "variants": variants})


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
