"""Find and run a subcommand. An error becomes one message on standard error and an exit status."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import partial
from importlib import import_module
from io import TextIOWrapper, UnsupportedOperation
from keyword import iskeyword

from vrs_cli.cli.command_line import CommandLineError, Parser
from vrs_cli.cli.commands import GROUPS, SUBCOMMANDS
from vrs_cli.errors import FileDamaged, FileError, UsageError, VrsError, did_you_mean
from vrs_cli.repl.interrupt import Ended, ending

OK, FAILED, USAGE = 0, 1, 2
INTERNAL_ERROR = 70  # EX_SOFTWARE of sysexits.h
INTERRUPTED = 130  # 128 + SIGINT, as shells report it
BROKEN_PIPE = 141  # 128 + SIGPIPE, as shells report it


FAMILIES = ("class", "lab", "tools")  # first words of the subcommands with names of two words
MOVED: Mapping[str, str] = {  # by the old name of a subcommand: its current form
    **{name.split()[1]: f"vrs {name}" for name in SUBCOMMANDS if " " in name},
    "put": "vrs connect URL --put FILE",
    "get": "vrs connect URL --get NAME",
}

MEANT: Mapping[str, str] = {  # by a word that other tools or the prompt use: the subcommand that was probably meant
    **dict.fromkeys(("execute", "exec", "start", "simulate", "play", "go"), "run"),
    **dict.fromkeys(("lint", "test", "validate", "compile"), "check"),
    **dict.fromkeys(("load", "open", "edit"), "shell"),
    **dict.fromkeys(("format", "prettify"), "fmt"),
    **dict.fromkeys(("show", "browser", "gui"), "view"),
}

FILE_COMMANDS: Mapping[str, str] = {
    ".v2": "shell",
    ".pg": "shell",
    ".vrst": "replay",
}  # suffix of a file that is given without a subcommand: the subcommand to run

HELP = """\
usage: vrs [SUBCOMMAND] [ARGUMENTS]

A VAL-II shell and batch runner for a virtual PUMA 560 and other robots.

{rows}

  vrs FILE.v2              the shell, with that file loaded
  vrs T.vrst               play a saved trajectory
  vrs SUBCOMMAND --help    all about one of them
  vrs --version            the version

