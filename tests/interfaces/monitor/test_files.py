"""Files loaded and stored."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.interfaces.monitor.people import at, last, loaded
from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.errors import FileError, FileOutside
from vrs_cli.files.opening import Folder
from vrs_cli.interfaces.dialogue import Reading, Running
from vrs_cli.interfaces.session.session import Session
from vrs_cli.language.words.values import Kind
from vrs_cli.values import replies, results


def test_store_and_load_bring_everything_back(folder: Path) -> None:
    session = loaded(RecordingTerminal())
    session.perform('$name = "A-17"')
    session.perform("STORE cell")
    again = at(RecordingTerminal(), "LOAD cell")
    assert list(again.environment.programs) == list(session.environment.programs)
    assert again.environment.kinds == session.environment.kinds
    assert (folder / "cell.v2").exists()


@pytest.mark.parametrize(
    ("line", "file", "sections"),
    [
        ("STOREP f", "f.pg", [".PROGRAM"] * 4),
        ("STOREL f", "f.lc", [".LOCATIONS"]),
        ("STORER f", "f.rv", [".REALS"]),
        ("STORES f", "f.st", [".STRINGS"]),
        ("STORE f.txt = shared", "f.txt", [".PROGRAM", ".REALS"]),
    ],
)
def test_parts_have_their_extension(folder: Path, line: str, file: str, sections: list[str]) -> None:
    session = loaded(RecordingTerminal())
    session.perform('$name = "A-17"')
    session.perform(line)
    words = [text.split()[0] for text in (folder / file).read_text().splitlines() if text.startswith(".")]
    assert [word for word in words if word != ".END"] == sections


def test_load_keeps_programs_and_overwrites_variables(folder: Path) -> None:
    (folder / "new.v2").write_text(".PROGRAM main\nTYPE 1\n.END\n.PROGRAM fresh\n.END\n.REALS\nx 77\n.END\n")
    session = loaded(RecordingTerminal(sure=False))
    kept = session.environment.programs["main"]
    session.perform("LOAD new.v2")
    assert session.environment.programs["main"] is kept
    assert "fresh" in session.environment.programs
    assert dict(session.environment.variables(Kind.REAL))["x"] == 77.0
    texts = [reply.text for reply in session.terminal.replies]  # type: ignore[attr-defined]
    assert texts[0].startswith("*Program already exists* main")
    assert texts[1] == "new.v2 loaded: fresh; main stays as before"


def test_load_says_where_it_has_loaded_nothing(folder: Path) -> None:
    (folder / "now.lc").write_text(".LOCATIONS\nnow 1 0 0 0 1 0\n0 0 -1 430.16 49.70 710.00\n.END\n")
    session = at(RecordingTerminal(), "LOAD now.lc")
    assert last(session, results.Message) == results.Message("nothing of now.lc is loaded", results.Tone.ERROR)
    assert not session.environment.kinds


def test_a_trajectory_is_loaded_as_a_branch() -> None:
    session = at(RecordingTerminal(), "READY", "SAVE 2-demo", "DRIVE 1, 60", "LOAD 2-demo.vrst")
    assert session.branches.present == "t2.demo"
    assert [record.text for record in session.engine.book.records()] == ["READY"]
    assert session.prompt == "(t2.demo)."


def test_a_file_that_is_read_long_is_seen_to_be() -> None:
    class Watcher(RecordingTerminal):
        def progress(self, doing: Running | Reading) -> None:
            if isinstance(doing, Reading):
                self.asked.append(f"{doing.path} {doing.share > 0.0}")

    watcher = Watcher()
    session = at(watcher, "READY", "SAVE demo", "REPLAY demo")
    assert watcher.asked == ["demo.vrst True"]
    session.perform("LOAD demo.vrst")
    assert watcher.asked == ["demo.vrst True"] * 2


def test_save_and_replay() -> None:
    session = at(
        RecordingTerminal(),
        "DO SPEED 50, 30 ALWAYS",
        "DRIVE 1, 60",
        "DRIVE 2, 10 AT 0.5",
        "UNDO",
        "SAVE demo",
        "REPLAY demo",
    )
    replayed = last(session, replies.ReplayTable)
    assert [row.end for row in replayed.rows] == [0.0, session.engine.end]
    assert replayed.rows[-1].T_world_tool == session.engine.position(session.engine.end).T_world_tool
    assert session.terminal.replies[-2].text.startswith("demo.vrst: Unimation PUMA 560, 3 changes, ")  # type: ignore[attr-defined]


def test_all_of_a_file_is_there_at_once_and_others_have_their_turn_before(tmp_path: Path) -> None:
    places = "".join(f"p{k} {k} 150 -100 90 90 0\n" for k in range(1000))
    programs = "".join(f".PROGRAM a{k}\nMOVE p{k}\n.END\n" for k in range(20))
    (tmp_path / "many.v2").write_text(f"{programs}.LOCATIONS\n{places}.END\n")
    session = Session(RecordingTerminal())
    ticket = session.actor.submit(session.answers(f"LOAD {tmp_path / 'many.v2'}"))
    seen = []
    while not ticket.done():
        session.actor.step()
        stop = session.actor.submit(session.answers("ABORT"), urgent=True)
        while not stop.done():
            session.actor.step()
        seen.append((session.environment.count(), len(session.programs)))
    assert ticket.error() is None
    assert sorted(set(seen)) == [(0, 0), (1000, 20)]


# --- folders -------------------------------------------------------------------------------------------------------


def said(session: Session, line: str) -> str:
    session.perform(line)
    return last(session, results.Message).text


def test_another_folder(folder: Path) -> None:
    (folder / "cells").mkdir()
    session = at(RecordingTerminal(), "a = 5")
    assert said(session, "CD cells") == said(session, "PWD") == str(folder / "cells")
    session.perform("STORE all")
    assert (folder / "cells" / "all.v2").is_file()
    session.load_text('.PROGRAM p\nATTACH (5)\nFOPENW (5) "log.txt"\nWRITE (5) "x"\nFCLOSE (5)\n.END\n')
    session.perform("EXECUTE p")
    assert (folder / "cells" / "log.txt").is_file()  # programs have their files there too
    assert said(session, "CD ..") == str(folder)
    with pytest.raises(FileError, match="none is no folder"):
        session.perform("CD none")


def test_no_way_leads_out_of_a_closed_folder(folder: Path) -> None:
    (folder / "box" / "cells" / "deep").mkdir(parents=True)
    session = Session(RecordingTerminal(), folder=Folder(folder / "box", closed=True))
    assert said(session, "PWD") == "/"
    assert said(session, "CD cells/deep") == "/cells/deep"
    assert said(session, "CD ..") == "/cells"
    assert [said(session, "CD ..") for _ in range(2)] == ["/", "/"]
    assert said(session, "CD cells") == "/cells"
    assert said(session, "CD") == "/"
    for out in ("CD ../..", f"CD {folder}", "CD cells/../.."):
        with pytest.raises(FileOutside):
            session.perform(out)


def test_load_brings_the_files_that_a_file_names(folder: Path) -> None:
    (folder / "lib.v2").write_text("; with: main.v2\n.PROGRAM grip(n)\n.END\n")
    (folder / "main.v2").write_text("; with: lib.v2\n.PROGRAM all()\nCALL grip(1)\n.END\n")
    session = at(RecordingTerminal(), "LOAD main")
    assert list(session.environment.programs) == ["grip", "all"]
    assert session.last_program == "all", "EXECUTE alone runs a program of the file that was named"
    texts = [reply.text for reply in session.terminal.replies]  # type: ignore[attr-defined]
    assert texts == ["lib.v2 loaded: grip", "main.v2 loaded: all"]
