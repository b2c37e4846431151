"""The options of `vrs run` and the shell that let programs talk to others: TCP, serial lines, recordings of both."""

from __future__ import annotations

import argparse
from math import inf
from typing import TYPE_CHECKING

from vrs_cli.cli.command_line import CommandLineError, group, option, positive

if TYPE_CHECKING:
    from vrs_cli.devices.outside import Outside

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
        from vrs_cli.devices.outside import Outside

        outside = Outside("--allow-net and --serial let programs have TCP and serial lines")
    if options.record_units is None:
        return outside
    from vrs_cli.devices.script import DeviceRecording

    return DeviceRecording(outside, options.record_units)
