"""Store the variables of a robot by name. All variables are global unless a program declares private ones.

The values are stored in `Cells`: dictionaries, each for values of one kind, which compiled programs read and write
directly. Two rules always hold: a bare name is either a real or a transformation, never both; and a key that is missing
is an undefined variable, so that reading it raises an error.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Set
from itertools import chain, islice, repeat
from typing import Any, NamedTuple, NoReturn, cast
from weakref import ref

from vrs_cli.errors import IllegalArrayIndex, TypeMismatch, UndefinedValue, nearest
from vrs_cli.kinematics.joints import TURNING, JointUnits
from vrs_cli.language.text.ast import Entry, Number
from vrs_cli.language.words.foreign import assignment_hint, value_given
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
Item = tuple[str, Index | None]  # the key of a variable, and the index for an array element (otherwise None)

OTHER_KIND = {Kind.REAL: Kind.LOCATION, Kind.LOCATION: Kind.REAL}


def closest(key: str, names: Mapping[str, str]) -> str:
    """Return `did you mean X?` for an unknown key, or "" if no known key is similar. `names`: the known keys with their
    spelling."""
    near = nearest(key, names, 0.7)
    return f"did you mean {names[near]}?" if near else ""


def subscript(index: Index) -> str:
    return ",".join(map(str, index)) if isinstance(index, tuple) else str(index)


class Cells(dict[str | Index, Value]):
    """Values of one kind: those of all simple variables of the kind by key, or of the elements of one array by index.

    Reading a missing value raises UndefinedValue, TypeMismatch or IllegalArrayIndex. `spelling`: the first spelling of
    each name, by key. `array`: the key of the array, or None. `others`: for bare names, the cells of the other kind
    (real or location). `omitted`: the form of the call, for the parameter of an argument that a CALL has omitted.
    `changed`: the set in which changed variables are recorded, or None.
    """

    __slots__ = ("__weakref__", "array", "changed", "kind", "omitted", "others", "spelling")

    def __init__(
        self, spelling: Mapping[str, str], kind: Kind, array: str | None = None, omitted: str | None = None
    ) -> None:
        self.spelling = spelling
        self.kind = kind
        self.array = array
        self.omitted = omitted
        self.others: ref[Cells] | None = None  # a weak reference, because a server does not free reference cycles
        self.changed: set[Item] | None = None

    def note_changes(self, changed: set[Item] | None) -> None:
        """Record every later change of a variable in the set `changed`, or stop recording if it is None."""
        # change the class rather than test `changed` at each assignment, which would be slower
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
                return self[exact]  # compiled programs leave it to this method to round the index of an element
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
        raise UndefinedValue(
            self.name(key), near or assignment_hint(self.name(key), self.kind) or value_given(self.name(key))
        )

    def take(self, values: Mapping[str | Index, Value]) -> None:
        """Assign many values, given by key."""
        self.update(values)

    def size(self) -> int:
        """Return the number of array elements plus the number of string characters."""
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
        """Raise TypeMismatch, because a bare name has a value of the other kind (real or location). Compiled programs
        also call this."""
        other = OTHER_KIND[self.kind]
        raise TypeMismatch(f"{self.name(key)} is a {other.value}", f"a {self.kind.value} is wanted here")

    def index(self, index: float) -> int:
        """Return the index of an array element, rounded to an integer, for an assignment. Raises IllegalArrayIndex if
        it is negative."""
        return int(index + 0.5) if index >= 0.0 else self.round_indexes((index,))[0]

    def round_indexes(self, indexes: Iterable[float]) -> tuple[int, ...]:
        """Return indexes, rounded to integers. Raises IllegalArrayIndex if one is negative."""
        rounded = tuple(map(whole, indexes))
        if min(rounded) < 0:
            raise IllegalArrayIndex(self.name(rounded), "indexes begin at 0")
        return rounded

    def item(self, key: str | Index) -> Item:
        """Convert a key of these cells to an Item, which also names the array."""
        return (str(key), None) if self.array is None else (self.array, cast(Index, key))


class RealArgument(Cells):
    """The cells for one real that a CALL passes by value. They are created by `dict.__init__` without any code written
    in Python, because calls must be fast."""

    __slots__ = ()
    spelling: Mapping[str, str] = {}
    kind = Kind.REAL
    array = omitted = others = changed = None
    __init__ = dict.__init__


class NotedCells(Cells):
    """Cells that record which variables change. Cells become NotedCells only while changes are recorded, because
    writing to NotedCells is slower."""

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
    """Return two linked cells for bare names: one for reals, one for transformations. `array`, `omitted`: see Cells."""
    reals = Cells(spelling, Kind.REAL, array, omitted)
    locations = Cells(spelling, Kind.LOCATION, array, omitted)
    reals.others, locations.others = ref(locations), ref(reals)
    return reals, locations


class EmptyStrings(Cells):
    """The cells of an AUTO string or an AUTO array of strings, whose values are "" until they are assigned.

    According to the V+ Language User's Guide (p. 110) such a variable has no value before an assignment. But the driver
    for ROS that Adept published in 2012 works on real controllers, although it uses elements of an AUTO array that it
    never assigns. So AUTO strings probably begin empty; other AUTO variables begin without a value.
    """

    __slots__ = ()

    def __missing__(self, key: str | Index) -> Value:
        if self.array is not None and not isinstance(key, str):
            self.round_indexes(key if isinstance(key, tuple) else (key,))
        return ""


class SubArray(Cells):
    """A part of an array: the elements whose first indexes are `before`. Their keys here are the remaining indexes;
    reading and writing use the cells of the whole array."""

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
        """Return the name of an element in the whole array, with all its indexes."""
        if isinstance(key, str):
            return self._whole.name(self._before).replace("]", ",]")
        return self._whole.name(self._index(key))


NO_CELLS = Cells({}, Kind.LOCATION)  # always empty; used as `locations` of a `#` or `$` name, which has only one kind


class Reference(NamedTuple):
    """A reference to a variable or a whole array, through which it can be read and assigned: an argument of CALL, HERE,
    PROMPT ...

    `cells`: the cells (stored values) that may contain the variable; for a bare name, the cells of reals. `locations`:
    for a bare name, the cells of transformations; for a `#` or `$` name, NO_CELLS. `key`: the key or index in the
    cells, None for a whole array.
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
        """Return the value, which may be of any kind. Raises UndefinedValue, or IllegalArrayIndex for a whole array."""
        key = self._cell()
        return self.locations[key] if key in self.locations else self.cells[key]

    def assign(self, value: Value) -> None:
        """Assign a value. Raises TypeMismatch if the name cannot have its kind or exists with the other kind,
        IllegalArrayIndex for a negative index."""
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
        """Return a reference to the part of an array that has these first indexes: `a[i,]`. Raises
        IllegalArrayIndex."""
        before = self.cells.round_indexes(indexes)
        locations = self.locations if self.locations is NO_CELLS else SubArray(self.locations, before)
        return Reference(SubArray(self.cells, before), locations, None)

    def size(self) -> int:
        """Return the number of array elements plus the number of string characters."""
        return self.cells.size() + self.locations.size()

    def _cell(self) -> str | Index:
        if self.key is None:
            raise IllegalArrayIndex(self.name, "one element is wanted, not the whole array")
        return self.key


