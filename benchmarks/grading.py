"""Grade a class: `python -m benchmarks.grading [SUBMISSIONS]`, 300 in 5 variants where nothing else is said, a tenth of
them hostile; then each hostile one by itself. Seconds are CPU, of all processes.
"""

from __future__ import annotations

import random
import re
import resource
import sys
import time
from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path

from msgspec import structs

from vrs_cli.teach.exercise import Exercise, read_exercise
from vrs_cli.teach.exercise_text import find_exercise
from vrs_cli.teach.grading import Grader, Submission, by_student
from vrs_cli.teach.many import Graded, core_count, grade_many
from vrs_cli.teach.reports.results import results_object
from vrs_cli.teach.variants import Variant

SUBMISSIONS, RUNS = 300, 5
TENTH = 10
LOST_BAR, CLASS_BAR = 0.3, 60.0  # [s]


def program(*steps: str) -> str:
    """A submission of these steps."""
    return "\n".join((".PROGRAM pick()", *(f"    {step}" for step in steps), ".END", ""))


HOSTILE: Mapping[str, str] = {
    "loop": program("x = 0", "WHILE TRUE DO", "    x = x+1", "END"),
    "memory": program('$a[0] = "0123456789"', "FOR i = 1 TO 1000000", "    $a[i] = $a[i-1]", "END"),
    "output": program("WHILE TRUE DO", f'    TYPE "{"x" * 100}", /S', "END"),
    "typed lines": program("FOR i = 1 TO 1000000", "    TYPE i", "END"),
    "disk": program("ATTACH (5)", 'FOPENW (5) "large.txt"', "WHILE TRUE DO", f'    WRITE (5) "{"x" * 100}"', "END"),
    "paths": program(
        "ATTACH (5)",
        *(
            line
            for name in (
                "../../secret",
                "/etc/passwd",
                "a/../../b",
                "CON",
                "link",
                "..\\\\x",
                "C:\\\\x",
                "~/x",
                "",
                ".",
            )
            for line in (f'FOPENR (5) "{name}"', f'FOPENW (5) "{name}"', "TYPE IOSTAT(5)", f'FDELETE (5) "{name}"')
        ),
    ),
    "another student": program(
        "ATTACH (5)",
        *(
            line
            for name in ("../bob.v2", "../../1/variant0/x", "bob.v2", "../teacher/checks.toml", "../teacher/model.v2")
            for line in (f'FOPENR (5) "{name}"', "READ (5) $line", "TYPE IOSTAT(5), $line")
        ),
    ),
    "recursion": program("CALL pick()"),
    "reactions": program(
        "REACTE other", "FOR i = 1 TO 8", "    REACT 1001, other", "END", "WHILE TRUE DO", "    SIGNAL 1, -1", "END"
    )
    + ".PROGRAM other()\n    SIGNAL 2, -2\n    RETURN\n.END\n",
    "giant arrays": program("FOR i = 0 TO 1000000", "    a[i*30, i] = i", "    SET p[i] = NULL", "END"),
    "deep expressions": program(f"x = {'(' * 3000}1{')' * 3000}", f"y = {'-' * 3000}1", f"z = {'1+' * 3000}1"),
    "deep structures": program(*["IF TRUE THEN"] * 2000, *["END"] * 2000),
    "prompts": program("WHILE TRUE DO", '    PROMPT "again? ", $x', "END"),
    "time": program("WHILE TRUE DO", "    DELAY 100000", "END"),
    "many motions": program("WHILE TRUE DO", "    DRIVE 1, 1, 100", "    DRIVE 1, -1, 100", "END"),
    "tasks": program(*(f"EXECUTE {number} other()" for number in range(1, 7)), "WHILE TRUE DO", "    x = 1", "END")
    + ".PROGRAM other()\n    WHILE TRUE DO\n        x = 1\n    END\n.END\n",
    "no text": "\x00\x01\xff" * 1000,
    "long line": ".PROGRAM pick()\n x = " + "1+" * 100_000 + "1\n.END\n",
    "long file": ".PROGRAM pick()\n" + "x = 1\n" * 100_000 + ".END\n",
}
"""Submissions of students who try what they can; none may cost more than a mark."""


def submissions(exercise: Exercise, count: int, seed: int = 1) -> Iterator[Submission]:
    """So many submissions: the model with other numbers, wrong ones, and a tenth hostile ones."""
    R = random.Random(seed)
    texts = [exercise.solution, *(one.text for one in exercise.wrong)]
    hostile = list(HOSTILE.values())
    for number in range(count):
        text = R.choice(texts) if number % 3 else exercise.solution
        text = re.sub(r"(?m)^(\s*(?:APPRO|APPROS|DEPART|DEPARTS)\b.*?)(\d+)\s*$", rf"\g<1>{R.randint(60, 120)}", text)
        if number % TENTH == 0:
            text = hostile[number // TENTH % len(hostile)]
        yield Submission(f"student {number:03}", f"{number:03}.v2", text)


def five_runs(exercise: Exercise) -> Exercise:
    """The exercise with so many variants that each submission has five runs."""
    if not exercise.variants:
        raise SystemExit(f"{exercise.name} has no variants")
    groups = exercise.variants[-1].groups
    more = (Variant(1000 + seed, groups) for seed in range(RUNS))
    return structs.replace(exercise, variants=(*exercise.variants, *more)[: RUNS - 1])


def cpu() -> float:
    """Seconds of the processor that this process and all that it has waited for have taken."""
    usages = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(usage.ru_utime + usage.ru_stime for usage in usages)


def measured(grader: Grader, all_of_them: list[Submission], jobs: int) -> tuple[list[Graded], float, float]:
    """The gradings, seconds of CPU and on the wall."""
    begin, since = cpu(), time.monotonic()
    found = list(grade_many(grader, all_of_them, jobs))
    return found, cpu() - begin, time.monotonic() - since


def main() -> None:
    numbers = [int(word) for word in sys.argv[1:] if word.isdigit()]
    folders = [word for word in sys.argv[1:] if Path(word).is_dir()]
    count, jobs = numbers[0] if numbers else SUBMISSIONS, core_count()
    exercise = five_runs(read_exercise(folders[0] if folders else find_exercise("pick")))
    grader = Grader(exercise)
    found, took, wall = measured(grader, list(submissions(exercise, count)), jobs)
    gradings = by_student([one.grading for one in found])
    runs = sum(len(one.variants) for one in gradings)
    digest = results_object(exercise, gradings, ())["digest"]
    lost = Counter(one.lost for one in gradings if one.lost)
    print(f"{count} submissions, {runs} runs of at most {RUNS * count}, {jobs} processes: {took:.1f} s of CPU")
    print(f"{1e3 * took / (RUNS * count):.1f} ms for each of {RUNS * count}; {wall:.1f} s on the wall")
    print(f"on {jobs} quiet cores {took / jobs:.1f} s, wanted {CLASS_BAR * count / SUBMISSIONS:.1f} s")
    print(f"not graded: {sum(lost.values())} {dict(lost)}")
    print(f"digest {digest}")
    print(f"\nhostile ones, each by itself; wanted at most {LOST_BAR} s of CPU")
    for name, text in HOSTILE.items():
        (one,), took, _ = measured(grader, [Submission(name, "x.v2", text)], 1)
        mark = "not graded" if one.grading.lost else f"{one.grading.points:g} points"
        print(f"{name:18} {took:6.3f} s  {mark:12} {(one.grading.lost or one.grading.stopped)[:110]}")


if __name__ == "__main__":
    main()
