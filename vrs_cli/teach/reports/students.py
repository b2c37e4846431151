"""Show students their marks, also as JSON for Gradescope and check50; text of students is made harmless.

Hidden checks show only their total points. Sources: "Autograder Specifications" of Gradescope, "JSON specification" of
check50 3.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from itertools import count
from typing import Any

from msgspec import Struct

from vrs_cli.files.opening import DEVICES
from vrs_cli.teach.exercise import Exercise
from vrs_cli.teach.grading import Grading
from vrs_cli.teach.judging.basis import round_to
from vrs_cli.teach.marking import POINT_STEP

FORMULA = ("=", "+", "-", "@", "\t", "\r")  # first characters of formulas in spreadsheets
_SLUG = re.compile(r"[^A-Za-z0-9_.-]+")


def plain(text: str) -> str:
    """Return a text as one line: blanks for line ends, and invisible characters as `^[` or `<U+202E>`."""
    # some scripts need the joiners U+200C and U+200D
    return "".join(one if one.isprintable() or one in "\u200c\u200d" else _visible_sign(one) for one in text)


def _visible_sign(character: str) -> str:
    code = ord(character)
    if character in "\n\r\t":
        return " "
    return f"^{chr(code ^ 0x40)}" if code < 0x80 else f"<U+{code:04X}>"


def cell(text: str) -> str:
    """Return a text as a cell of a CSV table; a text that a spreadsheet would compute gets an apostrophe."""
    return f"'{plain(text)}" if text.lstrip().startswith(FORMULA) or text.startswith(FORMULA) else plain(text)


def points_text(points: float) -> str:
    """Return points without needless zeros: `7`, `7.5`."""
    return f"{points:.2f}".rstrip("0").rstrip(".")


def file_stem(name: str, taken: set[str]) -> str:
    """Return a file name that is valid on every system and not in `taken`, and add it to `taken`."""
    stem = _SLUG.sub("_", name)[:60].strip(".") or "_"
    if stem.split(".")[0].casefold() in DEVICES:
        stem = f"_{stem}"
    return _unique_name(stem, "-", taken)


def _unique_name(stem: str, sign: str, taken: set[str]) -> str:
    """Return a name that is not in `taken` in any case of letters, with a number if need be; add it to `taken`."""
    names = (f"{stem}{sign}{number}" if number > 1 else stem for number in count(1))
    found = next(name for name in names if name.casefold() not in taken)
    taken.add(found.casefold())
    return found


Object = dict[str, Any]


class ShownMark(Struct, frozen=True):
    """A mark as its student sees it. `variant`: the variant of the mark; 0: nothing was moved. `at`: the time that
    shows the reason [s].
    """

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
    """Return the marks of a grading that its student may see."""
    seeds = exercise.seeds
    open_marks = tuple(
        ShownMark(plain(one.name), one.points, one.of, plain(one.reason), plain(one.hint), one.at, seeds.index(seed))
        for seed, one in grading.marks
        if not one.hidden
    )
    hidden = [one for _, one in grading.marks if one.hidden]
    if not hidden:
        return open_marks
    points, of = sum(one.points for one in hidden), sum(one.of for one in hidden)
    return (*open_marks, ShownMark("other checks", round_to(points, POINT_STEP), round_to(of, POINT_STEP)))


def gradescope(exercise: Exercise, grading: Grading) -> Object:
    """Return results.json of one submission."""
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
    """Return the JSON of one submission as `check50 -o json` writes it."""
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
