"""Write all results for teachers as JSON, CSV and JUnit's XML, find similar submissions, and show students their marks.

Submissions are compared by their words without comments and blanks. Each run of `RUN` words is one unit; each name in
it is replaced by a number in order of appearance, so that renaming changes nothing. Runs in the given texts of the
exercise do not count. Winnowing keeps only some of the runs, and keeps the same ones from equal texts (Schleimer,
Wilkerson, Aiken, SIGMOD 2003). The similarity is twice the number of common runs divided by the sum of both numbers
(Dice).

Students' marks are also written as JSON for Gradescope ("Autograder Specifications") and check50 ("JSON specification"
of check50 3). Control characters and spreadsheet formulas in texts of students are made harmless. Hidden checks show
only their total points.
"""

from __future__ import annotations

import csv
import hashlib
import json
import re
from collections.abc import Iterable, Mapping, Sequence
from io import StringIO
from itertools import count
from typing import Any
from xml.sax.saxutils import quoteattr

from msgspec import Struct, structs

from vrs_cli.files.opening import DEVICES
from vrs_cli.language.text.parser import variables_in
from vrs_cli.render.colours import Ink, scan
from vrs_cli.teach.exercise import Exercise
from vrs_cli.teach.grading import POINT_STEP, Grading, Mark, VariantMarks, total_of
from vrs_cli.teach.judging.basis import round_to

RUN = 8  # number of consecutive words (a run) that are compared as one unit
WINDOW = 4  # winnowing keeps one of this many consecutive runs
LEAST_RUNS = 5  # a submission with fewer runs is not compared
MAX_CHARS = 20_000  # maximum number of characters that are compared, from the start of the text


class Likeness(Struct, frozen=True):
    """Two students with similar submissions, sorted by name. `similarity`: from 0 to 1."""

    first: str
    second: str
    similarity: float


def similar(texts: Mapping[str, str], given: Iterable[str], least: float | None) -> tuple[Likeness, ...]:
    """Return the pairs of students whose submissions have a similarity of at least `least`, the most similar first. If
    `least` is None, return no pairs. `given`: program files that the exercise provides."""
    if least is None:
        return ()
    known = {run for text in given for run in _runs(_words(text))}
    kept = {
        student: _winnow([run for run in _runs(_words(text)) if run not in known]) for student, text in texts.items()
    }
    students = sorted((one for one in kept if len(kept[one]) >= LEAST_RUNS), key=lambda one: (one.casefold(), one))
    found = [
        Likeness(first, second, share)
        for number, first in enumerate(students)
        for second in students[number + 1 :]
        if (share := round(2 * len(kept[first] & kept[second]) / (len(kept[first]) + len(kept[second])), 2)) >= least
    ]
    return tuple(sorted(found, key=lambda one: -one.similarity))


def _words(text: str) -> list[tuple[bool, str]]:
    """Return (is_name, word) pairs for the words in the first MAX_CHARS characters of a submission."""
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
    """Return a hash of each run of RUN consecutive words. Runs that differ only in names have equal hashes."""
    found = []
    for begin in range(len(words) - RUN + 1):
        names = dict[str, str]()
        run = (
            names.setdefault(word, f"name {len(names)}") if named else word
            for named, word in words[begin : begin + RUN]
        )
        found.append(int.from_bytes(hashlib.blake2b("\0".join(run).encode(), digest_size=8).digest()))
    return found


def _winnow(runs: Sequence[int]) -> frozenset[int]:
    """Return the minimum hash of each WINDOW consecutive runs (winnowing)."""
    if len(runs) <= WINDOW:
        return frozenset(runs)
    return frozenset(min(runs[begin : begin + WINDOW]) for begin in range(len(runs) - WINDOW + 1))


FORMAT = "vrs grades 1"
Object = dict[str, Any]


def results_object(exercise: Exercise, gradings: Sequence[Grading], alike: Iterable[Likeness]) -> Object:
    """Return all results as a JSON object. Its field `digest` is the SHA-256 of the canonical JSON of all other
    fields."""
    found = {
        "format": FORMAT,
        "exercise": {
            "name": exercise.name,
            "title": exercise.title,
            "points": total_of(exercise),
            "checks": [{"name": one.name, "points": one.points, "hidden": one.hidden} for one in exercise.checks],
            "seeds": list(exercise.seeds),
        },
        "submissions": [
            {
                "student": one.student,
                "file": one.file,
                "sha256": one.sha256,
                "status": "not graded" if one.lost else "graded",
                "reason": one.lost or one.stopped,
                "points": None if one.lost else one.points,
                "of": total_of(exercise),
                "marks": [{**structs.asdict(found), "seed": seed} for seed, found in one.marks],
                "variants": grading_object(one)["variants"],
            }
            for one in gradings
        ],
        "similar": [{"students": [one.first, one.second], "similarity": one.similarity} for one in alike],
    }
    return found | {"digest": hashlib.sha256(canonical_json(found).encode()).hexdigest()}


