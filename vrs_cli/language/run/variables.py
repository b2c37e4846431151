"""Store the variables of a robot by name. All variables are global unless a program declares its own.

Variables are stored in cells of one kind: dictionaries that compiled programs read and write directly. Two rules always
hold: a bare name is either a real or a transformation, never both; and a missing cell means an undefined variable, so
that reading it raises the error.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Set
from heapq import nsmallest
from itertools import chain, islice, repeat
from typing import Any, NamedTuple, NoReturn, cast
from weakref import ref

from vrs_cli.errors import IllegalArrayIndex, TypeMismatch, UndefinedValue, nearest
from vrs_cli.kinematics.joints import TURNING, JointUnits
from vrs_cli.language.text.ast import Entry, Number
from vrs_cli.language.words.foreign import giving, value_given
from vrs_cli.language.words.values import (
    Kind,
    key_of,
    kind_of_name,
    kind_of_value,
    kinds_of_name,
    storable,
    transformation,
    whole,
)
from vrs_cli.values.numbers import Value

Index = int | tuple[int, ...]
Item = tuple[str, Index | None]  # the key of a variable, and the index if the item is an array element

OTHER_KIND = {Kind.REAL: Kind.LOCATION, Kind.LOCATION: Kind.REAL}


def closest(key: str, names: Mapping[str, str]) -> str:
    """Return `did you mean X?` for an unknown key, or "" if no key is similar. `names`: the spelling of each known
    key."""
    near = nearest(key, names, 0.7)
    return f"did you mean {names[near]}?" if near else ""


def subscript(index: Index) -> str:
    return ",".join(map(str, index)) if isinstance(index, tuple) else str(index)


class Cells(dict[str | Index, Value]):
    """Values of one kind: all simple variables of the kind by key, or the elements of one `array` by index.

    Reading a missing value raises UndefinedValue, TypeMismatch or IllegalArrayIndex. `spelling`: the first spelling of
    each name, by key. `others`: the cells of the other kind that a bare name can have. `omitted`: the form of the call,
    if these are the cells of a parameter whose argument a CALL left out. `changed`: the set of changed variables, while
    changes are recorded.
    """

    __slots__ = ("__weakref__", "array", "changed", "kind", "omitted", "others", "spelling")

    def __init__(
        self, spelling: Mapping[str, str], kind: Kind, array: str | None = None, omitted: str | None = None
    ) -> None:
        self.spelling = spelling
        self.kind = kind
        self.array = array
        self.omitted = omitted
        self.others: ref[Cells] | None = None  # a weak reference, because cycles would never be freed on a server
        self.changed: set[Item] | None = None

    def note_changes(self, changed: set[Item] | None) -> None:
        """Record every later change of a variable in the set `changed`; with None, stop recording."""
        self.changed = changed
        self.__class__ = Cells if changed is None else NotedCells

    def __missing__(self, key: str | Index) -> Value:
        if self.omitted is not None:
            hint = f"its argument was left out: CALL {self.omitted} gives it, or {{EXECUTE}}"
            raise UndefinedValue(self.name(key), hint)
        if self.array is not None and not isinstance(key, str):
            rounded = self.round_indexes(key if isinstance(key, tuple) else (key,))
            exact: Index = rounded if len(rounded) > 1 else rounded[0]
            if key != exact:
                return self[exact]  # compiled programs do not round the index of an element that they read
            key = exact
        others = None if self.others is None else self.others()
        if others is not None and key in others:
            self.deny(key)
        simple = self if self.array is None and isinstance(key, str) else ()
        near = closest(str(key), {str(name): self.name(name) for name in simple})
        indexes = [index for index in self if isinstance(index, int)] if self.array is not None else []
        if indexes:
            low, high = min(indexes), max(indexes)
            near = f"its only element is {low}" if low == high else f"its elements are {low} to {high}"
        raise UndefinedValue(self.name(key), near or giving(self.name(key), self.kind) or value_given(self.name(key)))

    def take(self, values: Mapping[str | Index, Value]) -> None:
        """Assign many values."""
        self.update(values)

    def size(self) -> int:
        """Return the number of array elements and of string characters."""
        elements = 0 if self.array is None else len(self)
        if self.kind is not Kind.STRING:
            return elements
        return elements + sum(len(value) for value in self.values() if isinstance(value, str))

    def name(self, key: str | Index) -> str:
        """Return the name of a variable as listings show it: `part`, `#safe`, `row[3]`."""
        if self.array is None:
            return self.spelling.get(str(key), str(key))
        spelling = self.spelling.get(self.array, self.array)
        return f"{spelling}[{'' if isinstance(key, str) else subscript(key)}]"

    def deny(self, key: str | Index) -> NoReturn:
        """Raise TypeMismatch for a bare name that exists as the other kind. Compiled programs also call this method."""
        other = OTHER_KIND[self.kind]
        raise TypeMismatch(f"{self.name(key)} is a {other.value}", f"a {self.kind.value} is wanted here")

    def index(self, index: float) -> int:
        """Return the rounded index of an element that will be assigned. Raises IllegalArrayIndex for a negative
        index."""
        return int(index + 0.5) if index >= 0.0 else self.round_indexes((index,))[0]

    def round_indexes(self, indexes: Iterable[float]) -> tuple[int, ...]:
        """Return indexes rounded to integers. Raises IllegalArrayIndex for a negative index."""
        rounded = tuple(map(whole, indexes))
        if min(rounded) < 0:
            raise IllegalArrayIndex(self.name(rounded), "indexes begin at 0")
        return rounded

    def item(self, key: str | Index) -> Item:
        """Return the variable or array element that a key of these cells denotes."""
        return (str(key), None) if self.array is None else (self.array, cast(Index, key))


class RealArgument(Cells):
    """The cells of one real that a CALL passes by value. Creating them calls no Python code of ours, which is
    faster."""

    __slots__ = ()
    spelling: Mapping[str, str] = {}
    kind = Kind.REAL
    array = omitted = others = changed = None
    __init__ = dict.__init__


class NotedCells(Cells):
    """Cells that record which variables change. Writing to them is slower, so programs usually run on plain cells."""

    __slots__ = ()

    def __setitem__(self, key: str | Index, value: Value) -> None:
        if self.get(key) != value:
            self._note(key)
        super().__setitem__(key, value)

    def take(self, values: Mapping[str | Index, Value]) -> None:
        old = self.get
        keys = [key for key, value in values.items() if old(key) != value]
        items = zip(keys, repeat(None)) if self.array is None else zip(repeat(self.array), keys)
        if self.changed is not None:
            self.changed.update(cast(Iterable[Item], items))
        super().take(values)

    def pop(self, key: str | Index, default: Any = None) -> Any:
        if key in self:
            self._note(key)
        return super().pop(key, default)

    def clear(self) -> None:
        for key in self:
            self._note(key)
        super().clear()

    def _note(self, key: str | Index) -> None:
        if self.changed is not None:
            self.changed.add(self.item(key))


def bare_cells(
    spelling: Mapping[str, str], array: str | None = None, omitted: str | None = None
) -> tuple[Cells, Cells]:
    """Make the cells of the two kinds that a bare name can have: reals and transformations."""
    reals = Cells(spelling, Kind.REAL, array, omitted)
    locations = Cells(spelling, Kind.LOCATION, array, omitted)
    reals.others, locations.others = ref(locations), ref(reals)
    return reals, locations


class EmptyStrings(Cells):
    """The value of an AUTO string or of an AUTO array of strings: empty until it is assigned.

    According to the V+ Language User's Guide (p. 110) such a variable has no value before an assignment. But the driver
    for ROS that Adept published in 2012 works on controllers, although it uses elements of an AUTO array that it never
    assigns. We follow that program, for AUTO strings only; probable.
    """

    __slots__ = ()

    def __missing__(self, key: str | Index) -> Value:
        if self.array is not None and not isinstance(key, str):
            self.round_indexes(key if isinstance(key, tuple) else (key,))
        return ""


class SubArray(Cells):
    """Part of an array: the elements whose first indexes are `before`. Their keys here are the remaining indexes."""

    __slots__ = ("_before", "_whole")

    def __init__(self, whole_array: Cells, before: tuple[int, ...]) -> None:
        super().__init__(whole_array.spelling, whole_array.kind, whole_array.array, whole_array.omitted)
        self._whole, self._before = whole_array, before

    def _index(self, key: str | Index) -> str | Index:
        return key if isinstance(key, str) else self._before + (key if isinstance(key, tuple) else (key,))

    def __getitem__(self, key: str | Index) -> Value:
        return self._whole[self._index(key)]

    def __setitem__(self, key: str | Index, value: Value) -> None:
        self._whole[self._index(key)] = value

    def __contains__(self, key: object) -> bool:
        return isinstance(key, str | int | tuple) and self._index(key) in self._whole

    def __iter__(self) -> Iterator[str | Index]:
        size = len(self._before)
        for index in list(self._whole):
            if isinstance(index, tuple) and len(index) > size and index[:size] == self._before:
                yield index[size] if len(index) == size + 1 else index[size:]

    def __len__(self) -> int:
        return sum(1 for _ in self)

    def name(self, key: str | Index) -> str:
        """Return the name of an element as part of the whole array."""
        if isinstance(key, str):
            return self._whole.name(self._before).replace("]", ",]")
        return self._whole.name(self._index(key))


NO_CELLS = Cells({}, Kind.LOCATION)  # the cells of the other kind for a `#` or `$` name, which has one kind only


class Reference(NamedTuple):
    """A reference to a variable, which can be passed on and assigned: an argument of CALL, HERE, PROMPT ...

    `cells`: the cells of its kind. A bare name may have two kinds: then `cells` are the reals and `locations` the
    transformations; for `#` and `$` names `locations` is empty. `key`: None for a whole array.
    """

    cells: Cells
    locations: Cells
    key: str | Index | None

    @property
    def name(self) -> str:
        return self.cells.name("" if self.key is None else self.key)

    def has_value(self) -> bool:
        """Return whether the variable, or any element of the array, has a value."""
        if self.key is None:
            return bool(self.cells or self.locations)
        return self.key in self.cells or self.key in self.locations

    def value(self) -> Value:
        """Return the value, of any kind. Raises UndefinedValue."""
        key = self._cell()
        return self.locations[key] if key in self.locations else self.cells[key]

    def assign(self, value: Value) -> None:
        """Assign a value. Raises TypeMismatch if the name exists as another kind, IllegalArrayIndex for a negative
        index."""
        key = self._cell()
        kind = kind_of_value(value)
        to_location = kind is Kind.LOCATION and self.cells.kind is Kind.REAL
        mine, other = (self.locations, self.cells) if to_location else (self.cells, self.locations)
        if mine.kind is not kind:
            wanted = "real or a transformation" if self.cells.kind is Kind.REAL else self.cells.kind.value
            raise TypeMismatch(f"{self.name} cannot hold a {kind.value}", f"a {wanted} is wanted")
        if key in other:
            mine.deny(key)
        if not isinstance(key, str):
            self.cells.round_indexes(key if isinstance(key, tuple) else (key,))
        mine[key] = storable(value) if isinstance(value, str) else value

    def row(self, *indexes: float) -> Reference:
        """Return the part of an array whose first indexes are these: `a[i,]`. Raises IllegalArrayIndex."""
        before = self.cells.round_indexes(indexes)
        locations = self.locations if self.locations is NO_CELLS else SubArray(self.locations, before)
        return Reference(SubArray(self.cells, before), locations, None)

    def size(self) -> int:
        """Return the number of array elements and of string characters."""
        return self.cells.size() + self.locations.size()

    def _cell(self) -> str | Index:
        if self.key is None:
            raise IllegalArrayIndex(self.name, "one element is wanted, not the whole array")
        return self.key


# the fields of a Reference, in the form in which CALL passes an argument
Given = tuple[Cells, Cells, str | Index | None]


def new_variable(
    spelling: Mapping[str, str],
    key: str,
    kind: Kind,
    *,
    array: bool = False,
    automatic: bool = False,
    omitted: str | None = None,
) -> Reference:
    """Make a variable without a value, in separate cells. A variable of `kind` REAL can become a transformation. An
    `automatic` string is empty."""
    name, place = (key, None) if array else (None, key)
    if automatic and kind is Kind.STRING:
        return Reference(EmptyStrings(spelling, kind, name), NO_CELLS, place)
    if kind is Kind.REAL:
        return Reference(*bare_cells(spelling, name, omitted), place)
    return Reference(Cells(spelling, kind, name, omitted), NO_CELLS, place)


class NamedValue(NamedTuple):
    """A row of a listing: the name of a variable in its first spelling, with indexes, and its value."""

    name: str
    value: Value


class Variables:
    """Variables by key, and the first spelling of their names. `units`: the units of the joints. `kinds`: a live view
    of the kind of each name that has a value, by key."""

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
        self.kinds: Mapping[str, Kind] = _Kinds(self._simple, self._arrays)
        self._changed: set[Item] | None = None

    def cells(self, kind: Kind, array: str | None = None) -> Cells:
        """Return the simple variables of a kind, or the elements of one array (empty if the array has none yet)."""
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
        """Record every later change of a variable in the set `changed`. With None, stop recording, which is faster."""
        self._changed = changed
        for cells in self._all():
            cells.note_changes(changed)

    def _all(self) -> Iterator[Cells]:
        for kind in Kind:
            yield self._simple[kind]
            yield from self._arrays[kind].values()

    def reference(self, name: str, index: Index | None = None, *, array: bool = False) -> Reference:
        """Return a reference to the variable with a name (as typed), to an element of an array, or with `array` to the
        whole array."""
        key = key_of(name)
        self.spelling.setdefault(key, name)
        kind = kind_of_name(key)
        owner = key if array or index is not None else None
        cells = self.cells(kind, owner)
        locations = self.cells(Kind.LOCATION, owner) if kind is Kind.REAL else NO_CELLS
        return Reference(cells, locations, index if owner else key)

    def define(self, entry: Entry) -> None:
        """Assign the value in a line of a .LOCATIONS, .REALS or .STRINGS section. Raises IllegalValue."""
        value: Value | None = entry.text
        if value is None and entry.variable.sigil == "#":
            value = self.units.read(entry.numbers)
        elif value is None:
            value = entry.numbers[0] if len(entry.numbers) == 1 else transformation(entry.numbers)
        self.put_back((entry.variable.sigil + entry.variable.name, item_of(entry)[1]), value)

    def kind_of(self, name: str) -> Kind | None:
        """Return the kind of a variable or an array; None if the name has no value."""
        return self.kinds.get(key_of(name))

    def value(self, item: Item) -> Value | None:
        """Return the value of a variable or an element; None if it has no value."""
        key, index = item
        for kind in kinds_of_name(key):
            cells = self._simple[kind] if index is None else self._arrays[kind].get(key, NO_CELLS)
            if (found := cells.get(key if index is None else index)) is not None:
                return found
        return None

    def variables(self, kind: Kind) -> Iterator[NamedValue]:
        """Yield every value of a kind, sorted by names and indexes, arrays element by element."""
        simple, arrays = self._named_by(kind)
        for key in sorted({*map(str, simple), *arrays}):
            yield from self._rows_named(kind, key)

    def first_variables(self, kind: Kind, most: int, begun: str = "") -> Iterator[NamedValue]:
        """Yield the first rows of `variables` whose key begins with `begun`, at most `most`; only these are sorted."""
        simple, arrays = self._named_by(kind)
        keys = [str(key) for key in (*simple, *(arrays - simple)) if str(key).startswith(begun)]
        rows = chain.from_iterable(self._rows_named(kind, key) for key in nsmallest(most, keys))
        return islice(rows, most)

    def _rows_named(self, kind: Kind, key: str) -> Iterator[NamedValue]:
        simple, elements = self._simple[kind], self._arrays[kind].get(key, NO_CELLS)
        if key in simple:
            yield NamedValue(simple.name(key), simple[key])
        for index in sorted(
            [index for index in elements if not isinstance(index, str)],
            key=lambda index: index if isinstance(index, tuple) else (index,),
        ):
            yield NamedValue(elements.name(index), elements[index])

    def values(self) -> dict[Item, Value]:
        return {cells.item(key): value for cells in self._all() for key, value in cells.items()}

    def put_back(self, item: Item, value: Value) -> None:
        """Assign a value to a variable, even if the variable now has another kind. The item may contain the name as
        typed."""
        key, index = item
        if self.kind_of(key) not in (None, kind_of_value(value)):
            self.delete(key)
        self.reference(key, index).assign(value)

    def take(self, other: Variables) -> None:
        """Copy the values of other variables. They replace all values with the same names."""
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
        """Return a copy with one name only: the simple variables and arrays of all kinds with that name."""
        found = Variables(self.units)
        found.spelling[key] = self.spelling.get(key, key)
        for kind in kinds_of_name(key):
            if key in self._simple[kind]:
                found._simple[kind][key] = self._simple[kind][key]
            if key in self._arrays[kind]:
                found.cells(kind, key).take(self._arrays[kind][key])
        return found

    def _named_by(self, kind: Kind) -> tuple[Set[str | Index], Set[str]]:
        """Return the keys of the simple variables of a kind, and the keys of its arrays."""
        return self._simple[kind].keys(), {array for array, cells in self._arrays[kind].items() if cells}

    def name_of(self, item: Item) -> str:
        """Return the name of a variable as listings show it."""
        key, index = item
        spelled = self.spelling.get(key, key)
        return spelled if index is None else f"{spelled}[{subscript(index)}]"

    def count(self, kind: Kind | None = None) -> int:
        """Return the number of values (of one kind, or of all); each array element counts."""
        return sum(map(len, self._all() if kind is None else chain((self._simple[kind],), self._arrays[kind].values())))

    def size(self) -> int:
        """Return the number of elements in all arrays and of characters in all strings."""
        return sum(cells.size() for cells in self._all())

    def delete(self, name: str, index: Index | None = None) -> bool:
        """Delete a variable and the array of the same name, or one element. Return whether anything was deleted."""
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
        for cells in self._all():
            cells.clear()


class _Kinds(Mapping[str, Kind]):
    """A view of the defined names and their kinds. It copies nothing, because a line of the prompt needs only a few of
    the many names."""

    def __init__(self, simple: Mapping[Kind, Cells], arrays: Mapping[Kind, Mapping[str, Cells]]) -> None:
        self._rows = tuple((kind, simple[kind], arrays[kind]) for kind in Kind)

    def __getitem__(self, key: str) -> Kind:
        for kind, simple, arrays in self._rows:
            if key in simple or arrays.get(key):
                return kind
        raise KeyError(key)

    def __contains__(self, key: object) -> bool:  # a loop, because each line of the prompt looks up 15 names
        for _, simple, arrays in self._rows:  # noqa: SIM110 - a generator would be called for each name
            if key in simple or arrays.get(key):  # type: ignore[call-overload]
                return True
        return False

    def __iter__(self) -> Iterator[str]:
        known: dict[str, None] = {}
        for _, simple, arrays in self._rows:
            known |= dict.fromkeys(key for key, cells in arrays.items() if cells)
            known |= dict.fromkeys(map(str, simple))
        return iter(known)

    def __len__(self) -> int:
        return sum(1 for _ in self)


def item_of(entry: Entry) -> Item:
    """Return the variable or array element that a line of a section defines."""
    indexes = tuple(whole(number.value) for number in entry.variable.indexes or () if isinstance(number, Number))
    return entry.variable.key, None if not indexes else indexes if len(indexes) > 1 else indexes[0]
