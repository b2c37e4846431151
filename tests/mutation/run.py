"""Mutation testing: `python -m tests.mutation.run [MUTANTS [SEED [FOLDER [PART PARTS]]]]`.

Run `python -m tests.mutation.coverage_map` first. So many mutants (`mutants.py`) are drawn by a seed, as many from each
of five folders. Each meets the tests that run its line, the quick ones of its own test file first, in a process forked
from one that has the libraries loaded and nothing of the product; a mutant is killed when one fails, or when the tests
never end. Verdicts are added to `verdicts.jsonl` under the mutant and the digests of its file and its tests: a run goes
on where it was stopped. `score.json` has the outcome and every survivor of a whole run (after parts that ran side by
side, start one); `equivalent.txt` has those that no test can tell from the original, with the proof.
"""

from __future__ import annotations

import ast
import hashlib
import importlib.abc
import importlib.machinery
import json
import os
import resource
import signal
import sys
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import zip_longest
from pathlib import Path
from random import Random
from types import CodeType
from typing import Any, NoReturn

import hypothesis
import lark
import msgspec
import numpy
import prompt_toolkit
import pytest
import rich

from tests.by_hand import command
from tests.mutation.coverage_map import FOLDERS, MAP, ROOT
from tests.mutation.mutants import Mutant, mutants, mutated

LOADED = (hypothesis, lark, msgspec, numpy, prompt_toolkit, rich)  # before the fork
OURS = ("vrs_cli", "tests.by_hand")
HERE = Path(__file__).parent
VERDICTS, SCORE, EQUIVALENT = (HERE / name for name in ("verdicts.jsonl", "score.json", "equivalent.txt"))
BUDGET = 20.0  # [s, under coverage, which is more than they take] of unmutated tests that a mutant meets
LONGEST = 60  # [s of CPU] a mutant keeps its tests busy
MAX_WAIT = 120.0  # [s] it keeps them waiting
MAX_PATIENCE = 5.0  # [s] of one live test: an unmutated one waits for less
KILLED, SURVIVED, UNCOVERED, ENDLESS = "killed", "survived", "no test runs it", "endless"
OUTCOMES = {
    pytest.ExitCode.OK: SURVIVED,
    pytest.ExitCode.TESTS_FAILED: KILLED,
    pytest.ExitCode.INTERRUPTED: KILLED,  # the tests cannot even be imported
    pytest.ExitCode.USAGE_ERROR: KILLED,  # nor can their conftest
}  # every other is a mistake of this script