# the fields of a Reference as a plain tuple, which is how CALL passes an argument
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
    """Return a reference to a new variable without a value, in cells of its own. `kind`: its kind; REAL also allows a
    transformation. `array`: make an array; `automatic`: make an AUTO variable, whose strings begin empty; `omitted`:
    see Cells."""
    name, place = (key, None) if array else (None, key)
    if automatic and kind is Kind.STRING:
        return Reference(EmptyStrings(spelling, kind, name), NO_CELLS, place)
    if kind is Kind.REAL:
        return Reference(*bare_cells(spelling, name, omitted), place)
    return Reference(Cells(spelling, kind, name, omitted), NO_CELLS, place)


class NamedValue(NamedTuple):
    """A value as a row of a listing. `name`: the variable in its first spelling, with indexes."""

    name: str
    value: Value


class Variables:
    """The variables of a robot. `units`: the units of its joints; `spelling`: the first spelling of each name, by key;
    `kinds`: a live view of the kinds of all names that have a value, by key."""

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
        """Return the cells (stored values) of all simple variables of a kind, or of one array, which is created empty
        if it is new. `array`: the key of the array, or None."""
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
        """Record every later change of a variable in the set `changed`. With None, stop recording, which makes
        assignments faster."""
        self._changed = changed
        for cells in self._all():
            cells.note_changes(changed)

    def _all(self) -> Iterator[Cells]:
        for kind in Kind:
            yield self._simple[kind]
            yield from self._arrays[kind].values()

    def reference(self, name: str, index: Index | None = None, *, array: bool = False) -> Reference:
        """Return a reference to a variable, to an array element (if there is an `index`), or to a whole array (if
        `array` is True). `name`: the name as typed."""
        key = key_of(name)
        self.spelling.setdefault(key, name)
        kind = kind_of_name(key)
        owner = key if array or index is not None else None
        cells = self.cells(kind, owner)
        locations = self.cells(Kind.LOCATION, owner) if kind is Kind.REAL else NO_CELLS
        return Reference(cells, locations, index if owner else key)

    def define(self, entry: Entry) -> None:
        """Assign the value that a line of a .LOCATIONS, .REALS or .STRINGS section gives. Raises IllegalValue."""
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
        """Yield all values of a kind, sorted by name and index; each array element is one value."""
        simple, arrays = self._named_by(kind)
        for key in sorted({*map(str, simple), *arrays}):
            yield from self._rows_named(kind, key)

    def first_variables(self, kind: Kind, most: int, begun: str = "") -> Iterator[NamedValue]:
        """Yield the first `most` rows of `variables` whose keys begin with `begun`. This is faster than `variables`,
        because not all keys are sorted."""
        simple, arrays = self._named_by(kind)
        keys = [str(key) for key in (*simple, *(arrays - simple)) if str(key).startswith(begun)]
        from heapq import nsmallest  # imported here because only lists of variables need it

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
        """Assign a value to a variable; if the variable has another kind, delete it first. `item` may have the name as
        typed in place of the key."""
        key, index = item
        if self.kind_of(key) not in (None, kind_of_value(value)):
            self.delete(key)
        self.reference(key, index).assign(value)

    def take(self, other: Variables) -> None:
        """Copy all values from `other`. The copies replace values of the same names, even values of another kind."""
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
        """Return a copy that contains only one name: the simple variables and arrays with this key, of all kinds."""
        found = Variables(self.units)
        found.spelling[key] = self.spelling.get(key, key)
        for kind in kinds_of_name(key):
            if key in self._simple[kind]:
                found._simple[kind][key] = self._simple[kind][key]
            if key in self._arrays[kind]:
                found.cells(kind, key).take(self._arrays[kind][key])
        return found

    def _named_by(self, kind: Kind) -> tuple[Set[str | Index], Set[str]]:
        """Return the keys of the simple variables of a kind, and the keys of the arrays that have elements."""
        return self._simple[kind].keys(), {array for array, cells in self._arrays[kind].items() if cells}

    def name_of(self, item: Item) -> str:
        """Return the name of a variable or array element as listings show it."""
        key, index = item
        spelled = self.spelling.get(key, key)
        return spelled if index is None else f"{spelled}[{subscript(index)}]"

    def count(self, kind: Kind | None = None) -> int:
        """Return the number of values of one kind, or of all kinds; each array element is one value."""
        return sum(map(len, self._all() if kind is None else chain((self._simple[kind],), self._arrays[kind].values())))

    def size(self) -> int:
        """Return the number of all array elements plus the number of all string characters."""
        return sum(cells.size() for cells in self._all())

    def delete(self, name: str, index: Index | None = None) -> bool:
        """Delete a variable and the array of the same name; or, if there is an `index`, one array element. Return
        whether anything was deleted."""
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
    """A mapping from the key of each variable with a value to its kind. It looks into the cells and copies nothing,
    because a line typed at the prompt needs only a few of the many names."""

    def __init__(self, simple: Mapping[Kind, Cells], arrays: Mapping[Kind, Mapping[str, Cells]]) -> None:
        self._rows = tuple((kind, simple[kind], arrays[kind]) for kind in Kind)

    def __getitem__(self, key: str) -> Kind:
        for kind, simple, arrays in self._rows:
            if key in simple or arrays.get(key):
                return kind
        raise KeyError(key)

    def __contains__(self, key: object) -> bool:  # must be fast: each line typed at the prompt looks up about 15 names
        for _, simple, arrays in self._rows:  # noqa: SIM110 - any() with a generator would be slower
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
    """Return the variable or array element that a line in a section of variables defines."""
    indexes = tuple(whole(number.value) for number in entry.variable.indexes or () if isinstance(number, Number))
    return entry.variable.key, None if not indexes else indexes if len(indexes) > 1 else indexes[0]
