"""The options that say how a line delays, the same in every subcommand that has them."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import TYPE_CHECKING, TypeVar

from vrs_cli.cli.command_line import whole
from vrs_cli.errors import VrsError

if TYPE_CHECKING:
    from vrs_cli.net.delay_line import Delays

T = TypeVar("T")

KINDS = """\
DELAYS is one of
  200ms                        always the same
  normal 200ms 40ms            mean and standard deviation
  gamma 200ms 80ms             mean and standard deviation
  bursty 50ms 400ms 5s 500ms   the delay in calm and in a burst, and how long each lasts on average
  trace FILE                   as measured: a line is a delay, or a time [s] and a delay
A number without a unit is in seconds. Order is kept; what is lost is sent again after 0.2 s, 0.4 s, ...
"""


def add_line_options(parser: argparse.ArgumentParser) -> None:
    """Forward, backward, loss and seed."""
    parser.add_argument("--forward", metavar="DELAYS", type=delays, help="on the way to the robot")
    parser.add_argument("--backward", metavar="DELAYS", type=delays, help="on the way back")
    parser.add_argument("--loss", metavar="SHARE", type=loss, default=0.0, help="what is lost on each way, as 1%%")
    parser.add_argument("--seed", metavar="N", type=whole, default=1, help="of all that is random (default: 1)")


def _read(parse: Callable[[str], T], text: str) -> T:
    """Raises ArgumentTypeError, to which argparse adds the option."""
    try:
        return parse(text)
    except VrsError as error:
        raise argparse.ArgumentTypeError(f"{error.detail}; {error.hint}" if error.hint else error.detail) from None


def delays(text: str) -> tuple[str, Delays]:
    """Delays, with the text that says them."""
    from vrs_cli.net.delay_text import parse_delays

    return text, _read(parse_delays, text)


def duration(text: str) -> float:
    """A time [s]: 200ms, 0.2s, 0.2."""
    from vrs_cli.net.delay_text import parse_duration

    return _read(parse_duration, text)


def loss(text: str) -> float:
    """A share: 1%, 0.01."""
    from vrs_cli.net.delay_text import parse_loss

    return _read(parse_loss, text)
