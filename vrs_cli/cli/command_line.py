"""Read the arguments of subcommands: shared options, checked values, errors of one line."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from itertools import takewhile
from math import inf, isfinite, isnan, nan
from operator import methodcaller
from typing import TYPE_CHECKING, Any, NoReturn

from vrs_cli.errors import UsageError, nearest
from vrs_cli.kinematics.model import ArmTask

if TYPE_CHECKING:
    from vrs_cli.devices.device import Outside
    from vrs_cli.engine.clock import WallClock
    from vrs_cli.kinematics.model import RobotModel
    from vrs_cli.values.diagnostics import Dialect


STANDARD_STREAM = "-"
DEFAULT_RATE = 100.0  # [Hz]
USUAL_ROBOT = "puma560"
FASTEST = 100_000.0  # [Hz]
TASKS = tuple(task.value for task in ArmTask)
MORE = "\f"  # in an epilog: what follows is in `--help-all` alone
WIDTH = 80  # for which argparse tries each option when it is added

AddOption = Callable[[argparse._ActionsContainer], object]  # adds an option, or several, to a parser or a group


class CommandLineError(UsageError):
    """The command line itself is wrong; the message has no VAL-II text, for no VAL-II was spoken."""

    def __str__(self) -> str:
        return f"{self.detail} ({self.hint})" if self.hint else self.detail


# --- options are rows of a table: a subcommand lists them, and several share some -------------------------


def option(*names: str, rare: bool = False, **described: Any) -> AddOption:
    """An option, described as for `ArgumentParser.add_argument`; only `--help-all` shows a `rare` one."""

    def add(container: argparse._ActionsContainer) -> None:
        container.add_argument(*names, **described).rare = rare  # type: ignore[attr-defined]

    return add


def group(title: str, *options: AddOption, about: str | None = None) -> AddOption:
    """Options that stand together in the help, under a title and a sentence `about` them."""
    return partial(_add_to_group, methodcaller("add_argument_group", title, about), options)


def one_of(*options: AddOption) -> AddOption:
    """Options of which a command line has at most one."""
    return partial(_add_to_group, methodcaller("add_mutually_exclusive_group"), options)


def _add_to_group(
    begin: Callable[[argparse._ActionsContainer], argparse._ActionsContainer],
    options: Iterable[AddOption],
    parser: argparse._ActionsContainer,
) -> None:
    inside = begin(parser)
    for add in options:
        add(inside)


class HelpAll(argparse.Action):
    """`--help-all`: print the help with all options, and end."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object, **__: object) -> NoReturn:
        assert isinstance(parser, Parser)
        parser._print_message(parser.format_help(rare=True), sys.stdout)
        parser.exit()


HELP_OPTIONS = (
    option("-h", "--help", action="help", help=argparse.SUPPRESS),
    option("--help-all", action=HelpAll, nargs=0, help="rare options too"),
)


_WRITING = {  # by the ending of a file
    ".csv": "--csv",
    ".vrst": "--save",
    ".html": "--report",
    **dict.fromkeys((".svg", ".png", ".pdf"), "--plot"),
}


class Parser(argparse.ArgumentParser):
    """An argument parser with `options`. It raises CommandLineError, and suggests the option that was perhaps meant."""

    def __init__(self, prog: str, description: str, epilog: str, *options: AddOption) -> None:
        super().__init__(
            prog=prog,
            description=description,
            epilog=epilog,
            add_help=False,
            allow_abbrev=False,
            formatter_class=partial(argparse.RawDescriptionHelpFormatter, width=WIDTH),
        )
        self.set_defaults(prog=prog)
        self._positionals.title = "arguments"
        for add in (*HELP_OPTIONS, *options):
            add(self)

    def format_help(self, *, rare: bool = False) -> str:
        """Return the help, as wide as the terminal; `rare`: with rare options, and what follows MORE in the epilog."""
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
        usual, _, more = (self.epilog or "").partition(MORE)
        formatter.add_text(usual.rstrip() + "\n" + more if rare else usual)
        return formatter.format_help()

    def parse(self, arguments: Sequence[str]) -> argparse.Namespace:
        """The values of all arguments. Raises CommandLineError; `--help` raises SystemExit."""
        # `--realtime FILE` means `--realtime=1 FILE`: what follows the option is a rate only if it is a number
        pairs = zip(arguments, [*arguments[1:], ""], strict=False)
        bare = ("--realtime=1" if one == "--realtime" and isnan(float_of(next_)) else one for one, next_ in pairs)
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
        """Return all options, `--like` and `-l`."""
        return tuple(self._option_string_actions)

    def error(self, message: str) -> NoReturn:
        raise CommandLineError(message.removeprefix("argument "), f"see {self.prog} --help")

    def _unknown(self, word: str, arguments: Sequence[str]) -> CommandLineError:
        beside = dict(zip(arguments, [*arguments[1:], ""], strict=False)).get(word, "")
        meant = _WRITING.get(os.path.splitext(beside)[1].lower(), "") if word in ("-o", "--output", "--out") else ""
        if meant in self.options():
            return CommandLineError(f"unknown option {word}", f"did you mean {meant} {beside}?")
        if not word.startswith("-"):
            return CommandLineError(f"one argument too many: {word}", f"see {self.prog} --help")
        return CommandLineError(f"unknown option {word}", did_you_mean(word, self.options(), self.prog))


