"""The option `--realtime [RATE]`, and the clock that it asks for."""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from math import isnan
from typing import TYPE_CHECKING

from vrs_cli.cli.command_line import float_of, positive

if TYPE_CHECKING:
    from vrs_cli.engine.clock import WallClock


def add_realtime_option(parser: argparse.ArgumentParser) -> None:
    """The option, the same in every subcommand that has it; its arguments go through `with_rate` first."""
    parser.add_argument(
        "--realtime",
        metavar="RATE",
        nargs="?",
        type=clock_rate,
        const=1.0,
        help="let time pass as on a real robot, or RATE times as fast",
    )


def clock_rate(text: str) -> float:
    """Seconds of the robot in one second."""
    from vrs_cli.engine.clock import FASTEST_RATE, SLOWEST_RATE

    rate = positive(text)
    if not SLOWEST_RATE <= rate <= FASTEST_RATE:
        raise argparse.ArgumentTypeError(f"a rate of {text} (it is from {SLOWEST_RATE:g} to {FASTEST_RATE:g})")
    return rate


def with_rate(arguments: Sequence[str]) -> Iterator[str]:
    """`--realtime FILE` means `--realtime=1 FILE`: what follows the option is a rate only if it is a number."""
    for argument, following in zip(arguments, [*arguments[1:], ""], strict=False):
        yield "--realtime=1" if argument == "--realtime" and isnan(float_of(following)) else argument


def clock_of(rate: float | None) -> WallClock | None:
    """A clock that keeps real time; None where time is the robot's own."""
    if rate is None:
        return None
    import time

    from vrs_cli.engine.clock import WallClock

    return WallClock(time.monotonic, time.sleep, rate)
