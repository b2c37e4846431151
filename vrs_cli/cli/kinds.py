"""Read the values of options: each function returns a value, or raises ArgumentTypeError (argparse then adds the name
of the option to the message).
"""

from __future__ import annotations

import os
import re
from argparse import ArgumentTypeError
from collections.abc import Callable
from functools import partial
from math import inf, isfinite, nan
from typing import TYPE_CHECKING, TypeVar

from vrs_cli.errors import VrsError

if TYPE_CHECKING:
    from datetime import date
    from pathlib import Path

    from vrs_cli.net.delay_line import Delays, Endpoint
    from vrs_cli.net.far_end import Ahead


T = TypeVar("T")

LOOPBACK = "127.0.0.1"
MAX_PORT = 65535
MAX_RATE = 100_000.0  # [Hz] maximum sampling rate


def path(text: str) -> Path:
    """Return the path of a file."""
    from pathlib import Path  # imported here because few commands have such an option

    return Path(text)


def _require(holds: object, otherwise: str) -> None:
    """Raise ArgumentTypeError with the message `otherwise` if a condition does not hold."""
    if not holds:
        raise ArgumentTypeError(otherwise)


def float_of(text: str) -> float:
    """Convert a string to a number; return nan if the string is not a number."""
    try:
        return float(text)
    except ValueError:
        return nan


def number(text: str) -> float:
    """Read a finite number."""
    value = float_of(text)
    _require(isfinite(value), f"{text!r} is not a number")
    return value


def positive(text: str) -> float:
    """Read a number above zero."""
    value = number(text)
    _require(value > 0.0, f"{text} is not above 0")
    return value


def whole(text: str) -> int:
    """Read a whole number."""
    try:
        return int(text)
    except ValueError:
        raise ArgumentTypeError(f"{text!r} is not a whole number") from None


def size(text: str) -> int:
    """Read a positive count or a number of bytes: 500, 64K, 1.5M, 2G."""
    digits, factor = (text[:-1], text[-1].upper()) if text[-1:].upper() in "KMG" else (text, "")
    value = positive(digits) * {"": 1, "K": 1_000, "M": 1_000_000, "G": 1_000_000_000}[factor]
    _require(value <= 2**62 and value == int(value), f"{text} is no whole number, as 500, 64K, 1.5M and 2G are")
    return int(value)


def percent(text: str) -> float:
    """Read a percentage of full speed [%]."""
    value = positive(text)
    _require(value <= 100.0, f"{text} % is more than full speed")
    return value


def sampling_rate(text: str) -> float:
    """Read a sampling rate, in samples per second [Hz]."""
    value = positive(text)
    _require(value <= MAX_RATE, f"{text} Hz is more than {MAX_RATE:g} Hz")
    return value


def clock_rate(text: str) -> float:
    """Read the rate of a clock: how many seconds of the robot's time pass in one second of wall time."""
    from vrs_cli.engine.clock import FASTEST_RATE, SLOWEST_RATE

    rate = positive(text)
    _require(
        SLOWEST_RATE <= rate <= FASTEST_RATE, f"a rate of {text} (it is from {SLOWEST_RATE:g} to {FASTEST_RATE:g})"
    )
    return rate


def _within(lowest: float, highest: float, unit: str, text: str) -> float:
    """Read a positive number from `lowest` to `highest`. `unit`: its unit in messages."""
    value = positive(text)
    _require(lowest <= value <= highest, f"{value:g} {unit} is not from {lowest:g} to {highest:g} {unit}")
    return value


trial_seconds = partial(_within, 5.0, 1e4, "s")  # reads the duration of a trial of an experiment
look_rate = partial(_within, 1.0, 200.0, "Hz")  # reads the rate at which an experiment samples the robot


def cycles(text: str) -> int:
    """Read the number of times that a program is executed."""
    from vrs_cli.language.run.runtime import MAX_CYCLES

    value = whole(text)
    _require(value != 0 and value <= MAX_CYCLES, f"{text} cycles (1 to {MAX_CYCLES}, or -1 for ever)")
    return value


def codes(text: str) -> tuple[str, ...]:
    """Read codes of diagnostics, or their first characters: V401,V05."""
    found = tuple(code.strip().upper() for code in text.split(","))
    wrong = next((code for code in found if not re.fullmatch("V[0-9]{0,4}", code)), None)
    _require(wrong is None, f"{wrong!r} is no code, as V401 and V05 are")
    return found


