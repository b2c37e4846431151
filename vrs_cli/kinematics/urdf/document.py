"""The text of a URDF file as a tree of elements, read as other readers of robots do: prefixes that nobody declares are
part of the name, and the declaration may stand anywhere. Format: http://wiki.ros.org/urdf/XML.
"""

from __future__ import annotations

import re
from typing import NamedTuple
from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers.expat import ExpatError, ParserCreate

from vrs_cli.errors import FileDamaged

LARGEST = 20_000_000  # characters: no arm is described by more
HUGE = 1e6  # [m, rad] no figure of an arm; keeps infinity and NaN out as well
EXPRESSION = re.compile(r"\$[{(]")  # of xacro

_DECLARATION = re.compile(r"<\?xml\s[^>]*\?>")
_TEXT = "a robot description is an XML file"


class Document(NamedTuple):
    """A file, and its <robot> element."""

    file: str
    root: Element

    def numbers(self, element: Element, what: str, text: str, count: int) -> tuple[float, ...]:
        """So many numbers of an attribute. Raises FileDamaged, with the element's name."""
        try:
            values = tuple(map(float, text.split()))
        except ValueError:
            values = ()
        if len(values) != count or not all(abs(value) < HUGE for value in values):
            below = f"below {HUGE:g}"
            right = (
                f"give a number {below}" if count == 1 else f"give {count} numbers {below}, with blanks between them"
            )
            raise self.wrong(element, f"{what} is {text!r}", expanding(self.file) if EXPRESSION.search(text) else right)
        return values

    def wrong(self, joint: Element, what: str, right: str) -> FileDamaged:
        """What is wrong with a joint, and what would be right."""
        return FileDamaged(f"{self.file}: joint {named(joint) or '?'}: {what}", right)


def document(file: str, text: str) -> Document:
    """Raises FileDamaged."""
    root = _parsed(file, text)
    if root.tag != "robot":
        raise FileDamaged(f"{file}: its root is <{root.tag}>", "a URDF file is one <robot> element")
    return Document(file, root)


def named(element: Element, key: str = "name") -> str:
    """A name that an element gives, in one line: a reader of XML takes a line end in it for a blank."""
    return " ".join(element.get(key, "").split())


def expanding(file: str) -> str:
    """The command that expands the macros of a file."""
    return f"expand it first: xacro {file} > arm.urdf"


def _parsed(file: str, text: str) -> Element:
    if len(text) > LARGEST:
        raise FileDamaged(f"{file}: {len(text)} characters", f"at most {LARGEST} are read")
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise FileDamaged(f"{file}: it defines a document type or entities", "a URDF file needs neither: remove them")
    builder, parser = TreeBuilder(), ParserCreate()
    parser.buffer_text = True
    parser.StartElementHandler = builder.start
    parser.EndElementHandler = builder.end
    parser.CharacterDataHandler = builder.data
    try:
        parser.Parse(_DECLARATION.sub("", text.lstrip("\ufeff")), True)
    except ExpatError as error:
        raise FileDamaged(f"{file}: {error}", _TEXT) from None
    return builder.close()
