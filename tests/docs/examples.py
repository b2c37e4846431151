"""The examples of a page of Markdown, run as they stand.

    ```console          `$ command` and, after it, what it prints (standard output and error as they come)
    ```vrs              what is typed at the prompts of the shell, and its answers; one session a page,
    ```vrs new          begun afresh here
    ```vrs realtime     begun afresh in real time, where `; 2 s later` lets time pass
    ```val2 FILE.v2     a file that the examples after it read; without a name a piece of a program, which is checked
    ```toml FILE.toml   the same for a robot
    ```xml FILE.urdf    the same for a robot of URDF
    ```markdown FILE.md the same for the text of a lesson
    ```python FILE.py   the same for Python, which `$ python3 FILE.py` runs
    ```pycon            what is typed after Python's `>>> ` and `... `, and its answers; one session a page
    ```sh               commands that .ci/run takes from the page
    ```text             formulas and other things that nothing prints

In what is printed a line `...` stands for any lines; all others are compared character by character. A page is run in a
folder of its own that holds copies of `programs/` and of the robots, so an example may read what one before it wrote.
"""

from __future__ import annotations

import io
import os
import re
import shlex
import shutil
import subprocess
import sys
import tomllib
from codeop import compile_command
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import chdir, closing, redirect_stderr, redirect_stdout
from dataclasses import dataclass, replace
from difflib import ndiff
from pathlib import Path
from traceback import format_exception_only
from typing import Protocol
from unittest.mock import patch

from tests.docs.people import People
from tests.engine.wall import ManualWall
from tests.repl.afar import local_front_end
from vrs_cli.__main__ import main
from vrs_cli.engine.clock import RobotClock
from vrs_cli.interfaces.dialogue import Terminal
from vrs_cli.interfaces.session.session import Session
from vrs_cli.repl.front_end import FrontEnd
from vrs_cli.repl.loop import PlainTerminal
from vrs_cli.values.diagnostics import Severity

ROOT = Path(__file__).parents[2]
PEOPLE = ("ann", "bob")  # at one robot that is served
COPIED = ("programs", "vrs_cli/kinematics/robots")
ANYTHING = "..."

_FENCE = re.compile(r"^```(?P<language>\w*) ?(?P<argument>.*)$")
_COMMAND = re.compile(r"^\$ (?P<typed>.*)$")
# The lines that close a listing of LISTP begin with a dot too: `..PROGRAM name` is typed, `.PROGRAM name` is printed.
_PROMPT = re.compile(
    r"^(?P<prompt>(?:\([a-z][\w.]*\))?\.)(?!PROGRAM\b|END\b|LOCATIONS\b|REALS\b|STRINGS\b)(?P<typed>.*)$"
)
_STEP = re.compile(r"^(?P<prompt> *\d+\.\? )(?P<typed>.*)$")
_LATER = re.compile(r"; (?P<seconds>[0-9.]+) s later$")
# `vrs` with words that a shell leaves alone, at its place in a pipe
_PROGRAM = re.compile(r"vrs(?P<arguments>( [^|<>;&$`*]*?)?)(?P<errors> 2>&1| 2> /dev/null)?")


class PageFault(Exception):
    """A page is not written as its examples must be."""


@dataclass(frozen=True)
class Block:
    """A fenced block; `where` is its place, as README.md:12."""

    where: str
    language: str
    argument: str
    lines: tuple[str, ...]

    @property
    def text(self) -> str:
        return "\n".join(self.lines) + "\n"


@dataclass(frozen=True)
class Exchange:
    """What is typed after a prompt, and the lines that are to come."""

    prompt: str
    typed: str
    expected: tuple[str, ...]


# --- reading a page ------------------------------------------------------------------------------------------------


