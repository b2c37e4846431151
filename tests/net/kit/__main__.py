"""The conformance kit for clients of the protocol; docs/protocol.md tells how to use it.

python -m tests.net.kit list: the conversations, and what a client has to compute for each.
python -m tests.net.kit record FOLDER: write them as JSON files.
python -m tests.net.kit run [--without NEED,NEED] [--only NAME,NAME] COMMAND...: try a client.
"""

from __future__ import annotations

import json
import sys
from argparse import REMAINDER, ArgumentParser, RawDescriptionHelpFormatter
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from subprocess import PIPE, Popen
from typing import Any

from tests.net.kit.conversation import Conversation, Step, faults
from tests.net.kit.conversations import conversations

PATIENCE = 10.0  # [s] in which a client ends


class Process:
    """A client that is a command: a line of JSON for each step, a line back."""

    def __init__(self, command: list[str]) -> None:
        self.process = Popen(command, stdin=PIPE, stdout=PIPE, text=True, encoding="utf-8")

    def __call__(self, step: Step) -> Mapping[str, Any]:
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        try:
            self.process.stdin.write(json.dumps(step) + "\n")
            self.process.stdin.flush()
        except BrokenPipeError:
            raise ValueError("it has ended") from None
        line = self.process.stdout.readline()
        if not line:
            raise ValueError(f"it has ended, with status {self.process.wait(PATIENCE)}")
        answer = json.loads(line)
        if not isinstance(answer, dict):
            raise TypeError(f"no object: {line.strip()[:200]}")
        return answer

    def close(self) -> None:
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.process.kill()
        with suppress(BrokenPipeError):
            self.process.stdin.close()
        self.process.stdout.close()
        self.process.wait(PATIENCE)


def record(folder: Path) -> int:
    folder.mkdir(parents=True, exist_ok=True)
    for one in conversations():
        (folder / f"{one.name}.json").write_text(one.to_json(), encoding="utf-8")
    return 0


def show() -> int:
    for one in conversations():
        print(f"{one.name:18} {', '.join(one.needs) or '-':32} {one.about}")
    return 0


def run(command: list[str], tried: Sequence[Conversation]) -> int:
    """Try a command with each conversation. Return 1 where it did something wrong."""
    failed = 0
    for one in tried:
        try:
            client = Process(command)
        except OSError as error:
            print(f"{command[0]} cannot be started: {error.strerror}", file=sys.stderr)
            return 2
        try:
            wrong = list(faults(one, client))
        finally:
            client.close()
        failed += bool(wrong)
        print(f"{'FAILED' if wrong else 'passed'} {one.name}: {one.about}", *wrong, sep="\n       ", flush=True)
    return 1 if failed else 0


def main() -> int:
    parser = ArgumentParser("python -m tests.net.kit", description=__doc__, formatter_class=RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="what", required=True)
    commands.add_parser("list")
    commands.add_parser("record").add_argument("folder", type=Path)
    trial = commands.add_parser("run")
    trial.add_argument("--without", default="", help="what the client does not compute, as `list` tells")
    trial.add_argument("--only", default="", help="names of conversations")
    trial.add_argument("command", nargs=REMAINDER)
    given = parser.parse_args()
    if given.what == "list":
        return show()
    if given.what == "record":
        return record(given.folder)
    if not given.command:
        parser.error("run needs the command that starts the client")
    everything = list(conversations())
    without, only = ({*filter(None, text.split(","))} for text in (given.without, given.only))
    names, needs = {one.name for one in everything}, {need for one in everything for need in one.needs}
    for option, wanted, known in (("without", without, needs), ("only", only, names)):
        if wrong := wanted - known:
            parser.error(f"--{option}: there is no {', '.join(sorted(wrong))}; there are {', '.join(sorted(known))}")
    return run(given.command, [one for one in everything if not without & {*one.needs} and one.name in (only or names)])


if __name__ == "__main__":
    sys.exit(main())