def drawn(count: int, seed: int) -> list[Mutant]:
    """Draw as many mutants from each folder, the folders in turn: a stopped run has as many of each."""
    random, found = Random(seed), list[list[Mutant]]()
    for number, folder in enumerate(FOLDERS):
        files = sorted((ROOT / "vrs_cli" / folder).rglob("*.py"))
        all_of_them = [one for file in files for one in mutants(str(file.relative_to(ROOT)), file.read_text())]
        found.append(random.sample(all_of_them, (count + number) // len(FOLDERS)))
    return [one for turn in zip_longest(*found) for one in turn if one]


# --- the tests of a mutant ---------------------------------------------------------------------------------------


@cache
def covered() -> dict[str, Any]:
    return dict(json.loads(MAP.read_text()))


def tests_of(mutant: Mutant) -> list[str]:
    """The tests that run its line: those of its own test file first, those of another of the five folders last, of each
    the quick ones first; then others that run its file: what is run once, at import or into a cache, may have been run
    by any test before.
    """
    tests, lines = covered()["tests"], covered().get(mutant.file, {})
    names = list(tests)
    line = {names[number] for number in lines.get(str(mutant.line), ())}
    file = {names[number] for numbers in lines.values() for number in numbers}
    folder, _, stem = mutant.file.removeprefix("vrs_cli/").removesuffix(".py").rpartition("/")
    mirrored = f"tests/{folder}/test_{stem}"
    file |= {name for name in names if name.startswith(mirrored)}
    while not file and folder:  # it has only what is run at import
        file = {name for name in names if name.startswith(f"tests/{folder}/")}
        folder = folder.rpartition("/")[0]

    elsewhere = tuple(f"tests/{other}/" for other in FOLDERS if not mutant.file.startswith(f"vrs_cli/{other}/"))

    def rank(name: str) -> tuple[object, ...]:
        far = name.startswith(elsewhere)
        return mutant.within and name not in line, not name.startswith(mirrored), far, tests[name], name

    chosen, seconds = [], 0.0
    for name in sorted(file, key=rank):
        seconds += tests[name]
        if chosen and seconds > BUDGET:
            break
        chosen.append(name)
    return chosen


@dataclass(eq=False)
class Chosen:
    """A plugin: run these tests, in this order, until one fails or BUDGET is spent; write the failed one to a pipe."""

    names: Sequence[str]
    failed: int  # the end of the pipe to write to
    begin: float = 0.0  # of the first test

    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        place = {name: k for k, name in enumerate(self.names)}
        items[:] = sorted((item for item in items if item.nodeid in place), key=lambda item: place[item.nodeid])
        self.begin = time.process_time()

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_protocol(self) -> bool | None:
        """Leave out a test when BUDGET is spent."""
        return True if time.process_time() > self.begin + BUDGET else None

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.failed:
            os.write(self.failed, json.dumps([report.nodeid, "live" in report.keywords]).encode() + b"\n")


# --- one mutant --------------------------------------------------------------------------------------------------


class Planted(importlib.abc.MetaPathFinder):
    """Finds the mutated module in place of the one in the file."""

    def __init__(self, mutant: Mutant) -> None:
        self.path = ROOT / mutant.file
        self.name = mutant.file.removesuffix(".py").replace("/", ".")
        self.tree = mutated(self.path.read_text(), mutant)

    def find_spec(self, name: str, _path: object = None, _target: object = None) -> Any:
        if name != self.name:
            return None
        return importlib.machinery.ModuleSpec(name, _Loader(name, str(self.path), self.tree), origin=str(self.path))


class _Loader(importlib.machinery.SourceFileLoader):
    def __init__(self, name: str, path: str, tree: ast.Module) -> None:
        super().__init__(name, path)
        self.tree = tree

    def get_code(self, fullname: str) -> CodeType:
        return compile(self.tree, self.get_filename(fullname), "exec")


def verdict(mutant: Mutant) -> tuple[str, str]:
    """Return the verdict and the failed test. A live test must fail a second time, and pass without the mutant: it may
    fail because the machine is busy.
    """
    tests = tests_of(mutant)
    while tests:
        found, failed, live = outcome(mutant, tests)
        if found is KILLED and not failed and outcome(None, tests)[0] != SURVIVED:
            sys.exit(f"tests fail without a mutant: {' '.join(tests)}")  # they are being edited, as a rule
        if not live or (outcome(mutant, [failed])[0] != SURVIVED and outcome(None, [failed])[0] == SURVIVED):
            return found, failed
        tests = [name for name in tests if name != failed]
    return UNCOVERED, ""


def outcome(mutant: Mutant | None, tests: Sequence[str]) -> tuple[str, str, bool]:
    """Run the tests in a child; return the verdict, the failed test, and whether that is a live one."""
    reading, writing = os.pipe()
    child = os.fork()
    if not child:
        _meet(mutant, tests, writing)
    os.close(writing)
    status = _ended(child)
    with os.fdopen(reading, "rb") as stream:
        failed, live = json.loads(stream.readline() or '["", false]')
    if os.WIFSIGNALED(status):
        return ENDLESS if os.WTERMSIG(status) in (signal.SIGXCPU, signal.SIGKILL) else KILLED, failed, live
    return OUTCOMES[pytest.ExitCode(os.WEXITSTATUS(status))], failed, live


def _ended(child: int) -> int:
    """Return the status of a process; kill it when it has waited MAX_WAIT for anything but a core."""
    begin = time.monotonic()
    while time.monotonic() - begin - _without_core(child) < MAX_WAIT:
        found, status = os.waitpid(child, os.WNOHANG)
        if found:
            return status
        time.sleep(0.05)
    os.kill(child, signal.SIGKILL)
    return os.waitpid(child, 0)[1]


def _without_core(child: int) -> float:
    """Return the seconds in which a process was ready to run, but other processes had the cores."""
    try:
        return int(Path(f"/proc/{child}/schedstat").read_text().split()[1]) * 1e-9
    except (OSError, IndexError):
        return 0.0


def _meet(mutant: Mutant | None, tests: Sequence[str], failed: int) -> NoReturn:
    """In the child: run the tests, and leave."""
    resource.setrlimit(resource.RLIMIT_CPU, (LONGEST, LONGEST + 1))
    resource.setrlimit(resource.RLIMIT_AS, (4 << 30, 4 << 30))
    nothing = os.open(os.devnull, os.O_RDWR)
    for stream in (0, 1, 2):
        os.dup2(nothing, stream)
    status = 1
    try:
        for name in [name for name in sys.modules if name.startswith(OURS)]:
            del sys.modules[name]  # what `command` needs: the tests load all of the product anew
        if mutant:
            sys.meta_path.insert(0, Planted(mutant))
        from tests import live

        live.PATIENCE, live.MARKS = MAX_PATIENCE, (pytest.mark.live,)  # a mutant is killed by the first failure
        files = [file for file in sorted({name.split("::")[0] for name in tests}) if Path(file).exists()]
        quiet = ["-x", "-q", "-p", "no:cacheprovider", "-p", "no:xdist", *files]
        status = int(pytest.main(quiet, plugins=[Chosen(tests, failed)]))
    finally:
        os._exit(status)


# --- all of them -------------------------------------------------------------------------------------------------


def name_of(mutant: Mutant) -> str:
    """Its text, and which of those with the same text it is."""
    return f"{mutant.text} #{mutant.place}.{mutant.choice}"


def key(mutant: Mutant) -> list[str]:
    digest = hashlib.sha256((ROOT / mutant.file).read_bytes()).hexdigest()[:16]
    return [name_of(mutant), digest]


def known() -> dict[tuple[str, ...], dict[str, Any]]:
    if not VERDICTS.exists():
        return {}
    rows = map(json.loads, VERDICTS.read_text().splitlines())
    return {tuple(row["mutant"]): row for row in rows}


def digest_of(tests: Sequence[str]) -> str:
    """Return a digest of the names and the files of tests."""
    files = sorted({name.split("::")[0] for name in tests})
    texts = [(ROOT / file).read_bytes() for file in files if (ROOT / file).exists()]
    return hashlib.sha256(b"\0".join([*texts, *(name.encode() for name in tests)])).hexdigest()[:16]


def judged(chosen: Sequence[Mutant]) -> Iterator[tuple[Mutant, str]]:
    before = known()
    for mutant in chosen:
        row = before.get(tuple(key(mutant)), {})
        tests = digest_of(tests_of(mutant))
        if row.get("verdict") not in (KILLED, ENDLESS) and row.get("tests") != tests:  # run again only for other tests
            found, failed = verdict(mutant)
            row = {"mutant": key(mutant), "verdict": found, "by": failed, "tests": tests}
            with VERDICTS.open("a") as stream:
                stream.write(json.dumps(row) + "\n")
        yield mutant, row["verdict"]


def main(count: int = 300, seed: int = 1, folder: str = "", part: int = 1, parts: int = 1) -> int:
    chosen = [mutant for mutant in drawn(count, seed) if folder in mutant.file][part - 1 :: parts]
    results = dict[Mutant, str]()
    for mutant, found in judged(chosen):
        results[mutant] = found
        if found not in (KILLED, ENDLESS):
            print(f"{found}: {mutant.text}", flush=True)
    proven = set(EQUIVALENT.read_text().splitlines()) if EQUIVALENT.exists() else set[str]()
    alive = [m for m, found in results.items() if found not in (KILLED, ENDLESS)]
    equivalent = [m for m in alive if not proven.isdisjoint((m.text, name_of(m)))]
    score = (len(chosen) - len(alive)) / max(len(chosen) - len(equivalent), 1)
    told = {
        "mutants": len(chosen),
        "seed": seed,
        **Counter(results.values()),
        "equivalent": len(equivalent),
        "score": round(score, 4),
        "survivors": [m.text for m in alive if m not in equivalent],
    }
    if not folder and parts == 1:
        SCORE.write_text(json.dumps(told, indent=1) + "\n")
    print({name: value for name, value in told.items() if name != "survivors"})
    return 0


if __name__ == "__main__":
    command(main)
