"""Keep the comments and blank lines of loaded files. Comments inside a program are stored with the program. A `Layout`
contains all other comments: lines before a program or a section of variables, lines before a variable, the comment on a
variable's line, and the lines at the end of a file.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from typing import Self

from msgspec import Struct, field
from msgspec.structs import replace

from vrs_cli.language.text.ast import BadLine, Comment, Entry, File, Number, Program, Section
from vrs_cli.language.words.values import key_of

Loose = Comment | BadLine  # a comment, or a line with a mistake, outside programs and sections
EntryKey = tuple[str, tuple[float, ...]]  # identifies a variable by its key and array indexes


class EntryComments(Struct, frozen=True):
    """The comments of a variable in a section: the comment lines before it (None for a blank line), and the comment on
    its own line.
    """

    before: tuple[str | None, ...] = ()
    comment: str | None = None


NOTHING = EntryComments()


class Layout(Struct, frozen=True):
    """The comments and blank lines of the loaded files. `parts`: the lines before each program (by key) or section (by
    name). `entries`: the comments of each variable. `ends`: the lines before the `.END` of each section. `tail`: the
    lines at the end of a file.
    """

    parts: Mapping[str, tuple[Loose, ...]] = field(default_factory=dict)
    entries: Mapping[EntryKey, EntryComments] = field(default_factory=dict)
    ends: Mapping[str, tuple[str | None, ...]] = field(default_factory=dict)
    tail: tuple[Loose, ...] = ()

    @classmethod
    def of(cls, file: File) -> Self:
        """Collect the comments and blank lines of one parsed file, and return them as a layout."""
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
        """Return the layout extended by the layout of another loaded file. If both have lines for the same program or
        variable, the lines of the other file are kept.
        """
        entries, ends = {**self.entries, **other.entries}, {**self.ends, **other.ends}
        return Layout({**self.parts, **other.parts}, entries, ends, other.tail or self.tail)

    def with_renamed(self, old: str, new: str) -> Layout:
        """Return the layout with a program's lines stored under its new name."""
        parts = dict(self.parts)
        parts[key_of(new)] = parts.pop(key_of(old), ())
        return replace(self, parts=parts)

    def with_part(self, key: str, before: Iterable[Loose]) -> Layout:
        """Return the layout with the lines `before` in place of those before a program; `before` is empty for a deleted
        program.
        """
        return replace(self, parts={**self.parts, key: tuple(before)})

    def laid_out(self, parts: Iterable[Program | Section]) -> Iterator[Program | Section | Loose]:
        """Yield programs and sections in order, each after its comments and blank lines. Blank lines at the start of
        the file are left out.
        """
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
