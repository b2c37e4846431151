"""All variables of a robot, by name: every one is global, unless a program declares it its own."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Set
from heapq import nsmallest
from itertools import chain, islice
from typing import NamedTuple

from vrs_cli.kinematics.joints import TURNING, JointUnits
from vrs_cli.language.run.cells import NO_CELLS, OTHER_KIND, Cells, Index, Item, Reference, bare_cells, subscript
from vrs_cli.language.text.ast import Entry, Number
from vrs_cli.language.words.values import (
    Kind,
    key_of,
    kind_of_name,
    kind_of_value,
    kinds_of_name,
    precision_point,
    transformation,
    whole,
)
from vrs_cli.values.numbers import Value


class NamedValue(NamedTuple):
    """A row of a listing: the name as it was first typed, with its indexes, and the value."""

    name: str
    value: Value


class Variables:
    """Variables by key, and how their names were first typed. `units`: how the joints of the robot are said."""

    def __init__(self, units: JointUnits = TURNING) -> None:
        self.units = units
        self.spelling: dict[str, str] = {}
        reals, locations = bare_cells(self.spelling)
        strings, precision_points = (Cells(self.spelling, kind) for kind in (Kind.STRING, Kind.PRECISION))
        self._simple = {
            Kind.REAL: reals,
            Kind.STRING: strings,
            Kind.LOCATION: locations,
            Kind.PRECISION: precision_points,
        }
        self._arrays: dict[Kind, dict[str, Cells]] = {kind: {} for kind in Kind}
        self._kinds = _Kinds(self._simple, self._arrays)
        self._changed: set[Item] | None = None

    def cells(self, kind: Kind, array: str | None = None) -> Cells:
        """The simple variables of a kind, or the elements of one array (empty where it has none yet)."""
        if array is None:
            return self._simple[kind]
        arrays = self._arrays[kind]
        if array not in arrays:
            if kind in OTHER_KIND:
                self._arrays[Kind.REAL][array], self._arrays[Kind.LOCATION][array] = bare_cells(self.spelling, array)
            else:
                arrays[array] = Cells(self.spelling, kind, array)
            for made in (kind, OTHER_KIND.get(kind, kind)):
                self._arrays[made][array].note_changes(self._changed)
        return arrays[array]

    def note_changes(self, changed: set[Item] | None) -> None:
        """Add every variable that changes from now on to a set; with None, note nothing, which is faster."""
        self._changed = changed
        for cells in self._all():
            cells.note_changes(changed)

    def _all(self) -> Iterator[Cells]:
        for kind in Kind:
            yield self._simple[kind]
            yield from self._arrays[kind].values()

    def reference(self, name: str, index: Index | None = None, *, array: bool = False) -> Reference:
        """The variable of that name (as typed); an element of an array; or, with `array`, the whole of it."""
        key = key_of(name)
        self.spelling.setdefault(key, name)
        kind = kind_of_name(key)
        owner = key if array or index is not None else None
        cells = self.cells(kind, owner)
        locations = self.cells(Kind.LOCATION, owner) if kind is Kind.REAL else NO_CELLS
        return Reference(cells, locations, index if owner else key)

    def define(self, entry: Entry) -> None:
        """A line of a .LOCATIONS, .REALS or .STRINGS section, in place of what the name was. Raises IllegalValue."""
        value: Value | None = entry.text
        if value is None and entry.variable.sigil == "#":
            value = precision_point(entry.numbers, self.units)
        elif value is None:
            value = entry.numbers[0] if len(entry.numbers) == 1 else transformation(entry.numbers)
        self.put_back((entry.variable.sigil + entry.variable.name, item_of(entry)[1]), value)

    def kind_of(self, name: str) -> Kind | None:
        """The kind of a variable or an array that has a value; None for a name without one."""
        return self.kinds().get(key_of(name))

    def kinds(self) -> Mapping[str, Kind]:
        """Every name that has a value, by key, and its kind: as they are whenever one looks."""
        return self._kinds

    def value(self, item: Item) -> Value | None:
        """The value of a variable or an element; None where it has none."""
        key, index = item
        for kind in kinds_of_name(key):
            cells = self._simple[kind] if index is None else self._arrays[kind].get(key, NO_CELLS)
            found = cells.get(key if index is None else index)
            if found is not None:
                return found
        return None

    def variables(self, kind: Kind) -> Iterator[NamedValue]:
        """Every value of a kind in the order of names and indexes, arrays element by element."""
        simple, arrays = self._named_by(kind)
        for key in sorted({*map(str, simple), *arrays}):
            yield from self._named(kind, key)

    def first_variables(self, kind: Kind, most: int, begun: str = "") -> Iterator[NamedValue]:
        """The first rows of `variables` of which the key begins so, at less cost: only these are put in order."""
        simple, arrays = self._named_by(kind)
        keys = [str(key) for key in (*simple, *(arrays - simple)) if str(key).startswith(begun)]
        rows = chain.from_iterable(self._named(kind, key) for key in nsmallest(most, keys))
        return islice(rows, most)

    def values_named(self, key: str) -> Iterator[NamedValue]:
        """What one name stands for: the simple variable, and all elements of the array."""
        for kind in Kind:
            yield from self._named(kind, key)

    def _named(self, kind: Kind, key: str) -> Iterator[NamedValue]:
        simple, elements = self._simple[kind], self._arrays[kind].get(key, NO_CELLS)
        if key in simple:
            yield NamedValue(simple.name(key), simple[key])
        indexes = [index for index in elements if not isinstance(index, str)]
        for index in sorted(indexes, key=lambda index: index if isinstance(index, tuple) else (index,)):
            yield NamedValue(elements.name(index), elements[index])

    def values(self) -> dict[Item, Value]:
        """Every value by its variable."""
        return {cells.item(key): value for cells in self._all() for key, value in cells.items()}

    def put_back(self, item: Item, value: Value) -> None:
        """Give a variable a value, whatever its kind is now. The item may have the name as it is typed."""
        key, index = item
        if self.kind_of(key) not in (None, kind_of_value(value)):
            self.delete(key)
        self.reference(key, index).assign(value)

    def take(self, other: Variables) -> None:
        """Give the variables of others their values, in place of what their names were."""
        self.spelling |= other.spelling | self.spelling
        for kind, rival in OTHER_KIND.items():
            for names in other._named_by(kind):
                for rivals in self._named_by(rival):
                    for key in names & rivals:
                        self.delete(str(key))
        for kind in Kind:
            self._simple[kind].take(other._simple[kind])
            for array, elements in other._arrays[kind].items():
                if elements:
                    self.cells(kind, array).take(elements)

    def alone(self, key: str) -> Variables:
        """One name with all that it stands for now."""
        found = Variables(self.units)
        found.spelling[key] = self.spelling.get(key, key)
        for kind in kinds_of_name(key):
            if key in self._simple[kind]:
                found._simple[kind][key] = self._simple[kind][key]
            if key in self._arrays[kind]:
                found.cells(kind, key).take(self._arrays[kind][key])
        return found

    def _named_by(self, kind: Kind) -> tuple[Set[str | Index], Set[str]]:
        """The keys of the simple variables of a kind, and of its arrays."""
        return self._simple[kind].keys(), {array for array, cells in self._arrays[kind].items() if cells}

    def name_of(self, item: Item) -> str:
        """A variable as a listing shows it."""
        key, index = item
        spelled = self.spelling.get(key, key)
        return spelled if index is None else f"{spelled}[{subscript(index)}]"

    def count(self, kind: Kind | None = None) -> int:
        """How many have a value (of a kind), elements of arrays each."""
        cells = self._all() if kind is None else chain((self._simple[kind],), self._arrays[kind].values())
        return sum(map(len, cells))

    def size(self) -> int:
        """Elements of all arrays, and characters of all strings."""
        return sum(cells.size() for cells in self._all())

    def delete(self, name: str, index: Index | None = None) -> bool:
        """Forget a variable and the array of that name, or one element. False where there was none."""
        key = key_of(name)
        if self.kind_of(name) is None:
            return False
        if index is not None:
            return any(self.cells(kind, key).pop(index, None) is not None for kind in Kind)
        for kind in Kind:
            self._simple[kind].pop(key, None)
            self.cells(kind, key).clear()
        return True

    def clear_variables(self) -> None:
        """Forget all variables."""
        for cells in self._all():
            cells.clear()


class _Kinds(Mapping[str, Kind]):
    """The names that have a value, and their kinds. Nothing is copied: a line of the prompt asks for a few of many."""

    def __init__(self, simple: Mapping[Kind, Cells], arrays: Mapping[Kind, Mapping[str, Cells]]) -> None:
        self._rows = tuple((kind, simple[kind], arrays[kind]) for kind in Kind)

    def __getitem__(self, key: str) -> Kind:
        for kind, simple, arrays in self._rows:
            if key in simple or arrays.get(key):
                return kind
        raise KeyError(key)

    def __iter__(self) -> Iterator[str]:
        known: dict[str, None] = {}
        for _, simple, arrays in self._rows:
            known |= dict.fromkeys(key for key, cells in arrays.items() if cells)
            known |= dict.fromkeys(map(str, simple))
        return iter(known)

    def __len__(self) -> int:
        return sum(1 for _ in self)


def item_of(entry: Entry) -> Item:
    """The variable that a line of a section defines."""
    indexes = tuple(whole(number.value) for number in entry.variable.indexes or () if isinstance(number, Number))
    return entry.variable.key, None if not indexes else indexes if len(indexes) > 1 else indexes[0]
