"""The comments and blank lines of the files that were loaded, so that STORE writes them back where they stood.

What stands inside a program is part of it. Here is the rest: lines before a program or a section, lines before a
variable of a section and comments beside it, and what follows the last part of a file.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from typing import Self

from msgspec import Struct, field
from msgspec.structs import replace

from vrs_cli.language.text.ast import BadLine, Comment, Entry, File, Number, Program, Section
from vrs_cli.language.words.values import key_of

Loose = Comment | BadLine  # a line of a file that is in no program or section
EntryKey = tuple[str, tuple[float, ...]]  # a variable by its key, and its indexes


class EntryComments(Struct, frozen=True):
    """What belongs to a variable of a section: the lines before it (None: blank), and the comment on its line."""

    before: tuple[str | None, ...] = ()
    comment: str | None = None


NOTHING = EntryComments()


class Layout(Struct, frozen=True):
    """`parts`: lines before a program (by key) or a section (by name); `ends`: lines before the `.END` of a section."""

    parts: Mapping[str, tuple[Loose, ...]] = field(default_factory=dict)
    entries: Mapping[EntryKey, EntryComments] = field(default_factory=dict)
    ends: Mapping[str, tuple[str | None, ...]] = field(default_factory=dict)
    tail: tuple[Loose, ...] = ()

    @classmethod
    def of(cls, file: File) -> Self:
        """The layout of one file."""
        parts, entries, ends = (
            dict[str, tuple[Loose, ...]](),
            dict[EntryKey, EntryComments](),
            dict[str, tuple[str | None, ...]](),
        )
        loose: list[Loose] = []
        for part in file.parts:
            if isinstance(part, Comment | BadLine):
                loose.append(part)
                continue
            parts[_part_key(part)] = tuple(loose)
            loose.clear()
            if isinstance(part, Section):
                before = defaultdict[int, list[str | None]](list)
                for at, text in part.remarks:
                    before[at].append(text)
                for number, entry in enumerate(part.entries):
                    entries[_entry_key(entry)] = EntryComments(tuple(before[number]), entry.comment)
                ends[part.name] = tuple(text for at, text in part.remarks if at >= len(part.entries))
        return cls(parts, entries, ends, tuple(loose))

    def with_file(self, other: Layout) -> Layout:
        """After a file of that layout has been loaded."""
        entries, ends = {**self.entries, **other.entries}, {**self.ends, **other.ends}
        return Layout({**self.parts, **other.parts}, entries, ends, other.tail or self.tail)

    def renamed(self, old: str, new: str) -> Layout:
        """After a program has got another name."""
        parts = dict(self.parts)
        parts[key_of(new)] = parts.pop(key_of(old), ())
        return replace(self, parts=parts)

    def with_part(self, key: str, before: Iterable[Loose]) -> Layout:
        """The layout with these lines before a program; none for one that is deleted."""
        return replace(self, parts={**self.parts, key: tuple(before)})

    def laid_out(self, parts: Iterable[Program | Section]) -> Iterator[Program | Section | Loose]:
        """Programs and sections, with the lines that belong to them; the first line is not blank."""
        begun = False
        for part in parts:
            for line in self.parts.get(_part_key(part), ()):
                begun = begun or not isinstance(line, Comment) or line.text is not None
                if begun:
                    yield line
            begun = True
            yield self._section(part) if isinstance(part, Section) else part

    def _section(self, section: Section) -> Section:
        beside = [self.entries.get(_entry_key(entry), NOTHING) for entry in section.entries]
        remarks = [(at, text) for at, one in enumerate(beside) for text in one.before]
        remarks += [(len(beside), text) for text in self.ends.get(section.name, ())]
        entries = (replace(entry, comment=one.comment) for entry, one in zip(section.entries, beside, strict=True))
        return replace(section, entries=tuple(entries), remarks=tuple(remarks))


def _part_key(part: Program | Section) -> str:
    return part.key if isinstance(part, Program) else part.name


def _entry_key(entry: Entry) -> EntryKey:
    indexes = (index.value for index in entry.variable.indexes or () if isinstance(index, Number))
    return entry.variable.key, tuple(indexes)
