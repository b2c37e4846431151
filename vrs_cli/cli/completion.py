"""`vrs completion`: what a shell needs to complete subcommands, options, files and names of robots."""

from __future__ import annotations

from argparse import Action, ArgumentParser, Namespace
from importlib import import_module

from vrs_cli.cli.command_line import Parser, option
from vrs_cli.cli.main import OK, SUBCOMMANDS

SHELLS = ("bash", "zsh", "fish")
EPILOG = """\
  eval "$(vrs completion bash)"                                      in ~/.bashrc
  vrs completion zsh > ~/.zfunc/_vrs                                 with ~/.zfunc in fpath
  vrs completion fish > ~/.config/fish/completions/vrs.fish
"""
FILES = ("FILE", "OUT", ".v2", ".vrst", ".csv", ".html", ".svg")  # in what stands for an argument
FOLDERS = ("FOLDER", "DIR")


def main(options: Namespace) -> int:
    """Print it, of one parser of the whole command line."""
    import shtab

    whole = ArgumentParser(prog="vrs")
    whole.add_argument("--version", action="store_true", help="the version")
    subcommands = whole.add_subparsers()
    for name, row in SUBCOMMANDS.items():
        own: Parser = import_module(f"vrs_cli.cli.{row.module}").parser(f"vrs {name}")
        for action in own.arguments():
            _teach(action, shtab.FILE, shtab.DIRECTORY)
        subcommands.add_parser(name, help=row.summary, parents=[own], add_help=False)
    print(shtab.complete(whole, options.shell))
    return OK


def parser(prog: str) -> Parser:
    return Parser(
        prog,
        "Print what a shell needs to complete vrs with the Tab key.",
        EPILOG,
        option("shell", choices=SHELLS, help="of which shell"),
    )


def _teach(action: Action, file: object, folder: object) -> None:
    """Say what completes an argument."""
    from vrs_cli.kinematics.robot_file import robot_names

    stands = str(action.metavar)
    if "--robot" in action.option_strings:
        action.choices = robot_names()
    elif any(part in stands for part in (*FILES, *FOLDERS)):
        action.complete = folder if any(part in stands for part in FOLDERS) else file  # type: ignore[attr-defined]