def expiry(text: str) -> date:
    """Read the day or the time at which a token expires."""
    from datetime import date, datetime

    for read in (date.fromisoformat, datetime.fromisoformat):
        try:
            return read(text)
        except ValueError:
            continue
    raise ArgumentTypeError(f"{text!r} is no day (2027-07-31, or 2027-07-31T12:00:00)")


# --- robots, cells, addresses -----------------------------------------------------------------------------------------


def named_robot(text: str) -> tuple[str, str]:
    """Read the name of a served robot and its model: `cell1=puma560`. If no name is given, the model is also the
    name."""
    from vrs_cli.net.tokens import NAME_RULE, good_name

    name, equals, robot = text.partition("=")
    if not equals:
        name, robot = os.path.splitext(os.path.basename(text))[0], text
    _require(good_name(name), f"{name!r} is no name for a robot ({NAME_RULE}): NAME=ROBOT")
    return name, robot


def named_cell(text: str) -> tuple[str, str]:
    """Read the name of a served robot and its cell file: `cell1=pick.toml`. A cell file without a name (returned as "")
    is for all robots."""
    from vrs_cli.net.tokens import good_name

    name, equals, file = text.partition("=")
    return (name, file) if equals and good_name(name) and file else ("", text)


def serial_line(text: str) -> tuple[str, str]:
    """Read the number of a serial line and its device: `1=/dev/ttyUSB0,9600`."""
    number, equals, device = text.partition("=")
    _require(number.isdigit() and equals and device, f"{text} (as 1=pty or 1=/dev/ttyUSB0,9600)")
    return str(int(number)), device


def host_address(text: str) -> str:
    """Read a numeric IP address."""
    import ipaddress

    try:
        return str(ipaddress.ip_address(text))
    except ValueError:
        raise ArgumentTypeError(f"{text} (an address as 192.168.0.7, or 0.0.0.0 for all)") from None


def port(text: str) -> int:
    """Read the number of a TCP port."""
    value = whole(text)
    _require(0 <= value <= MAX_PORT, f"{text} is no port (0 to {MAX_PORT})")
    return value


def endpoint(text: str) -> Endpoint:
    """Read an address with its port: HOST:PORT, [IPv6]:PORT, or PORT of this machine."""
    from vrs_cli.net.delay_line import Endpoint

    host, _, number = text.rpartition(":")
    is_port = number.isascii() and number.isdigit() and int(number) <= MAX_PORT
    _require(is_port and "/" not in host, f"{text!r} is no address, as {LOOPBACK}:7000 or 7000")
    return Endpoint(host.strip("[]") or LOOPBACK, int(number))


# --- times and delays -------------------------------------------------------------------------------------------------


def idle_time(text: str) -> float:
    """Read how long a robot keeps working without users [s]; 0 means forever (infinity)."""
    return positive(text) if number(text) else inf


def _read(parse: Callable[[str], T], text: str) -> T:
    """Return the value that `parse` reads from the string. If `parse` raises a VrsError, raise an ArgumentTypeError
    instead."""
    try:
        return parse(text)
    except VrsError as error:
        raise ArgumentTypeError(f"{error.detail}; {error.hint}" if error.hint else error.detail) from None


def duration(text: str) -> float:
    """Read a duration [s]: 200ms, 0.2s, 0.2."""
    from vrs_cli.net.delay_line import parse_duration

    return _read(parse_duration, text)


def ahead(text: str) -> float | Ahead:
    """Read how far ahead of now a robot is shown: a duration [s], or `auto`."""
    from vrs_cli.net.far_end import Ahead

    if text == Ahead.AUTO.value:
        return Ahead.AUTO
    try:
        return duration(text)
    except ArgumentTypeError as error:
        raise ArgumentTypeError(f"{error}, or {Ahead.AUTO.value}") from None


def delays(text: str) -> tuple[str, Delays]:
    """Read a description of delays, such as `gamma 200ms 80ms`. Return the description and the delays."""
    from vrs_cli.net.delay_line import parse_delays

    return text, _read(parse_delays, text)


def loss(text: str) -> float:
    """Read the share of lost packets: 1%, 0.01."""
    from vrs_cli.net.delay_line import parse_loss

    return _read(parse_loss, text)