Exit status: 1 a program stopped with an error, or a file has mistakes; 2 the command line is wrong.
"""


def run(arguments: Sequence[str]) -> int:
    """Run a command line; return the exit status. Raises no exception."""
    _prepare_streams()
    if arguments and arguments[0] in PAGES:
        return _run_guarded("vrs", PAGES[arguments[0]])
    try:
        name, prog, rest = _choose(arguments)
    except UsageError as error:
        return _tell_error("vrs", str(error), USAGE)
    return _run_guarded(prog, partial(_subcommand, name, prog, rest))


def _prepare_streams() -> None:
    """Set the standard streams to UTF-8, with a line feed at the end of output lines. Replace a closed stream by an
    empty one."""
    for name, errors, newline in (  # `errors`: the treatment of bytes that are not UTF-8
        ("stdin", "replace", None),
        ("stdout", "backslashreplace", "\n"),
        ("stderr", "backslashreplace", "\n"),
    ):
        stream = getattr(sys, name)
        if stream is None:
            setattr(sys, name, open(os.devnull, "r+", encoding="utf-8"))  # noqa: SIM115 (for the whole process)
        elif isinstance(stream, TextIOWrapper):
            with suppress(UnsupportedOperation):  # raised if the stream was already read
                stream.reconfigure(encoding="utf-8", errors=errors, newline=newline)


def _choose(arguments: Sequence[str]) -> tuple[str, str, Sequence[str]]:
    """Return the subcommand, its name in messages, and its arguments. If there is no subcommand, all options are
    options of the shell."""
    if not arguments or arguments[0].startswith("-"):
        return "shell", "vrs", arguments
    name = arguments[0]
    for words in (2, 1):
        if (full := " ".join(arguments[:words])) in SUBCOMMANDS:
            return full, f"vrs {full}", arguments[words:]
    suited = FILE_COMMANDS.get(os.path.splitext(name)[1].lower())
    if suited is not None:
        return suited, f"vrs {suited}", arguments
    if name in FAMILIES:
        family = [full.split()[1] for full in SUBCOMMANDS if full.startswith(f"{name} ")]
        what = (
            f"vrs {name} what?"
            if arguments[1:] in ([], ["--help"], ["-h"], ["--help-all"])
            else f"unknown subcommand {name} {arguments[1]}"
        )
        raise CommandLineError(what, f"there is {', '.join(family)}")
    if name in MOVED:
        raise CommandLineError(f"vrs {name} is now {MOVED[name]}")
    if name.lower() in MEANT:
        line = " ".join(("vrs", MEANT[name.lower()], *arguments[1:2]))
        raise CommandLineError(f"unknown subcommand {name}", f"did you mean {line}?")
    raise CommandLineError(f"unknown subcommand {name}", did_you_mean(name, SUBCOMMANDS, "see vrs --help"))


def _subcommand(name: str, prog: str, arguments: Sequence[str]) -> int:
    options = Parser(name, prog).parse(arguments)
    module, word = import_module(f"vrs_cli.cli.{SUBCOMMANDS[name].module}"), name.split()[-1]
    status: int | None = getattr(module, f"{word}_" if iskeyword(word) else word)(options)
    return status or OK


def _version() -> int:
    from vrs_cli.version import __version__

    print(f"vrs {__version__}")
    return OK


def _help() -> int:
    names = {name: f"vrs {name} {row.arguments}" for name, row in SUBCOMMANDS.items()}
    width = max(map(len, names.values()))
    groups = (
        "\n".join((f"{title}:", *(f"  {names[name]:{width}}  {row.summary}" for name, row in rows.items())))
        for title, rows in GROUPS.items()
    )
    print(HELP.format(rows="\n\n".join(groups)), end="")
    return OK


PAGES: Mapping[str, Callable[[], int]] = {
    "--help": _help,
    "-h": _help,
    "help": _help,
    "--version": _version,
    "-V": _version,
}


# --- errors --------------------------------------------------------------------------------------------------


def _run_guarded(prog: str, subcommand: Callable[[], int]) -> int:
    """Run a subcommand; return an exit status even if it raises an exception."""
    try:
        with ending():
            status = subcommand()
            sys.stdout.flush()
    except SystemExit as exit_:  # raised after --help
        return exit_.code if isinstance(exit_.code, int) else OK
    except VrsError as error:
        return _tell_error(prog, str(error), status_of(error))
    except Ended as end:
        return _tell_error(prog, str(end), end.status)
    except KeyboardInterrupt:
        return _tell_error(prog, "interrupted", INTERRUPTED)
    except BrokenPipeError:
        _abandon_output()
        return BROKEN_PIPE
    except Exception as error:
        # an error of an output stream: errors of files name their file
        if isinstance(error, OSError) and error.filename is None:
            _abandon_output()
            return _tell_error(prog, f"standard output cannot be written: {error.strerror}", FAILED)
        from vrs_cli.interfaces.dialogue import internal_error

        return _tell_error(prog, internal_error(error).text, INTERNAL_ERROR)
    return status


def status_of(error: VrsError) -> int:
    """Return 1 for mistakes in files and requests that a robot cannot execute, 2 for mistakes in the command line."""
    if isinstance(error, FileDamaged):
        return FAILED
    return USAGE if isinstance(error, UsageError | FileError) else FAILED


def _tell_error(prog: str, message: str, status: int) -> int:
    try:
        sys.stdout.flush()
    except OSError:
        _abandon_output()
    with suppress(OSError):  # the terminal may be closed
        print(f"{prog}: {message}", file=sys.stderr)
    return status


def _abandon_output() -> None:
    """Redirect standard output to the null device. Nobody reads it, so the rest of the buffer must not be written at
    exit."""
    with suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
