"""The programs of the suite and the rules of its manifest, as values; and what is wrong with what came of a program.

README.md has the format.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

HOME = Path(__file__).parent
CONFIDENCES = ("found", "known", "likely", "computed", "ours")
WORDS = (
    "signals",
    "file",
    "answer",
    "asked",
    "expect",
    "written",
    "fault",
    "task",
    "end",
    "dialect",
)  # of the lines above a program
FAULT = ("code", "program", "step")  # of an error, in the order of `; fault:`
NEAR = 0.01  # [deg] of a joint at its end
REPORT = """\
.PROGRAM report.end()
    CALL {main}
    BREAK
    HERE #report.end
    DECOMPOSE report.end[1] = #report.end
    FOR report.end = 1 TO 6
        TYPE /F0.4, report.end[report.end]
    END
.END
"""


@dataclass(frozen=True)
class Rule:
    """A row of the manifest: what a few programs show, how sure it is, and where it was found."""

    name: str
    text: str
    language: str
    confidence: str
    sources: tuple[str, ...]
    programs: tuple[str, ...]


@dataclass(frozen=True)
class Case:
    """A program with its inputs and what is to come of it. `fault`: code, program and step of the error at which it
    stops; `task`: of a task beside. `end`: joints in degrees, empty where it does not move."""

    name: str
    text: str
    signals: tuple[str, ...]
    files: dict[str, str]
    answers: tuple[str, ...]
    asked: tuple[str, ...]
    expected: tuple[str, ...]
    written: dict[str, str]
    fault: tuple[str, ...]
    task: tuple[str, ...]
    end: tuple[float, ...]

    @property
    def main(self) -> str:
        """The program that is executed: the first of the file."""
        found = re.search(r"^\s*\.PROGRAM\s+([\w.]+)", self.text, re.MULTILINE)
        assert found
        return found[1]


def read_rules() -> tuple[Rule, ...]:
    """Return the rules of the manifest."""
    rows = tomllib.loads((HOME / "manifest.toml").read_text(encoding="utf-8"))["rules"]
    return tuple(Rule(**{**row, "sources": tuple(row["sources"]), "programs": tuple(row["programs"])}) for row in rows)


def read_case(name: str) -> Case:
    """Read a program and the lines above it."""
    text = (HOME / "programs" / f"{name}.v2").read_text(encoding="utf-8")

    def said(word: str) -> tuple[str, ...]:
        start = f"; {word}:"
        return tuple(line.removeprefix(start).strip() for line in text.splitlines() if line.startswith(start))

    def files(word: str) -> dict[str, str]:
        found: dict[str, str] = {}
        for line in said(word):
            file, _, content = line.partition(" ")
            found[file] = f"{found.get(file, '')}{content}\n"
        return found

    fault, task = (tuple(" ".join(said(word)).split()) for word in ("fault", "task"))
    end = tuple(map(float, said("end")[0].split())) if said("end") else ()
    inputs = said("signals"), files("file"), said("answer")
    return Case(name, text, *inputs, said("asked"), said("expect"), files("written"), fault, task, end)


@dataclass(frozen=True)
class Outcome:
    """What came of a program: the status of the command, its two streams, and the files that are there after."""

    status: int
    stdout: str
    stderr: str
    files: dict[str, str]


def faults(case: Case, outcome: Outcome, pattern: re.Pattern[str] | None, ends: bool) -> list[str]:
    """Return what is not as the case says. `ends`: the last six lines are the joints at the end [deg]. `pattern` finds
    `code`, `program` and `step` of an error.
    """
    typed = outcome.stdout
    for text in case.asked:  # questions may stand there, on lines of their own or before what is typed
        typed = typed.replace(text, "", 1)
    lines = [line.strip() for line in typed.splitlines() if line.strip() or not case.asked]
    wrong = []
    if ends:
        lines, place = lines[:-6], lines[-6:]
        wrong += _wrong_end(case.end, place)
    if lines != list(case.expected):
        wrong.append(f"typed {lines}, not {list(case.expected)}")
    if outcome.files != case.written:
        wrong.append(f"wrote {outcome.files}, not {case.written}")
    if case.task:
        return wrong
    return wrong + _wrong_fault(case.fault, outcome.status, outcome.stdout + outcome.stderr, pattern)


def _wrong_end(end: Sequence[float], place: Sequence[str]) -> list[str]:
    try:
        near = len(place) == len(end) and all(abs(float(a) - b) <= NEAR for a, b in zip(place, end, strict=True))
    except ValueError:
        near = False
    return [] if near else [f"ended at {' '.join(place)}, not {' '.join(f'{joint:g}' for joint in end)}"]


def _wrong_fault(fault: Sequence[str], status: int, said: str, pattern: re.Pattern[str] | None) -> list[str]:
    if bool(fault) is not bool(status):
        return [f"the status is {status}, and the program is to {'stop with an error' if fault else 'complete'}"]
    if not fault or pattern is None:
        return []
    found = pattern.search(said)
    wanted = dict(zip(FAULT, fault, strict=True))
    told = found.groupdict() if found else dict.fromkeys(pattern.groupindex)
    return [
        f"the {word} of the error is {told[word]}, not {wanted[word]}" for word in told if told[word] != wanted[word]
    ]
