"""Make the parsers of subcommands from their table, and read the options that several subcommands share: robot,
dialect, clock, devices.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from itertools import takewhile
from math import inf, isnan
from typing import TYPE_CHECKING, Any, NoReturn

from vrs_cli.cli import commands, kinds
from vrs_cli.errors import UsageError, VrsError, did_you_mean

if TYPE_CHECKING:
    from vrs_cli.devices.outside import Outside
    from vrs_cli.engine.clock import WallClock
    from vrs_cli.kinematics.model import RobotModel
    from vrs_cli.values.diagnostics import Dialect


DEFAULT_RATE = 100.0  # [Hz] samples per second if --rate is not given
USUAL_ROBOT = "puma560"


class CommandLineError(UsageError):
    """A mistake in the command line. Its message omits the title of a VAL-II error, because no VAL-II was typed."""

    def __str__(self) -> str:
        return f"{self.detail} ({self.hint})" if self.hint else self.detail


def refuse(*mistakes: tuple[object, str, str]) -> None:
    """Raise CommandLineError for the first mistake in a command line. Each item of `mistakes`: whether the mistake was
    made, its description, and a hint."""
    for is_made, what, hint in mistakes:
        if is_made:
            raise CommandLineError(what, hint)


@contextmanager
def errors_of_options(*kinds: type[VrsError]) -> Iterator[None]:
    """If the block raises an error of one of these kinds, raise a CommandLineError with the same text instead."""
    try:
        yield
    except kinds as error:
        raise CommandLineError(error.detail, error.hint) from None


class HelpAll(argparse.Action):
    """The action of `--help-all`: prints the help with all options, and ends the process."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object, **__: object) -> NoReturn:
        assert isinstance(parser, Parser)
        parser._print_message(parser.format_help(rare=True), sys.stdout)
        parser.exit()


_WRITING = {  # the option that writes a file, by the file's suffix
    ".csv": "--csv",
    ".vrst": "--save",
    ".html": "--report",
    **dict.fromkeys((".svg", ".png", ".pdf"), "--plot"),
}


class Parser(argparse.ArgumentParser):
    """The parser for a subcommand's arguments, made from the subcommand's row in `commands.SUBCOMMANDS`. It raises
    CommandLineError, which suggests the option that was probably meant. `prog`: the name of the subcommand in messages.
    """

    def __init__(self, name: str, prog: str) -> None:
        row = commands.SUBCOMMANDS[name]
        super().__init__(prog=prog, description=row.description, add_help=False, allow_abbrev=False)
        self._name = name
        self.set_defaults(prog=prog)
        self._positionals.title = "arguments"
        self._optionals.add_argument("-h", "--help", action="help", help=argparse.SUPPRESS)
        self._optionals.add_argument("--help-all", action=HelpAll, nargs=0, help="rare options too")
        for one in row.options:
            _add(self, one)

    def format_help(self, *, rare: bool = False) -> str:
        """Return the help, as wide as the terminal. `rare`: with rare options, and with all examples."""
        formatter = argparse.RawDescriptionHelpFormatter(self.prog)
        needed = [action for action in self._actions if action.required or not action.option_strings]
        formatter.add_usage(None, needed, ())
        formatter.add_text(self.description)
        for section in self._action_groups:
            shown = [action for action in section._group_actions if rare or not getattr(action, "rare", False)]
            if shown:
                formatter.start_section(section.title)
                formatter.add_text(section.description)
                formatter.add_arguments(shown)
                formatter.end_section()
        from vrs_cli.cli.examples import EXAMPLES

        usual, _, more = EXAMPLES.get(self._name, "").partition("\f")
        formatter.add_text(usual.rstrip() + "\n" + more if rare else usual)
        return formatter.format_help()

    def parse(self, arguments: Sequence[str]) -> argparse.Namespace:
        """Return the values of all arguments. Raises CommandLineError; `--help` raises SystemExit."""
        # `--realtime FILE` means `--realtime=1 FILE`: what follows the option is a rate only if it is a number
        pairs = zip(arguments, [*arguments[1:], ""], strict=False)
        bare = ("--realtime=1" if one == "--realtime" and isnan(kinds.float_of(next_)) else one for one, next_ in pairs)
        arguments = list(bare)
        words = (word.partition("=")[0] for word in takewhile(lambda word: word != "--", arguments))
        unknown = [word for word in words if word.startswith("--") and word not in self.options()]
        if unknown:
            raise self._unknown(unknown[0], arguments)
        values, extra = self.parse_known_args(arguments)
        if extra:
            raise self._unknown(extra[0], arguments)
        return values

    def arguments(self) -> tuple[argparse.Action, ...]:
        """Return all arguments and options."""
        return tuple(self._actions)

    def options(self) -> tuple[str, ...]:
        """Return the names of all options: `--output`, `-o`."""
        return tuple(self._option_string_actions)

    def error(self, message: str) -> NoReturn:
        raise CommandLineError(message.removeprefix("argument "), f"see {self.prog} --help")

    def _unknown(self, word: str, arguments: Sequence[str]) -> CommandLineError:
        beside = dict(zip(arguments, [*arguments[1:], ""], strict=False)).get(word, "")
        meant = _WRITING.get(os.path.splitext(beside)[1].lower(), "") if word in ("-o", "--output", "--out") else ""
        if meant in self.options():
            return CommandLineError(f"unknown option {word}", f"did you mean {meant} {beside}?")
        if word == "--speed" and "--realtime" in self.options():
            hint = "SPEED 50 in the program sets the speed of the arm, --realtime 0.5 that of the clock"
            return CommandLineError(f"unknown option {word}", hint)
        if not word.startswith("-"):
            return CommandLineError(f"one argument too many: {word}", f"see {self.prog} --help")
        return CommandLineError(f"unknown option {word}", did_you_mean(word, self.options(), f"see {self.prog} --help"))