def blocks(name: str, text: str) -> Iterator[Block]:
    """The fenced blocks of a page. Raises PageFault for one that is not closed, or of a language not named above."""
    opened: re.Match[str] | None = None
    begin, lines = 0, list[str]()
    for number, line in enumerate(text.splitlines(), 1):
        fence = _FENCE.match(line)
        if opened is None and fence:
            opened, begin, lines = fence, number, []
        elif opened is not None and line == "```":
            yield _block(f"{name}:{begin}", opened, lines)
            opened = None
        else:
            lines.append(line)
    if opened is not None:
        raise PageFault(f"{name}:{begin}: the block is not closed")


def _block(where: str, fence: re.Match[str], lines: list[str]) -> Block:
    block = Block(where, fence["language"], fence["argument"].strip(), tuple(lines))
    if block.language not in LANGUAGES:
        raise PageFault(f"{where}: a block of language {block.language!r}; there is {', '.join(LANGUAGES)}")
    return block


def typed_in(block: Block) -> list[str]:
    """The lines that are typed in a session."""
    return [exchange.typed for exchange in exchanges(block, _PROMPT, _STEP)]


def exchanges(block: Block, *patterns: re.Pattern[str]) -> list[Exchange]:
    """What is typed in a block, each with what follows it. Raises PageFault where nothing could be found wrong."""
    found: list[tuple[re.Match[str], list[str]]] = []
    for line in block.lines:
        typed = next(filter(None, (pattern.match(line) for pattern in patterns)), None)
        if typed:
            found.append((typed, []))
        elif found:
            found[-1][1].append(line)
        else:
            raise PageFault(f"{block.where}: {line!r} comes before anything is typed")
    result = [Exchange(typed.groupdict().get("prompt", "$ "), typed["typed"], tuple(lines)) for typed, lines in found]
    if not result:
        raise PageFault(f"{block.where}: nothing is typed")
    for exchange in result:
        if exchange.expected and set(exchange.expected) == {ANYTHING}:
            raise PageFault(f"{block.where}: {exchange.typed!r} may print anything, so it shows nothing")
    return result


def matches(expected: Sequence[str], actual: Sequence[str]) -> bool:
    """Whether lines are the expected ones, ANYTHING standing for any number of any lines."""
    if not expected:
        return not actual
    first, rest = expected[0], expected[1:]
    if first == ANYTHING:
        return any(matches(rest, actual[skipped:]) for skipped in range(len(actual) + 1))
    return bool(actual) and actual[0] == first and matches(rest, actual[1:])


# --- running it ----------------------------------------------------------------------------------------------------


class Prompted(Protocol):
    """How one sits down at a robot."""

    def __call__(self, terminal: Terminal, *, clock: RobotClock | None = None) -> FrontEnd: ...


