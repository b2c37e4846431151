"""`vrs demo`: a sample program moves the arm in the browser, or on the terminal; then the prompt."""

from __future__ import annotations

import os
import webbrowser
from argparse import Namespace
from contextlib import ExitStack
from typing import TYPE_CHECKING

from vrs_cli.cli.command_line import Parser, clock_of, option
from vrs_cli.errors import NonexistentFile
from vrs_cli.extras import shipped_folder
from vrs_cli.repl.place import Local
from vrs_cli.repl.shell import at, on_terminal

if TYPE_CHECKING:
    from vrs_cli.interfaces.dialogue import Terminal
    from vrs_cli.repl.front_end import FrontEnd

SAMPLE, PROGRAM = "pick_and_place.v2", "pick.and.place"
TRY = """\
Try these lines:

  MOVE #PPOINT(30, -60, 120, 0, 0, 0)
  WHERE AT 1.5
  HELP TUTORIAL
"""


def demo(options: Namespace) -> int:
    """Show the sample, and run the shell until the user leaves; returns the exit status. Without a terminal the program
    runs as in `vrs run`. Raises VrsError.
    """
    if not on_terminal():
        from vrs_cli.cli import run

        return run.run(run.run_parser(options.prog).parse([SAMPLE]))
    if options.terminal or not (options.no_open or has_browser()):
        return _on_terminal()
    from vrs_cli.cli import view
    from vrs_cli.cli.page import host_program, page_place

    arguments = [SAMPLE, "--no-open"] if options.no_open else [SAMPLE]
    shown = view.view_parser(options.prog).parse(arguments)
    with ExitStack() as stack:
        try:
            place = page_place(shown)
        except NonexistentFile as error:  # the page is not built
            print(f"{options.prog}: {error}")
            return _on_terminal()
        local_robot = host_program(shown, stack, place, view.read_cell)
        print(TRY)
        return view.run_beside(shown, stack, local_robot)


def demo_parser(prog: str) -> Parser:
    return Parser(
        prog,
        "A sample program moves the arm, in the browser or on the terminal; then you type.",
        "",
        option("--terminal", action="store_true", help="open no browser"),
        option("--no-open", rare=True, action="store_true", help="print the address of the page alone"),
    )


def has_browser() -> bool:
    """Return whether the page would open in a window of its own: browsers that work in the terminal do not show it."""
    try:
        found = webbrowser.get()
    except webbrowser.Error:
        return False
    return "BROWSER" in os.environ or type(found) is not webbrowser.GenericBrowser


class DemoPlace(Local):
    """A robot of this process, whose first lines are typed for the user."""

    def front_end(self, terminal: Terminal) -> FrontEnd:
        front_end = super().front_end(terminal)
        load_sample = front_end.opening

        def begin() -> None:
            load_sample()
            for line in (f"EXECUTE {PROGRAM}", "SHOW"):
                print(f".{line}")
                front_end.take(line)
            print(TRY)

        front_end.opening = begin
        return front_end


def _on_terminal() -> int:
    sample = shipped_folder("programs") / SAMPLE
    return at(DemoPlace(file=str(sample), clock=clock_of(1.0), cell=str(sample.with_suffix(".toml"))))
