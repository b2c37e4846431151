"""Run the programs of this suite by any interpreter of VAL-II, and say which rules it keeps.

    python -m tests.conformance --command "vrs run {program} --quiet --signals {signals}"

README.md has the format of programs, of manifest.toml, and all options. Needs Python 3.11 or newer, and nothing else.
"""

from __future__ import annotations

import argparse
import re
import shlex
import subprocess
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from fnmatch import fnmatch
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

from .cases import CONFIDENCES, FAULT, REPORT, Case, Outcome, faults, read_case, read_rules


def judge(case: Case, command: str, fault: re.Pattern[str] | None, seconds: float, ends: bool) -> list[str]:
    """Run a case by a command in a folder of its own; return what is not as it should be."""
    with TemporaryDirectory() as name:
        folder = Path(name)
        for file, content in case.files.items():
            (folder / file).write_text(content, encoding="utf-8")
        ends = ends and bool(case.end)
        program, signals = folder / "case.v2", folder / "signals.csv"
        report = REPORT.format(main=case.main) if ends else ""
        program.write_text(report + case.text, encoding="utf-8")
        signals.write_text("".join(f"{line}\n" for line in case.signals), encoding="utf-8")
        words = [
            word.replace("{program}", str(program)).replace("{signals}", str(signals)) for word in shlex.split(command)
        ]
        typed_in = "".join(f"{line}\n" for line in case.answers)
        try:
            done = subprocess.run(
                words, cwd=folder, input=typed_in.encode(), capture_output=True, timeout=seconds, check=False
            )
        except subprocess.TimeoutExpired:
            return [f"not over after {seconds:g} s"]
        except OSError as error:
            raise SystemExit(f"{words[0]}: {error.strerror}") from None
        program.unlink(missing_ok=True)
        signals.unlink(missing_ok=True)
        written = {one.name: one.read_text(encoding="utf-8") for one in folder.iterdir() if one.is_file()}
    said, errors = (stream.decode(errors="replace") for stream in (done.stdout, done.stderr))
    return faults(case, Outcome(done.returncode, said, errors, written), fault, ends)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the cases that are asked for, and print what fails and a summary. Return 1 where one fails."""
    parser = argparse.ArgumentParser(prog="conformance", description="Run the VAL-II suite by an interpreter.")
    parser.add_argument("--command", help="what runs a program; {program} and {signals} are files")
    parser.add_argument("--only", default="*", metavar="GLOB", help="these programs, as 'for.*'")
    parser.add_argument("--language", nargs="*", metavar="LANGUAGE", help="rules of these: VAL VAL-II V+ vrs")
    parser.add_argument("--confidence", nargs="*", choices=CONFIDENCES, metavar="WORD", help=", ".join(CONFIDENCES))
    parser.add_argument(
        "--fault", type=re.compile, metavar="REGEX", help="finds groups code, program, step of an error"
    )
    parser.add_argument("--no-ends", action="store_true", help="for a robot that is no PUMA 560")
    parser.add_argument("--seconds", type=float, default=60.0, help="that a program may take (default 60)")
    parser.add_argument("--jobs", type=int, default=2, help="programs at once (default 2)")
    parser.add_argument("--list", action="store_true", help="print the rules, and run nothing")
    options = parser.parse_args(arguments)
    rules = [
        rule
        for rule in read_rules()
        if (options.language is None or rule.language in options.language)
        and (options.confidence is None or rule.confidence in options.confidence)
    ]
    chosen = [(rule, name) for rule in rules for name in rule.programs if fnmatch(name, options.only)]
    if options.list:
        for rule, name in chosen:
            print(f"{name:30} {rule.language:7} {rule.confidence:9} {', '.join(rule.sources) or '-':16} {rule.text}")
        return 0
    if "{program}" not in (options.command or ""):
        parser.error("--command is needed, as 'vrs run {program} --quiet --signals {signals}'")
    if options.fault and not set(options.fault.groupindex) <= set(FAULT):
        parser.error(f"--fault: the groups of an error are {', '.join(FAULT)}")
    if not chosen:
        parser.error("no program is like that")
    judged = partial(
        judge, command=options.command, fault=options.fault, seconds=options.seconds, ends=not options.no_ends
    )
    with ThreadPoolExecutor(options.jobs) as pool:
        found = list(pool.map(judged, [read_case(name) for _, name in chosen]))
    for (rule, name), wrong in zip(chosen, found, strict=True):
        for what in wrong:
            print(f"{name}: {what}\n    {rule.name} ({rule.confidence}): {rule.text}")
    for confidence in CONFIDENCES:
        passed = [not wrong for (rule, _), wrong in zip(chosen, found, strict=True) if rule.confidence == confidence]
        if passed:
            print(f"{confidence:9} {sum(passed):4} of {len(passed)}")
    failed = sum(map(bool, found))
    print(f"{len(chosen) - failed} of {len(chosen)} programs do what their rules say")
    return min(failed, 1)


if __name__ == "__main__":
    sys.exit(main())