class Reader:
    """Somebody who does what a page says, in a folder of their own."""

    def __init__(self, folder: Path, seated: Prompted = local_front_end) -> None:
        self.folder, self._seated = folder, seated
        self.status = 0
        self.printed = io.StringIO()
        self.wall = ManualWall()
        self.front_end = self._new_session()
        self.names: dict[str, object] = {"__name__": "__main__"}  # of Python
        for part in COPIED:
            shutil.copytree(ROOT / part, folder / part)

    def differences(self, name: str, text: str) -> list[str]:
        """What is not as the page says, in order."""
        state = patch.dict(os.environ, XDG_STATE_HOME=f"{self.folder}-state")  # nothing of the user's own is read
        with state, chdir(self.folder), closing(People(self.folder)) as self._people:
            return [difference for block in blocks(name, text) for difference in LANGUAGES[block.language](self, block)]

    # --- command lines ---

    def console(self, block: Block) -> Iterator[str]:
        for exchange in exchanges(block, _COMMAND):
            yield from _difference(block, exchange, self.command(exchange.typed).splitlines())

    def command(self, line: str) -> str:
        """Run a command line; what it prints."""
        if line == "echo $?":
            return f"{self.status}\n"
        pipe = line.split(" | ")
        ours = [at for at, part in enumerate(pipe) if _PROGRAM.fullmatch(part)]
        if len(ours) != 1 or len(re.findall(r"\bvrs ", line)) > 1:
            return self._in_a_shell(line)
        at = ours[0]
        return self._in_a_pipe(" | ".join(pipe[:at]), pipe[at], " | ".join(pipe[at + 1 :]))

    def _in_a_pipe(self, before: str, ours: str, after: str) -> str:
        """`vrs` in this process, which need not begin; bash does what stands before and after it."""
        program = _PROGRAM.fullmatch(ours)
        assert program is not None
        given, out, err = _file(self._in_a_shell(before) if before else ""), _file(), _file()
        apart = program["errors"] == " 2> /dev/null" or (after and not program["errors"])
        kept, sys.stdin = sys.stdin, given
        try:
            with redirect_stdout(out), redirect_stderr(err if apart else out):
                self.status = main(shlex.split(program["arguments"]))
        finally:
            sys.stdin = kept
        errors = "" if program["errors"] else _text(err)
        return errors + (self._in_a_shell(after, _text(out)) if after else _text(out))

    def _in_a_shell(self, line: str, given: str = "") -> str:
        """By bash, for which `vrs` is this very package."""
        python = shlex.quote(sys.executable)
        function = f'vrs() {{ {python} -P -m vrs_cli "$@"; }}\npython3() {{ {python} "$@"; }}\n'
        done = subprocess.run(
            ["bash", "-c", function + line],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            input=given,
            env=os.environ | {"PYTHONPATH": str(ROOT), "PYTHONIOENCODING": "utf-8"},
            text=True,
            encoding="utf-8",
            check=False,
        )
        self.status = done.returncode
        return done.stdout

    # --- the shell ---

    def session(self, block: Block) -> Iterator[str]:
        if block.argument in PEOPLE:
            yield from self._person(block)
            return
        if block.argument not in ("", "new", "realtime"):
            raise PageFault(f"{block.where}: a session is `vrs`, `vrs new` or `vrs realtime`, not `{block.argument}`")
        if block.argument:
            self.front_end = self._new_session(self.wall.clock() if block.argument == "realtime" else None)
        for exchange in exchanges(block, _PROMPT, _STEP):
            yield from self._prompts(block, exchange, self.front_end)
            later = _LATER.match(exchange.typed)
            self.wall.seconds += float(later["seconds"]) if later else 0.0
            self.front_end.take(exchange.typed)
            yield from _difference(block, exchange, taken(self.printed))

    def _person(self, block: Block) -> Iterator[str]:
        """Somebody at a robot that others hold too: what stands before the first line has been seen since the last."""
        person = self._people.person(block.argument)
        person.look_up()
        typed = next((number for number, line in enumerate(block.lines) if _PROMPT.match(line)), len(block.lines))
        waiting = Exchange("", f"what {block.argument} sees", block.lines[:typed])
        yield from _difference(block, waiting, taken(person.seen))
        rest = replace(block, lines=block.lines[typed:])
        for exchange in exchanges(rest, _PROMPT, _STEP) if rest.lines else ():
            yield from self._prompts(block, exchange, person.front_end)
            person.front_end.take(exchange.typed)
            person.look_up()
            yield from _difference(block, exchange, taken(person.seen))

    def _new_session(self, clock: RobotClock | None = None) -> FrontEnd:
        return self._seated(PlainTerminal(self.printed, iter(())), clock=clock)

    def _prompts(self, block: Block, exchange: Exchange, front_end: FrontEnd) -> Iterator[str]:
        """The page must show the prompt that a terminal shows, and the blanks that it puts before a step."""
        status, shown = front_end.status(), exchange.prompt + exchange.typed
        before = status.prompt + status.indent
        if not shown.startswith(before):
            yield f"{block.where}: {shown!r}: the shell begins this line with {before!r}\n"

    # --- files ---

    def program_file(self, block: Block) -> Iterator[str]:
        """A file; without a name a piece of a program, which must be without errors."""
        if block.argument:
            _write(block)
            return
        text = block.text if block.text.lstrip().startswith(".PROGRAM") else f".PROGRAM piece\n{block.text}.END\n"
        for found in Session(PlainTerminal(self.printed, iter(()))).load_text(text):
            if found.severity is Severity.ERROR:
                yield f"{block.where}: {found.message}\n"

    def robot_file(self, block: Block) -> Iterator[str]:
        if block.argument:
            _write(block)
        try:
            tomllib.loads(block.text)
        except tomllib.TOMLDecodeError as error:
            yield f"{block.where}: {error}\n"

    def text_file(self, block: Block) -> Iterator[str]:
        _write(block)
        return iter(())

    def python_file(self, block: Block) -> Iterator[str]:
        if not block.argument:
            raise PageFault(f"{block.where}: Python without a name, which nothing runs")
        _write(block)
        yield from ()

    # --- Python ---

    def python_session(self, block: Block) -> Iterator[str]:
        """As at Python's own prompt; of an error the last line is compared, after `Traceback` and `  ...`."""
        lines = list(block.lines)
        while lines:
            if not lines[0].startswith(">>> "):
                raise PageFault(f"{block.where}: {lines[0]!r} comes before anything is typed")
            typed = [lines.pop(0)[4:]]
            while lines and lines[0].startswith("...") and compile_command("\n".join(typed)) is None:
                typed.append(lines.pop(0)[4:])
            shown = next((number for number, line in enumerate(lines) if line.startswith(">>>")), len(lines))
            exchange = Exchange(">>> ", "\n".join(typed), tuple(lines[:shown]))
            lines = lines[shown:]
            yield from _difference(block, exchange, self._evaluated(exchange.typed).splitlines())

    def _evaluated(self, typed: str) -> str:
        printed = io.StringIO()
        with redirect_stdout(printed):
            try:
                exec(compile(f"{typed}\n", "<page>", "single"), self.names)
            except Exception as error:
                print(
                    "Traceback (most recent call last):",
                    "  ...",
                    *map(str.rstrip, format_exception_only(error)),
                    sep="\n",
                )
        return printed.getvalue()

    def nothing_to_run(self, _block: Block) -> Iterator[str]:
        return iter(())