def canonical_json(found: Object) -> str:
    """Return JSON in ASCII with sorted keys and without blanks: equal objects give equal text."""
    return json.dumps(found, sort_keys=True, separators=(",", ":"))


def written_json(found: object) -> str:
    return json.dumps(found, indent=2, ensure_ascii=True) + "\n"


# --- a grading sent between processes --------------------------------------------------------------------------------


def grading_object(grading: Grading) -> Object:
    variants = [
        {**structs.asdict(one), "marks": [structs.asdict(found) for found in one.marks]} for one in grading.variants
    ]
    return structs.asdict(grading) | {"variants": variants}


def grading_from(found: Mapping[str, Any]) -> Grading:
    """Return the grading from its JSON object."""
    variants = tuple(
        VariantMarks(**{**one, "marks": tuple(Mark(**each) for each in one["marks"])}) for one in found["variants"]
    )
    return Grading(**{**found, "variants": variants})


def gradebook(exercise: Exercise, gradings: Sequence[Grading]) -> str:
    """Return a CSV table (RFC 4180) with a row per student and the points of each check, including hidden ones."""
    stream = StringIO()
    table = csv.writer(stream)
    table.writerow(
        ("student", "file", "status", "points", "of", *(cell(one.name) for one in exercise.checks), "reason")
    )
    of = points_text(total_of(exercise))
    for one in gradings:
        status, points = ("not graded", "") if one.lost else ("graded", points_text(one.points))
        marks = [points_text(found.points) for _, found in one.marks] or [""] * len(exercise.checks)
        table.writerow((cell(one.student), cell(one.file), status, points, of, *marks, cell(one.lost or one.stopped)))
    return stream.getvalue()


def junit(exercise: Exercise, gradings: Sequence[Grading]) -> str:
    """Return JUnit's XML (junit-10.xsd of Jenkins): a suite per student, a case per check. An ungraded submission is
    an error; a check without all points is a failure.
    """
    lines, tests, failed, errors = list[str](), 0, 0, 0
    for one in gradings:
        wrong = [found for _, found in one.marks if not found.passed]
        class_name = f"classname={_attribute(f'{exercise.name}.{one.student}')}"
        lost = f'<error type="not graded" message={_attribute(one.lost)}/>'
        cases = [_case(exercise, class_name, *pair) for pair in one.marks]
        cases = cases or [f'    <testcase name="graded" {class_name}>{lost}</testcase>']
        counts = f'tests="{len(cases)}" failures="{len(wrong)}" errors="{int(bool(one.lost))}"'
        lines += [f"  <testsuite name={_attribute(one.student)} {counts}>", *cases, "  </testsuite>"]
        tests, failed, errors = tests + len(cases), failed + len(wrong), errors + bool(one.lost)
    counts = f'tests="{tests}" failures="{failed}" errors="{errors}"'
    head = f"<testsuites name={_attribute(exercise.title)} {counts}>"
    return "\n".join(('<?xml version="1.0" encoding="UTF-8"?>', head, *lines, "</testsuites>", ""))


def _case(exercise: Exercise, class_name: str, seed: int | None, found: Mark) -> str:
    names = f"name={_attribute(found.name)} {class_name}"
    if found.passed:
        return f"    <testcase {names}/>"
    variant = exercise.seeds.index(seed)
    where = f" (variant {variant}, seed {seed})" if variant else ""
    said = f"{points_text(found.points)} of {points_text(found.of)} points: {found.reason}{where}"
    return f'    <testcase {names}><failure type="check" message={_attribute(said)}/></testcase>'


def _attribute(text: str) -> str:
    return quoteattr(plain(text))


FORMULA = ("=", "+", "-", "@", "\t", "\r")  # characters with which a formula in a spreadsheet begins
_SLUG = re.compile(r"[^A-Za-z0-9_.-]+")


def plain(text: str) -> str:
    """Return a string as one line: line ends become blanks, and invisible characters become `^[` or `<U+202E>`."""
    # keep the joiners U+200C and U+200D, which some scripts need
    return "".join(one if one.isprintable() or one in "\u200c\u200d" else _visible_sign(one) for one in text)


def _visible_sign(character: str) -> str:
    code = ord(character)
    if character in "\n\r\t":
        return " "
    return f"^{chr(code ^ 0x40)}" if code < 0x80 else f"<U+{code:04X}>"


