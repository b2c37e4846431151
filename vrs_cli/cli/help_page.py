"""Format the help of a subcommand by its row of the table, with argparse. The completion script of shells is made from
the same parser."""

from __future__ import annotations

import argparse
from typing import Any

from vrs_cli.cli import commands
from vrs_cli.cli.examples import EXAMPLES


class SubcommandHelp(argparse.ArgumentParser):
    """The help of a subcommand. `prog`: the name of the subcommand in the help."""

    def __init__(self, name: str, prog: str) -> None:
        row = commands.SUBCOMMANDS[name]
        super().__init__(prog=prog, description=row.description, add_help=False, allow_abbrev=False)
        self._name = name
        self._positionals.title = "arguments"
        self._optionals.add_argument("-h", "--help", action="help", help=argparse.SUPPRESS)
        self._optionals.add_argument("--help-all", action="store_true", help="rare options too")
        for one in row.options:
            _add(self, one)

    def format_help(self, *, rare: bool = False) -> str:
        """Return the help, as wide as the terminal. `rare`: include rare options and all examples."""
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
        usual, _, more = EXAMPLES.get(self._name, "").partition("\f")
        formatter.add_text(usual.rstrip() + "\n" + more if rare else usual)
        return formatter.format_help()


def _add(container: argparse._ActionsContainer, row: commands.OptionRow | commands.OneOf | commands.Group) -> None:
    """Add an option or several options to a parser, or to a group of its help."""
    if isinstance(row, commands.OptionRow):
        form = commands.form_of(row)
        described: dict[str, Any] = {"help": row.help, "action": "store_true"}
        if form.takes_value:
            count = {(False, False): None, (True, False): "?", (False, True): "+", (True, True): "*"}
            action = ("extend" if form.several else "append") if row.repeats else "store"  # as a shell completes it
            described |= {"action": action, "metavar": form.value or None, "choices": row.choices or None}
            described |= {"default": row.default, "nargs": count[form.optional, form.several]}
        if row.required:
            described["required"] = True
        if isinstance(container, SubcommandHelp):  # a parser, unlike a group, formats each option as a test
            container = container._optionals if form.is_option else container._positionals
        container.add_argument(*form.names, **described).rare = row.rare  # type: ignore[attr-defined]
        return
    titles = (row.title, row.about) if isinstance(row, commands.Group) else ()
    inside = container.add_argument_group(*titles) if titles else container.add_mutually_exclusive_group()
    for one in row.options:
        _add(inside, one)
