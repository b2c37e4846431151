"""Read the arguments of subcommands by their table. Also read what several subcommands share: robot, dialect, clock,
devices."""

from __future__ import annotations

import os
import re
import sys
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from itertools import takewhile
from math import inf, isnan
from types import SimpleNamespace as Namespace
from typing import TYPE_CHECKING, Any

from vrs_cli.cli import commands, kinds
from vrs_cli.errors import UsageError, nearest

if TYPE_CHECKING:
    from vrs_cli.devices.device import Outside
    from vrs_cli.engine.clock import WallClock
    from vrs_cli.kinematics.model import RobotModel
    from vrs_cli.values.diagnostics import Dialect


DEFAULT_RATE = 100.0  # [Hz] samples per second if --rate is not given
USUAL_ROBOT = "puma560"


class CommandLineError(UsageError):
    """A mistake in the command line. Its message has no VAL-II text, because no VAL-II was typed."""

    def __str__(self) -> str:
        return f"{self.detail} ({self.hint})" if self.hint else self.detail


_WRITING = {  # suffix of a file: the option that writes such a file
    ".csv": "--csv",
    ".vrst": "--save",
    ".html": "--report",
    **dict.fromkeys((".svg", ".png", ".pdf"), "--plot"),
}


HELPS = ("-h", "--help", "--help-all")
_NEGATIVE = re.compile(r"-\d+|-\d*\.\d+")


class OptionReader:
    """Reads the arguments of a subcommand as its row of the table describes them. For an unknown option it suggests the
    option that was probably meant. `prog`: the name of the subcommand in messages."""

    def __init__(self, name: str, prog: str) -> None:
        self._name, self._prog = name, prog
        self._forms = tuple(commands.forms_of(commands.SUBCOMMANDS[name].options))
        self._options = {name: form for form in self._forms if form.is_option for name in form.names}
        self._given: list[commands.OptionForm] = []
        self._values: dict[str, Any] = {"prog": prog}
        for form in self._forms:
            default = form.row.default if form.takes_value else False
            self._values[form.dest] = [*default] if isinstance(default, list) else default

    def read(self, arguments: Sequence[str]) -> Namespace:
        """Return the values of all arguments. Raises CommandLineError; `--help` raises SystemExit."""
        known = (*self._options, *HELPS)
        names = (word.partition("=")[0] for word in takewhile(lambda word: word != "--", arguments))
        if unknown := next((word for word in names if word.startswith("--") and word not in known), None):
            raise self._unknown(unknown, arguments)
        words, found = deque(arguments), list[str]()
        while words:
            word = words.popleft()
            if word == "--":
                found += words
                break
            if self._is_value(word):
                found.append(word)
            else:
                self._read_option(word, words, arguments)
        extra = self._read_arguments(found)
        if missing := [one.shown for one in self._forms if one.required and one not in self._given]:
            raise self._error(f"the following arguments are required: {', '.join(missing)}")
        if extra:
            raise self._unknown(extra[0], arguments)
        return Namespace(**self._values)

    def _read_option(self, word: str, words: deque[str], arguments: Sequence[str]) -> None:
        """Read an option, and its values from the words that follow it."""
        name, equals, text = word.partition("=")
        if name not in self._options and not name.startswith("--") and word[:2] in self._options:
            name, equals, text = word[:2], "=", word[2:]  # the form -oOUT
        if name in HELPS:
            from vrs_cli.cli.help_page import SubcommandHelp

            print(SubcommandHelp(self._name, self._prog).format_help(rare=name == "--help-all"), end="")
            raise SystemExit(0)
        form = self._options.get(name)
        if form is None:
            raise self._unknown(word, arguments)
        other = next((one for one in self._given if one.group and one.group is form.group and one is not form), None)
        if other is not None:
            raise self._error(f"{form.shown}: not allowed with argument {other.shown}")
        if equals and not form.takes_value:
            raise self._error(f"{form.shown}: ignored explicit argument {text!r}")
        texts = [text] if equals else []
        while form.takes_value and words and self._is_value(words[0]) and (form.several or not texts):
            if name == "--realtime" and isnan(kinds.float_of(words[0])):
                break  # `--realtime FILE` means `--realtime=1 FILE`
            texts.append(words.popleft())
        if form.takes_value and not (texts or form.optional):
            raise self._error(f"{form.shown}: expected {'at least one' if form.several else 'one'} argument")
        self._take(form, texts)

    def _read_arguments(self, found: list[str]) -> list[str]:
        """Assign the words that belong to no option to the arguments, in order. Return the words that remain."""
        forms = [form for form in self._forms if not form.is_option]
        for place, form in enumerate(forms):
            later = sum(not one.optional for one in forms[place + 1 :])
            most = len(found) - later if form.several else min(1, len(found) - later * form.optional)
            count = max(most, 0 if form.optional else min(1, len(found)))
            if count:
                self._take(form, found[:count])
                found = found[count:]
            elif form.optional and form.several:
                self._values[form.dest] = []
        return found

    def _is_value(self, word: str) -> bool:
        """Return whether a word is a value and not an option: it has no leading dash, is `-` alone, is a negative
        number, or contains a blank."""
        if not word.startswith("-") or word == "-" or _NEGATIVE.fullmatch(word):
            return True
        return " " in word and word.partition("=")[0] not in self._options

    def _take(self, form: commands.OptionForm, texts: Sequence[str]) -> None:
        """Set the value of an option or an argument from the texts given for it."""
        row, values = form.row, [self._value(form, text) for text in texts]
        value: Any = True if not form.takes_value else values if form.several else values[0] if values else row.const
        if row.repeats:
            before = self._values[form.dest] or []
            value = [*before, *value] if form.several else [*before, value]
        self._values[form.dest] = value
        self._given.append(form)

    def _value(self, form: commands.OptionForm, text: str) -> object:
        try:
            value = form.row.kind(text)
        except kinds.WrongValue as error:
            raise self._error(f"{form.shown}: {error}") from None
        if form.row.choices and value not in form.row.choices:
            known = ", ".join(map(repr, form.row.choices))
            raise self._error(f"{form.shown}: invalid choice: {value!r} (choose from {known})")
        return value

    def _error(self, message: str) -> CommandLineError:
        return CommandLineError(message, f"see {self._prog} --help")

    def _unknown(self, word: str, arguments: Sequence[str]) -> CommandLineError:
        beside = dict(zip(arguments, [*arguments[1:], ""], strict=False)).get(word, "")
        meant = _WRITING.get(os.path.splitext(beside)[1].lower(), "") if word in ("-o", "--output", "--out") else ""
        if meant in (*self._options, *HELPS):
            return CommandLineError(f"unknown option {word}", f"did you mean {meant} {beside}?")
        if word == "--speed" and "--realtime" in (*self._options, *HELPS):
            hint = "SPEED 50 in the program sets the speed of the arm, --realtime 0.5 that of the clock"
            return CommandLineError(f"unknown option {word}", hint)
        if not word.startswith("-"):
            return CommandLineError(f"one argument too many: {word}", f"see {self._prog} --help")
        return CommandLineError(f"unknown option {word}", did_you_mean(word, (*self._options, *HELPS), self._prog))