def _add(container: argparse._ActionsContainer, row: commands.OptionRow | commands.OneOf | commands.Group) -> None:
    """Add an option, or several, to a parser or to a group of its help."""
    if isinstance(row, commands.OptionRow):
        names, described = _argparse_form(row)
        if isinstance(container, Parser):  # faster: for a parser, argparse checks each option by formatting its help
            container = container._optionals if names[0].startswith("-") else container._positionals
        container.add_argument(*names, **described).rare = row.rare  # type: ignore[attr-defined]
        return
    titles = (row.title, row.about) if isinstance(row, commands.Group) else ()
    inside = container.add_argument_group(*titles) if titles else container.add_mutually_exclusive_group()
    for one in row.options:
        _add(inside, one)


def _argparse_form(row: commands.OptionRow) -> tuple[Sequence[str], dict[str, Any]]:
    """Return the names of an option, and the keyword arguments for `add_argument`."""
    words = row.form.split()
    names = [word for word in words if word.startswith("-")] or words[:1]
    value = " ".join(words[len(names) :])
    described: dict[str, Any] = {"help": row.help} | ({"dest": row.dest} if row.dest else {})
    if not value and not row.choices:
        return names, described | {"action": "store_true"}
    may_be_left_out = value.startswith("[") and value.endswith("]")
    value = value[1:-1] if may_be_left_out else value
    several = value.endswith("...")
    if row.repeats:
        described["action"] = "extend" if several else "append"
    if row.required:
        described["required"] = True
    return names, described | {
        "metavar": value.removesuffix("...").strip() or None,
        "nargs": {(False, False): None, (True, False): "?", (False, True): "+", (True, True): "*"}[
            may_be_left_out, several
        ],
        "type": row.kind,
        "default": row.default,
        "choices": row.choices or None,
        "const": row.const,
    }


def chosen_dialect(options: argparse.Namespace) -> Dialect:
    """Return the dialect of VAL that `--dialect` names."""
    from vrs_cli.values.diagnostics import Dialect

    return Dialect[options.dialect.upper()]


def chosen_robot(options: argparse.Namespace, named: str | None = None) -> RobotModel:
    """Return the robot that `--robot` names, else the robot that a program file names (`named`), else the default
    robot. Print on standard error what vrs has chosen because the robot's file does not say it. Raises VrsError.
    """
    from vrs_cli.kinematics.robot_file import Ends, load_robot

    model = load_robot(options.robot or named or USUAL_ROBOT, Ends(options.base, options.tip), options.task)
    tell_notes(teller(options.prog), model, fitted=options.task is None)
    return model


def tell_notes(tell: Callable[[str], None], model: RobotModel, *, fitted: bool = True) -> None:
    """Report the properties of a robot that vrs has chosen because the robot's file does not give them. `fitted`: also
    report the chosen task (which parts of a pose the arm can reach)."""
    from vrs_cli.kinematics.model_data import task_notes

    notes = () if model.origin is None else model.origin.notes
    for note in (*notes, *(task_notes(model) if fitted and not model.names_task else ())):
        tell(f"note: {note}")


def teller(prog: str) -> Callable[[str], None]:
    """Return a function that prints a message on standard error at once."""

    def tell(text: str) -> None:
        print(f"{prog}: {text}", file=sys.stderr, flush=True)

    return tell


def clock_of(rate: float | None) -> WallClock | None:
    """Return a clock that runs `rate` times as fast as real time; None (virtual time) if `rate` is None."""
    if rate is None:
        return None
    import time

    from vrs_cli.engine.clock import WallClock

    return WallClock(time.monotonic, time.sleep, rate)


SCRIPT_WAIT_S = 60.0  # [s] maximum time that a program waits for input from a recorded or scripted device


def chosen_outside(options: argparse.Namespace) -> Outside:
    """Return the devices that programs may attach, as specified by the options in `commands.UNITS`. If real devices are
    allowed, run in real time: set `options.realtime` unless it is given. Raises CommandLineError, FileError.
    """
    live = options.allow_net or options.serial
    sandbox, repeats = getattr(options, "sandbox", None) is not None, options.replay_units is not None
    without_host = options.net_host is not None and not options.allow_net
    without_source = options.record_units is not None and not live and not repeats
    refuse(
        (live and sandbox, "--sandbox has no connections", "leave out --allow-net and --serial"),
        (live and repeats, "--replay-units stands for others", "leave out --allow-net and --serial"),
        (without_host, "--net-host says where ports are opened", "give --allow-net too"),
        (without_source, "--record-units has nothing to record", "give --allow-net or --serial too"),
    )
    patience = options.patience or (inf if live else SCRIPT_WAIT_S)
    outside: Outside
    if live:
        from vrs_cli.devices.sockets import LOOPBACK, Sockets

        host = (options.net_host or LOOPBACK) if options.allow_net else None
        outside = Sockets(host, dict(options.serial), patience)
        options.realtime = 1.0 if options.realtime is None else options.realtime
    elif options.replay_units is not None:
        from vrs_cli.devices.script import read_script

        outside = read_script(options.replay_units, patience)
    else:
        from vrs_cli.devices.outside import Outside

        outside = Outside("--allow-net and --serial let programs have TCP and serial lines")
    if options.record_units is None:
        return outside
    from vrs_cli.devices.script import DeviceRecording

    return DeviceRecording(outside, options.record_units)