def did_you_mean(word: str, known: Iterable[str], prog: str) -> str:
    """A hint: the known word or option that is near, or where all are listed."""
    names = {one.lstrip("-"): one for one in known}  # their dashes make no two options alike
    near = nearest(word.lstrip("-"), names)
    return f"did you mean {names[near]}?" if near else f"see {prog} --help"


def command(description: str, epilog: str, *options: AddOption) -> Callable[[str], Parser]:
    """Return a function that makes the parser of a subcommand, given the name of the program."""
    return lambda prog: Parser(prog, description, epilog, *options)


CHOICES = (  # which arm of a URDF file, and what counts of its locations: described by `vrs robots --help`
    option("--base", metavar="LINK", rare=True, help="see vrs robots --help"),
    option("--tip", metavar="LINK", rare=True, help="see vrs robots --help"),
    option("--task", metavar="TASK", choices=TASKS, rare=True, help="see vrs robots --help"),
)
ROBOT = (  # for `chosen_robot`
    option("--robot", metavar="NAME|FILE", help="name or file: see vrs robots"),
    *CHOICES,
)
DIALECT = option(  # for `chosen_dialect`
    "--dialect",
    choices=("val", "val2", "vplus"),
    default="vplus",
    rare=True,
    help="where a file does not say it (default: vplus)",
)
CELL = option(
    "--cell",
    metavar="CELL.toml",
    help="what is around it (see docs/cell.md)",
)


def chosen_dialect(options: argparse.Namespace) -> Dialect:
    """The dialect of the option DIALECT."""
    from vrs_cli.values.diagnostics import Dialect

    return Dialect[options.dialect.upper()]


def chosen_robot(options: argparse.Namespace, named: str | None = None) -> RobotModel:
    """The robot of the options ROBOT, else the one `named` by a program file, else the usual one; what was
    decided though its file does not say it is told on standard error. Raises VrsError."""
    from vrs_cli.kinematics.robot_file import Ends, load_robot

    model = load_robot(options.robot or named or USUAL_ROBOT, Ends(options.base, options.tip), options.task)
    tell_notes(teller(options.prog), model, fitted=options.task is None)
    return model


def tell_notes(tell: Callable[[str], None], model: RobotModel, *, fitted: bool = True) -> None:
    """Say what was decided of a robot though its file does not say it; `fitted`: its task, too."""
    from vrs_cli.kinematics.model_data import said

    notes = () if model.origin is None else model.origin.notes
    for note in (*notes, *(said(model) if fitted and not model.names_task else ())):
        tell(f"note: {note}")


# --- kinds of values: a wrong one becomes one line that names its option ---------------------------------


def float_of(text: str) -> float:
    """The number that a text is; no number (nan) where it is none."""
    try:
        return float(text)
    except ValueError:
        return nan


def number(text: str) -> float:
    """Any finite number."""
    value = float_of(text)
    if not isfinite(value):
        raise argparse.ArgumentTypeError(f"{text!r} is not a number")
    return value


def positive(text: str) -> float:
    """A number above zero."""
    value = number(text)
    if not value > 0.0:
        raise argparse.ArgumentTypeError(f"{text} is not above 0")
    return value


FACTORS = {"": 1, "K": 1_000, "M": 1_000_000, "G": 1_000_000_000}


def size(text: str) -> int:
    """A number of things or of bytes, above zero: 500, 64K, 1.5M, 2G."""
    digits, factor = (text[:-1], text[-1].upper()) if text[-1:].upper() in "KMG" else (text, "")
    value = positive(digits) * FACTORS[factor]
    if value != int(value) or value > 2**62:
        raise argparse.ArgumentTypeError(f"{text} is no whole number, as 500, 64K, 1.5M and 2G are")
    return int(value)