def did_you_mean(word: str, known: Iterable[str], prog: str) -> str:
    """Return a hint: the most similar known word or option, or where all are listed."""
    names = {one.lstrip("-"): one for one in known}  # compare options without their dashes
    near = nearest(word.lstrip("-"), names)
    return f"did you mean {names[near]}?" if near else f"see {prog} --help"


def chosen_dialect(options: Namespace) -> Dialect:
    """Return the dialect of `--dialect`."""
    from vrs_cli.values.diagnostics import Dialect

    return Dialect[options.dialect.upper()]


def chosen_robot(options: Namespace, named: str | None = None) -> RobotModel:
    """Return the robot of `--robot`, else the robot that a program file names (`named`), else the usual one. Report
    decisions that the robot's file leaves open on standard error. Raises VrsError."""
    from vrs_cli.kinematics.robot_file import Ends, load_robot

    model = load_robot(options.robot or named or USUAL_ROBOT, Ends(options.base, options.tip), options.task)
    tell_notes(teller(options.prog), model, fitted=options.task is None)
    return model


def tell_notes(tell: Callable[[str], None], model: RobotModel, *, fitted: bool = True) -> None:
    """Report the decisions that the file of a robot leaves open; with `fitted` also its task."""
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
    """Return a clock that runs in real time; None for the robot's own time."""
    if rate is None:
        return None
    import time

    from vrs_cli.engine.clock import WallClock

    return WallClock(time.monotonic, time.sleep, rate)


SCRIPT_WAIT_S = 60.0  # [s] maximum time that a unit waits for a scripted peer


def chosen_outside(options: Namespace) -> Outside:
    """Return the devices that programs may attach, as the options UNITS describe them. Real devices set
    `options.realtime`. Raises CommandLineError, FileError."""
    live = options.allow_net or options.serial
    if live and getattr(options, "sandbox", None) is not None:
        raise CommandLineError("--sandbox has no connections", "leave out --allow-net and --serial")
    if live and options.replay_units is not None:
        raise CommandLineError("--replay-units stands for others", "leave out --allow-net and --serial")
    if options.net_host is not None and not options.allow_net:
        raise CommandLineError("--net-host says where ports are opened", "give --allow-net too")
    if options.record_units is not None and not live and options.replay_units is None:
        raise CommandLineError("--record-units has nothing to record", "give --allow-net or --serial too")
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
        from vrs_cli.devices.device import Outside

        outside = Outside("--allow-net and --serial let programs have TCP and serial lines")
    if options.record_units is None:
        return outside
    from vrs_cli.devices.script import DeviceRecording

    return DeviceRecording(outside, options.record_units)