def cell(text: str) -> str:
    """Return a string as a cell of a CSV table; a string that a spreadsheet would take for a formula gets an
    apostrophe."""
    return f"'{plain(text)}" if text.lstrip().startswith(FORMULA) or text.startswith(FORMULA) else plain(text)


def points_text(points: float) -> str:
    """Return points without trailing zeros: `7`, `7.5`."""
    return f"{points:.2f}".rstrip("0").rstrip(".")


def file_stem(name: str, taken: set[str]) -> str:
    """Return a file name that is valid on every system and not in `taken`, and add it to `taken`."""
    stem = _SLUG.sub("_", name)[:60].strip(".") or "_"
    if stem.split(".")[0].casefold() in DEVICES:
        stem = f"_{stem}"
    return _unique_name(stem, "-", taken)


def _unique_name(stem: str, sign: str, taken: set[str]) -> str:
    """Return a name that is not in `taken`, regardless of case, with a number if necessary; add it to `taken`."""
    names = (f"{stem}{sign}{number}" if number > 1 else stem for number in count(1))
    found = next(name for name in names if name.casefold() not in taken)
    taken.add(found.casefold())
    return found


class ShownMark(Struct, frozen=True):
    """A mark as the student sees it. `variant`: the variant of the mark; 0 for the unchanged exercise. `at`: the time
    in the run at which the reason can be seen [s]."""

    name: str
    points: float
    of: float
    reason: str = ""
    hint: str = ""
    at: float | None = None
    variant: int = 0

    @property
    def passed(self) -> bool:
        """Return whether all points were earned."""
        return self.points == self.of

    @property
    def reason_text(self) -> str:
        place = f" (in variant {self.variant}, where the exercise has moved things)" if self.variant else ""
        return f"{self.reason}{place}" if self.reason else ""


def shown_marks(exercise: Exercise, grading: Grading) -> tuple[ShownMark, ...]:
    """Return the marks of a grading that the student may see."""
    seeds = exercise.seeds
    marks = [
        ShownMark(plain(one.name), one.points, one.of, plain(one.reason), plain(one.hint), one.at, seeds.index(seed))
        for seed, one in grading.marks
        if not one.hidden
    ]
    hidden = [one for _, one in grading.marks if one.hidden]
    if hidden:
        points, of = sum(one.points for one in hidden), sum(one.of for one in hidden)
        marks.append(ShownMark("other checks", round_to(points, POINT_STEP), round_to(of, POINT_STEP)))
    return tuple(marks)


def gradescope(exercise: Exercise, grading: Grading) -> Object:
    """Return the content of Gradescope's results.json for one submission."""
    if grading.lost:
        output = f"Not graded: {plain(grading.lost)}. The score of 0 is no mark: ask who teaches the course."
        return {"score": 0.0, "output": output, "output_format": "text", "stdout_visibility": "hidden", "tests": []}
    stopped = f"The program stopped: {plain(grading.stopped)}" if grading.stopped else "The program ran to its end."
    tests = [
        {
            "name": one.name,
            "name_format": "text",
            "score": one.points,
            "max_score": one.of,
            "status": "passed" if one.passed else "failed",
            "output": "\n".join(filter(None, (one.reason_text, one.hint and f"Hint: {one.hint}"))),
            "output_format": "text",
            "visibility": "visible",
        }
        for one in shown_marks(exercise, grading)
    ]
    return {
        "score": grading.points,
        "output": stopped,
        "output_format": "text",
        "stdout_visibility": "hidden",
        "tests": tests,
    }


def check50(exercise: Exercise, grading: Grading) -> Object:
    """Return the JSON of one submission in the form that `check50 -o json` writes."""
    marks = shown_marks(exercise, grading)
    names, results = set[str](), list[Object]()
    if grading.lost:
        cause = {"rationale": f"not graded: {plain(grading.lost)}", "help": None}
        marks = tuple(ShownMark(plain(one.name), 0.0, one.points) for one in exercise.checks if not one.hidden)
    for one in marks:
        passed = None if grading.lost else one.passed
        if not grading.lost:
            lost = f"{points_text(one.points)} of {points_text(one.of)} points"
            cause = {"rationale": f"{one.reason_text}: {lost}" if one.reason_text else lost, "help": one.hint or None}
        stem = re.sub(r"\W+", "_", one.name.lower(), flags=re.ASCII).strip("_") or "check"
        results.append(
            {
                "name": _unique_name(stem, "_", names),
                "description": one.name,
                "passed": passed,
                "log": [],
                "cause": None if passed else cause,
                "data": {} if grading.lost else {"points": one.points, "of": one.of},
                "dependency": None,
            }
        )
    return {"slug": exercise.name, "results": results, "version": "3.0.0"}


FOR_STUDENTS: Mapping[str, Any] = {"gradescope": gradescope, "check50": check50}