LANGUAGES: Mapping[str, Callable[[Reader, Block], Iterator[str]]] = {
    "console": Reader.console,
    "vrs": Reader.session,
    "val2": Reader.program_file,
    "toml": Reader.robot_file,
    "xml": Reader.text_file,
    "markdown": Reader.text_file,
    "python": Reader.python_file,
    "pycon": Reader.python_session,
    "sh": Reader.nothing_to_run,
    "text": Reader.nothing_to_run,
}


def _write(block: Block) -> None:
    """Write the file that a block is, and the folders that its name has."""
    path = Path(block.argument)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(block.text, encoding="utf-8")


def _file(text: str = "") -> io.TextIOWrapper:
    """As a process has its own."""
    return io.TextIOWrapper(io.BytesIO(text.encode()), encoding="utf-8", write_through=True)


def _text(file: io.TextIOWrapper) -> str:
    file.seek(0)
    return file.read()


def taken(stream: io.StringIO) -> list[str]:
    """What was printed since it was taken last."""
    text = stream.getvalue()
    stream.seek(0)
    stream.truncate()
    return text.splitlines()


def _difference(block: Block, exchange: Exchange, actual: list[str]) -> Iterator[str]:
    if not matches(exchange.expected, actual):
        lines = "\n".join(line.rstrip("\n") for line in ndiff(exchange.expected, actual) if not line.startswith("?"))
        yield f"{block.where}: {exchange.typed}   (- as the page has it, + as it is)\n{lines}\n"
