"""Programs for a session, and what they leave in its variables."""

from __future__ import annotations

from vrs_cli.interfaces.session.session import Session


def load(session: Session, *lines: str, name: str = "main", parameters: str = "") -> None:
    found = session.load_text("\n".join([f".PROGRAM {name}({parameters})", *lines, ".END", ""]))
    assert not [one for one in found if one.severity.name == "ERROR"], found


def value(session: Session, name: str) -> object:
    return session.environment.reference(name).value()
