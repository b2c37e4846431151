"""Nobody hears where files lie on the server."""

from __future__ import annotations

from pathlib import Path

from tests.net.serving import serving
from vrs_cli.net.messages import Done, Get, Names, Put, Refused, Told
from vrs_cli.net.places import may_hold, prefixes_of, without
from vrs_cli.values.replies import Message


def test_the_names_of_files_are_those_that_were_given(tmp_path: Path) -> None:
    prefixes = prefixes_of((tmp_path, tmp_path / "in", None))
    told = Told(Message(f"{tmp_path}/in/a.v2 and {tmp_path}/b.v2"), 3)
    assert without(prefixes, told) == Told(Message("a.v2 and b.v2"), 3)
    same = Told(Message("nothing"))
    assert without(prefixes, same) is same


def test_what_a_server_answers_of_files(tmp_path: Path) -> None:
    with serving(tmp_path) as server, server.call() as ada:
        for line in ("LOAD none", "STORE all", "LOAD all", "FDIRECTORY", "COMMANDS none", "STATUS", "LOAD ../x"):
            ada.line(line)
        ada.ask(lambda id: Get(id, "none.txt"))
        ada.ask(lambda id: Put(id, "a/b", b""))
        ada.ask(Names)
        for message in ada.heard:
            assert str(tmp_path) not in str(message), message
        assert any(isinstance(one, Refused) for one in ada.heard)
        assert any(isinstance(one, Done) and not one.ok for one in ada.heard)


def test_a_value_without_a_prefix_is_told_from_one_with_it() -> None:
    prefixes = prefixes_of((Path("/srv/röbot"),))
    assert may_hold(prefixes, Message("/srv/röbot/a.v2 is there"))
    assert not may_hold(prefixes, Message("a.v2 is there"))
    assert may_hold(prefixes, Message("no text: \udcff")), "what cannot be encoded is looked at in full"
