"""HELP says what the tables say, of every word."""

import pytest

from vrs_cli.engine.settings import PARAMETERS, SWITCHES
from vrs_cli.errors import UsageError
from vrs_cli.interfaces.monitor.help import help_on, overview, page
from vrs_cli.language.words.functions import FUNCTIONS, LINKS, OPERATORS
from vrs_cli.language.words.instructions import CONTROL, INSTRUCTIONS
from vrs_cli.language.words.monitor import COMMANDS
from vrs_cli.language.words.word import State
from vrs_cli.values.replies import HelpPage, HelpTopic

ROWS = {**FUNCTIONS, **CONTROL, **INSTRUCTIONS, **COMMANDS}
EVERY_WORD = sorted({*ROWS, *SWITCHES, *PARAMETERS})


def test_every_word_has_a_page() -> None:
    pages = [page(name.lower()) for name in EVERY_WORD]
    assert [found.word for found in pages] == EVERY_WORD
    assert all(entry.form and entry.summary for found in pages for entry in found.entries)


def test_the_overview_lists_what_can_be_used_and_nothing_else() -> None:
    *groups, _topics = overview().groups
    listed = {word for group in groups for word in group.words}
    usable = {name for table in (FUNCTIONS, CONTROL, INSTRUCTIONS, COMMANDS) for name, row in table.items()
              if row.state is State.SUPPORTED}  # fmt: skip
    assert listed == usable | set(OPERATORS) | set(LINKS) | set(SWITCHES) | set(PARAMETERS)


@pytest.mark.parametrize("topic", overview().groups[-1].words)
def test_each_topic_says_what_its_words_do(topic: str) -> None:
    found = next(iter(help_on(topic.lower())))
    assert isinstance(found, HelpTopic)
    assert all(form and summary for form, summary in found.rows)


def test_a_word_that_is_a_topic_too_is_explained_as_well() -> None:
    assert [type(reply) for reply in help_on("COMMANDS")] == [HelpTopic, HelpPage]
    assert [type(reply) for reply in help_on("KEYS")] == [HelpTopic]


def test_all_meanings_of_a_word_are_shown() -> None:
    assert [entry.sort for entry in page("SPEED").entries] == ["monitor command", "instruction", "function, real"]


@pytest.mark.parametrize(
    ("typed", "word"), [("exec", "EXECUTE"), ("DIR", "DIRECTORY"), ("ATAN", "ATAN2"), ("STEP", "STEP"), ("at", "AT")]
)
def test_words_may_be_cut_short(typed: str, word: str) -> None:
    assert page(typed).word == word


@pytest.mark.parametrize(
    ("typed", "topic"), [("TUTO", "First lines to type"), ("pict", "See the arm"), ("key", "Keys at the prompt")]
)
def test_topics_may_be_cut_short(typed: str, topic: str) -> None:
    assert [reply.title for reply in help_on(typed) if isinstance(reply, HelpTopic)] == [topic]


@pytest.mark.parametrize(
    ("typed", "meant"), [("TUTORAIL", "TUTORIAL"), ("veiw", "VIEW"), ("EDITNIG", "EDITING"), ("MOVEX", "MOVE")]
)
def test_a_hint_names_the_most_similar_word_or_topic(typed: str, meant: str) -> None:
    with pytest.raises(UsageError) as refused:
        list(help_on(typed))
    assert refused.value.hint == f"did you mean {meant}?"


def test_words_that_are_not_there_say_so() -> None:
    missing = [row for row in ROWS.values() if row.state is not State.SUPPORTED]
    assert len(missing) > 50
    assert all(any(row.state.value in entry.note for entry in page(row.name).entries) for row in missing)


@pytest.mark.parametrize(("typed", "hint"), [("MOVEX", "did you mean MOVE?"), ("ST", "STATUS"), ("Q@", "HELP alone")])
def test_unknown_words(typed: str, hint: str) -> None:
    with pytest.raises(UsageError, match=hint.replace("?", r"\?")):
        page(typed)
