"""HELP: show the tables of the language as pages. The explanations of all words come from these tables."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial
from itertools import islice

from vrs_cli.engine.settings import PARAMETERS, SWITCHES, ParameterRow, Switch
from vrs_cli.errors import UsageError, did_you_mean
from vrs_cli.interfaces.editor.editors import LEAVING, SUBCOMMANDS
from vrs_cli.language.words import foreign, values
from vrs_cli.language.words.functions import FUNCTIONS, LINKS, OPERATORS, Operator
from vrs_cli.language.words.instructions import CONTROL, INSTRUCTIONS
from vrs_cli.language.words.monitor import COMMANDS
from vrs_cli.language.words.word import Route, State, Word, WordRow, rows_for
from vrs_cli.values.replies import HelpEntry, HelpGroup, HelpOverview, HelpPage, HelpTopic, Reply

ROUTES: Mapping[Route, str] = {
    Route.MOTION: "Motion",
    Route.POSITION: "Locations",
    Route.PARAMETER: "Settings",
    Route.PROGRAM: "Input, output and program flow",
}
RESULTS: Mapping[str, tuple[values.Kind, ...]] = {
    "Functions with a real value": (values.Kind.REAL,),
    "Functions with a location": (values.Kind.LOCATION, values.Kind.PRECISION),
    "Functions with a string": (values.Kind.STRING,),
}


KEYS: tuple[tuple[str, str], ...] = (
    ("Tab", "show what can follow: words, names, files"),
    ("Right, End", "accept the line that is suggested from the history"),
    ("Up, Down", "earlier lines that begin like this one"),
    ("Ctrl-R", "search the earlier lines"),
    ("F1", "help on the word at the cursor, like word? and Enter; ? and Enter lists all words"),
    ("Ctrl-X", "ABORT at once, even while you type, answer a question, edit, or wait for a command"),
    ("Ctrl-C", "discard the line; if it is empty, stop the running program"),
    ("Ctrl-D", "leave"),
    ("Ctrl-Z", "suspend vrs; type fg in your system's shell to continue"),
    ("Ctrl-L", "clear the screen"),
    ("Ctrl-A, Ctrl-E", "go to the beginning, to the end of the line"),
    ("Ctrl-W, Ctrl-K, Ctrl-U", "cut the word before the cursor, all after it, the whole line; Ctrl-Y inserts it again"),
    ("Ctrl-_", "undo what was typed"),
    ("vi keys", 'set keys = "vi" in the file that vrs tools config names'),
)

SEEING = (
    ("SHOW", "a picture of the arm on this terminal"),
    ("vrs view", "the arm in a browser; type commands that begin with vrs outside this prompt"),
    ("vrs view hello.v2", "the same, with a program"),
    ("vrs demo", "a sample program moves the arm"),
)
TUTORIAL = (
    ("SHOW", "see the arm"),
    ("DRIVE 1, 30, 50", "turn joint 1 by 30 degrees, at half speed"),
    ("WHERE", "where the tool is: X Y Z in mm, and the joints in degrees"),
    ("MOVE #PPOINT(30, -60, 120, 0, 0, 0)", "move to joint angles"),
    ("UNDO", "take that back"),
    ("LOAD hello", "load a sample program"),
    ("EXECUTE hello", "execute it"),
    ("vrs learn", "thirteen lessons that check what you do; type it outside this prompt"),
)

# name of the topic about the line editor EDIT
EDITING = "EDITING"


def _topics() -> Mapping[str, HelpTopic]:
    """Return all help topics, by name."""
    letters = tuple((row.form, row.summary) for row in SUBCOMMANDS.values())
    empty = (("an empty line", "go to the next step; end inserting"), ("an instruction", "takes the place of the step"))
    groups = {
        title: tuple((row.form if isinstance(row, WordRow) else row.name, row.summary) for row in rows)
        for title, rows in _groups().items()
    }
    return {
        **{_SHORT.get(title.upper(), title.upper()): HelpTopic(title, rows) for title, rows in groups.items()},
        "TUTORIAL": HelpTopic("First lines to type", TUTORIAL),
        **dict.fromkeys(("PICTURE", "VIEW"), HelpTopic("See the arm", SEEING)),
        "KEYS": HelpTopic("Keys at the prompt", KEYS),
        EDITING: HelpTopic("Lines of EDIT", (*letters, *LEAVING.items(), *empty)),
    }


_SHORT = {  # short names of groups, to be typed after HELP
    "MONITOR COMMANDS": "COMMANDS",
    "INPUT, OUTPUT AND PROGRAM FLOW": "FLOW",
    "CONTROL STRUCTURES": "BLOCKS",
    "FUNCTIONS WITH A REAL VALUE": "FUNCTIONS",
    "FUNCTIONS WITH A LOCATION": "LOCATION.FUNCTIONS",
    "FUNCTIONS WITH A STRING": "STRING.FUNCTIONS",
    "WORDS THAT LINK": "LINKS",
}


def help_on(word: str) -> Iterator[Reply]:
    """Yield the help on a word or topic; the overview for "". Raises UsageError for an unknown word."""
    name = _full_name(word.upper()) if word else ""
    topic = _topics().get(name)
    if topic is not None:
        yield topic
    if topic is None or name in ALL_NAMES:
        yield page(name) if name else overview()


def overview() -> HelpOverview:
    """Return the names of all available words in groups, and of all topics."""
    groups = {title: tuple(row.name for row in rows) for title, rows in _groups().items()}
    groups["Topics"] = tuple(_topics())
    return HelpOverview(tuple(HelpGroup(title, words) for title, words in groups.items() if words))


def _groups() -> Mapping[str, tuple[WordRow | Switch | ParameterRow, ...]]:
    """Return the table rows of all available words, by the title of their group."""
    of_route = {title: [row for row in INSTRUCTIONS.values() if row.route is route] for route, title in ROUTES.items()}
    of_kind = {title: [row for row in FUNCTIONS.values() if row.result in kinds] for title, kinds in RESULTS.items()}
    rows: dict[str, Iterable[WordRow]] = {
        "Monitor commands": COMMANDS.values(),
        **of_route,
        "Control structures": CONTROL.values(),
        **of_kind,
    }
    return {
        **{title: tuple(row for row in of if row.state is State.SUPPORTED) for title, of in rows.items()},
        "Operators": tuple(OPERATORS.values()),
        "Words that link": tuple(LINKS.values()),
        "Switches": tuple(SWITCHES.values()),
        "Parameters": tuple(PARAMETERS.values()),
    }


# --- one word ------------------------------------------------------------------------------------------------------


def page(typed: str) -> HelpPage:
    """Return all meanings of a word, which may be abbreviated. Raises UsageError for an unknown word; its hint names
    similar words."""
    name = _full_name(typed.upper())
    entries = tuple(entry for source in _SOURCES for entry in source(name))
    if not entries or name in LINKS:
        entries += tuple(_users(name))
    if not entries:
        raise UsageError(
            f"there is no help on {name}", did_you_mean(name, (*ALL_NAMES, *_topics()), "HELP alone lists all words")
        )
    return HelpPage(name, entries)


ALL_NAMES = [*COMMANDS, *INSTRUCTIONS, *CONTROL, *FUNCTIONS, *OPERATORS, *LINKS, *SWITCHES, *PARAMETERS]


def _full_name(name: str) -> str:
    """Return the name of a topic, or the name under which a word is listed in the tables. The word may be the singular
    of a topic (KEY), an abbreviation, another spelling, or the name in another robot language. Raises UsageError for
    an ambiguous abbreviation."""
    name = next((row.name for row in OPERATORS.values() if row.also == name), name)
    if name in ALL_NAMES or name in _topics() or any(_users(name)):
        return name
    if ours := foreign.own_word(name) or next((topic for topic in _topics() if topic == f"{name}S"), ""):
        return ours
    found = rows_for(name, COMMANDS, INSTRUCTIONS, CONTROL)
    if len(found) == 1:
        return found[0].name
    starting = sorted({known for known in (*ALL_NAMES, *_topics()) if known.startswith(name)})
    if len(starting) > 1:
        raise UsageError(f"{name} can be {', '.join(starting)}", "write more of the word")
    return starting[0] if starting else name


MAX_USERS = 3


def _users(name: str) -> Iterator[HelpEntry]:
    """Yield help entries of at most MAX_USERS words whose syntax contains a keyword (STEP, AT, THEN)."""
    tables: Mapping[str, Mapping[str, Word]] = {
        "control structure": CONTROL,
        "monitor command": COMMANDS,
        "instruction": INSTRUCTIONS,
    }
    users = (
        (sort, row)
        for sort, table in tables.items()
        for row in table.values()
        if name in re.findall(r"[A-Z]+", row.form) and row.state is State.SUPPORTED
    )
    return (_entry(sort, row, "") for sort, row in islice(users, MAX_USERS))


def _entry(sort: str, row: WordRow, note: str) -> HelpEntry:
    """Return the help entry of a table row. `sort`: the kind of word shown to the user. The entry of an unavailable
    word has no example, but says what to write instead."""
    if row.state is State.SUPPORTED:
        return HelpEntry(sort, row.form, row.summary, row.example, row.where, note)
    return HelpEntry(sort, row.form, row.summary, "", row.where, "; ".join(filter(None, (row.state.value, note))))


def _row(sort: str, table: Mapping[str, WordRow], name: str) -> Iterator[HelpEntry]:
    if (row := table.get(name)) is not None:
        also = row.also if isinstance(row, Operator) else ""
        yield _entry(sort, row, f"also written {also}" if also else row.note)


def _function(name: str) -> Iterator[HelpEntry]:
    for row in filter(None, map(FUNCTIONS.get, (name, f"${name}", f"#{name}"))):
        yield _entry("constant" if row.constant else f"function, {row.result.value}", row, "")


def _setting(name: str) -> Iterator[HelpEntry]:
    """Yield the help entries of the switch and of the parameter with a name, if they exist."""
    if (switch := SWITCHES.get(name)) is not None:
        default = "ON" if switch.default else "OFF"
        yield HelpEntry("switch", name, f"{switch.summary}; {default} at the start", f"ENABLE {name}")
    if (row := PARAMETERS.get(name)) is not None:
        default = row.default if isinstance(row.default, str) else values.plain(row.default)
        said = f"{row.summary}; {f'{default} {row.unit}'.rstrip()} at the start"
        yield HelpEntry("parameter", name, said, f"PARAMETER {name} = {default}")


_SOURCES: tuple[Callable[[str], Iterator[HelpEntry]], ...] = (
    partial(_row, "monitor command", COMMANDS),
    partial(_row, "instruction", INSTRUCTIONS),
    partial(_row, "control structure", CONTROL),
    _function,
    partial(_row, "operator", OPERATORS),
    partial(_row, "word that links", LINKS),
    _setting,
)