def sampling_rate(text: str) -> float:
    """Samples per second [Hz]."""
    value = positive(text)
    if value > FASTEST:
        raise argparse.ArgumentTypeError(f"{text} Hz is more than {FASTEST:g} Hz")
    return value


def whole(text: str) -> int:
    """A whole number."""
    try:
        return int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number") from None


def teller(prog: str) -> Callable[[str], None]:
    """Says on standard error, at once, what whoever runs a program has to know while it goes on."""

    def tell(text: str) -> None:
        print(f"{prog}: {text}", file=sys.stderr, flush=True)

    return tell


# --- the option `--realtime [RATE]`, and the clock that it asks for ---------------------------------------


def clock_rate(text: str) -> float:
    """Seconds of the robot in one second."""
    from vrs_cli.engine.clock import FASTEST_RATE, SLOWEST_RATE

    rate = positive(text)
    if not SLOWEST_RATE <= rate <= FASTEST_RATE:
        raise argparse.ArgumentTypeError(f"a rate of {text} (it is from {SLOWEST_RATE:g} to {FASTEST_RATE:g})")
    return rate


REALTIME = option(
    "--realtime",
    metavar="RATE",
    nargs="?",
    type=clock_rate,
    const=1.0,
    help="in real time, or RATE times as fast",
)


def clock_of(rate: float | None) -> WallClock | None:
    """A clock that keeps real time; None where time is the robot's own."""
    if rate is None:
        return None
    import time

    from vrs_cli.engine.clock import WallClock

    return WallClock(time.monotonic, time.sleep, rate)


PATIENCE = 60.0  # [s] that a unit waits for a peer that is written down


def _address(text: str) -> str:
    """A numeric address."""
    import ipaddress

    try:
        return str(ipaddress.ip_address(text))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text} (an address as 192.168.0.7, or 0.0.0.0 for all)") from None


def _serial(text: str) -> tuple[str, str]:
    number, equals, device = text.partition("=")
    if not (number.isdigit() and equals and device):
        raise argparse.ArgumentTypeError(f"{text} (as 1=pty or 1=/dev/ttyUSB0,9600)")
    return str(int(number)), device


OUTSIDE = group(  # for `chosen_outside`
    "units",
    option("--allow-net", rare=True, action="store_true", help="TCP ports and connections on this machine"),
    option(
        "--net-host",
        rare=True,
        metavar="ADDRESS",
        type=_address,
        help="and from other machines: the address to open ports at, 0.0.0.0 for all",
    ),
    option(
        "--serial",
        rare=True,
        metavar="N=DEVICE",
        action="append",
        default=[],
        type=_serial,
        help="what SERIAL:N is: a path, as /dev/ttyUSB0,9600, or pty for a pseudo-terminal",
    ),
    option(
        "--patience",
        rare=True,
        metavar="S",
        type=positive,
        help=f"how long a unit waits (with --replay-units {PATIENCE:g} s)",
    ),
    option("--record-units", rare=True, metavar="FILE", help="write down all that comes from there, and when"),
    option("--replay-units", rare=True, metavar="FILE", help="give the same again, or what a script says"),
    about="What programs may talk to by ATTACH. With --allow-net and --serial time passes as with --realtime.",
)


def chosen_outside(options: argparse.Namespace) -> Outside:
    """Return the devices that programs may attach, by the options OUTSIDE. Real devices set `options.realtime`.

    Raises CommandLineError, FileError.
    """
    live = options.allow_net or options.serial
    if live and getattr(options, "sandbox", None) is not None:
        raise CommandLineError("--sandbox has no connections", "leave out --allow-net and --serial")
    if live and options.replay_units is not None:
        raise CommandLineError("--replay-units stands for others", "leave out --allow-net and --serial")
    if options.net_host is not None and not options.allow_net:
        raise CommandLineError("--net-host says where ports are opened", "give --allow-net too")
    if options.record_units is not None and not live and options.replay_units is None:
        raise CommandLineError("--record-units has nothing to record", "give --allow-net or --serial too")
    patience = options.patience or (inf if live else PATIENCE)
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
        from vrs_cli.devices.device import Outside

        outside = Outside("--allow-net and --serial let programs have TCP and serial lines")
    if options.record_units is None:
        return outside
    from vrs_cli.devices.script import DeviceRecording

    return DeviceRecording(outside, options.record_units)
