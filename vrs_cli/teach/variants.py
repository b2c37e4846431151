"""Compute variants of an exercise from a seed: which things are moved, and how far.

A variant moves groups of things, each group as one rigid body: it shifts the group in the world, and turns it about
the vertical through the first thing that the group names. All times of the group change by one amount, and all its
values by another.

The amounts come from Python's `random.Random(seed)`: for each group, in the order of the file, six calls of `random()`
give numbers from -1 to 1 for X, Y, Z, the turn, the time and the value. Shifts are rounded to 0.01 mm, turns to 0.01
deg, times and values to 0.001. If a group shuffles, one more call for each part gives the order in which its feeders
deliver the parts.
"""

from __future__ import annotations

from math import degrees, radians
from random import Random
from typing import NamedTuple

from msgspec import Struct, structs

from vrs_cli.files.cell_text import CellEntry
from vrs_cli.interfaces.station.loaded_file import LoadedFile
from vrs_cli.kinematics import transform
from vrs_cli.language.run.signals import Cell, Inputs
from vrs_cli.language.run.variables import Item, Variables
from vrs_cli.language.words.values import key_of
from vrs_cli.teach.exercise_text import ExerciseText, item_of_text
from vrs_cli.trajectory.instant import LATEST, on_grid
from vrs_cli.values.numbers import LIMIT, Value
from vrs_cli.values.scene import Beam, Feeder, Proximity, Sensor, Zone

GROUP_KEYS = ("move", "by", "turn", "later", "value", "shuffle")
MM_STEP, DEG_STEP, S_STEP, VALUE_STEP = 0.01, 0.01, 0.001, 0.001


class Group(Struct, frozen=True):
    """Things that a variant changes together.

    `names`: names of locations, parts, fixtures, sensors, signals and reals. The maximum changes are `by` along X, Y, Z
    [m], `turn` about the vertical [rad], `later` [s], and `value`. `whole`: values change only by whole numbers.
    `shuffle`: the feeders of its signals deliver their parts in another order.
    """

    names: tuple[str, ...]
    by: transform.Vector = (0.0, 0.0, 0.0)
    turn: float = 0.0
    later: float = 0.0
    value: float = 0.0
    whole: bool = False
    shuffle: bool = False

    @property
    def keys(self) -> frozenset[str]:
        return frozenset(name.lower() for name in self.names)


class Variant(Struct, frozen=True):
    """A variant: its seed and its groups."""

    seed: int
    groups: tuple[Group, ...]


class Change(NamedTuple):
    """The change of a group: a rigid motion in the world, a change of times [s], and a change of values."""

    T: transform.Transform
    later: float
    value: float


class Situation(Struct, frozen=True):
    """Everything that a variant can change: the cell, the timed changes of inputs, and the given values."""

    cell: Cell
    inputs: Inputs
    given: LoadedFile | None


def move(around: Situation, variant: Variant) -> Situation:
    """Return the situation after all changes of a variant."""
    draws = Random(variant.seed)
    for group in variant.groups:
        around = _change(around, group, [2.0 * draws.random() - 1.0 for _ in range(6)])
        if group.shuffle:
            signals = _signals(around.cell, group.keys)
            feeders = tuple(
                structs.replace(one, parts=tuple(sorted(one.parts, key=lambda _: draws.random())))
                if abs(one.when) in signals
                else one
                for one in around.cell.scene.feeders
            )
            scene = structs.replace(around.cell.scene, feeders=feeders)
            around = structs.replace(around, cell=structs.replace(around.cell, scene=scene))
    return around


def _change(around: Situation, group: Group, shares: list[float]) -> Situation:
    """Return the situation after the change of one group."""
    x, y, z, turn, later, value = shares
    shift = [1e-3 * _in_steps(1e3 * most * share, MM_STEP) for most, share in zip(group.by, (x, y, z), strict=True)]
    angle = radians(_in_steps(degrees(group.turn) * turn, DEG_STEP))
    pivot = next((place for name in group.names if (place := place_of(around, name)) is not None), (0.0, 0.0, 0.0))
    about = transform.compose(
        transform.translation(*pivot),
        transform.compose(transform.rotation_z(angle), transform.inverse(transform.translation(*pivot))),
    )
    change = Change(
        transform.compose(transform.translation(*shift), about) if angle else transform.translation(*shift),
        _in_steps(group.later * later, S_STEP),
        _in_steps(group.value * value, 1.0 if group.whole else VALUE_STEP),
    )
    signals = _signals(around.cell, group.keys) if change.later else ()
    inputs = (
        structs.replace(one, time=_later(one.time, change.later)) if one.signal in signals else one
        for one in around.inputs.left
    )
    return Situation(
        _changed_cell(around.cell, group.keys, change),
        Inputs.of(inputs) if signals else around.inputs,
        None if around.given is None else _changed_given(around.given, group.names, change),
    )


def _in_steps(value: float, step: float) -> float:
    return round(round(value / step) * step, 6) + 0.0


def place_of(around: Situation, name: str) -> transform.Vector | None:
    """Return the position of a named thing [m]; None if it has none."""
    scene, key = around.cell.scene, name.lower()
    poses = (
        *(part.T_world_part for part in scene.parts if part.name == key),
        *(value for value in values_named(around.given, name) if isinstance(value, transform.Transform)),
        *(fixture.T_world_fixture for fixture in scene.fixtures if fixture.name == key),
    )
    if poses:
        return transform.position(poses[0])
    match next((sensor.region for sensor in scene.sensors if sensor.name == key), None):
        case Zone(T_world_zone=T):
            return transform.position(T)
        case Beam(begin=place) | Proximity(place=place):
            return place
    return None


def items_named(given: LoadedFile | None, name: str) -> tuple[Item, ...]:
    """Return the given variables to which a name refers: one variable, or all elements of an array."""
    if given is None or (item := item_of_text(name)) is None:
        return ()
    known = given.variables.values()
    return (item,) if item in known else tuple(one for one in known if one[0] == item[0] and item[1] is None)


def values_named(given: LoadedFile | None, name: str) -> list[Value | None]:
    """Return the values of the given variables to which a name refers."""
    return [] if given is None else [given.variables.value(item) for item in items_named(given, name)]


def _changed_given(given: LoadedFile, names: tuple[str, ...], change: Change) -> LoadedFile:
    variables = Variables(given.variables.units)
    variables.take(given.variables)
    for item in dict.fromkeys(item for name in names for item in items_named(given, name)):
        value = variables.value(item)
        if isinstance(value, transform.Transform):
            variables.put_back(item, transform.compose(change.T, value))
        elif isinstance(value, float | int):
            variables.put_back(item, value + change.value)
    return structs.replace(given, variables=variables)


def _changed_cell(cell: Cell, names: frozenset[str], change: Change) -> Cell:
    scene, T, signals = cell.scene, change.T, _signals(cell, names)
    keys = frozenset(key_of(name) for name in names)
    scene = structs.replace(
        scene,
        parts=tuple(
            structs.replace(one, T_world_part=transform.compose(T, one.T_world_part)) if one.name in names else one
            for one in scene.parts
        ),
        fixtures=tuple(
            structs.replace(one, T_world_fixture=transform.compose(T, one.T_world_fixture))
            if one.name in names
            else one
            for one in scene.fixtures
        ),
        sensors=tuple(_moved_sensor(one, T) if one.name in names else one for one in scene.sensors),
        feeders=tuple(_changed_feeder(one, names, signals, change) for one in scene.feeders),
        sinks=tuple(
            structs.replace(one, after=_later(one.after, change.later)) if abs(one.when) in signals else one
            for one in scene.sinks
        ),
    )
    follows = tuple(
        structs.replace(
            one,
            after=_later(one.after, change.later) if one.sets is not None and abs(one.sets) in signals else one.after,
            rows=tuple(
                tuple(
                    cell_value + change.value if isinstance(cell_value, float) and key_of(name) in keys else cell_value
                    for name, cell_value in zip(one.variables, row, strict=True)
                )
                for row in one.rows
            ),
        )
        for one in cell.follows
    )
    return structs.replace(cell, scene=scene, follows=follows)


def _moved_sensor(sensor: Sensor, T: transform.Transform) -> Sensor:
    region = sensor.region
    if isinstance(region, Zone):
        return structs.replace(sensor, region=Zone(transform.compose(T, region.T_world_zone), region.size))
    if isinstance(region, Beam):
        ends = transform.moved_point(T, region.begin), transform.moved_point(T, region.end)
        return structs.replace(sensor, region=Beam(*ends, region.radius))
    place, way = transform.moved_point(T, region.place), transform.rotate(T, region.direction)
    return structs.replace(sensor, region=structs.replace(region, place=place, direction=way))


def _changed_feeder(feeder: Feeder, names: frozenset[str], signals: frozenset[int], change: Change) -> Feeder:
    """Return a feeder after the change of a group. If one of its parts is in the group, it delivers to the moved
    place; if its signal is in the group, it delivers later."""
    place = feeder.T_world_part
    if place is not None and names & frozenset(feeder.parts):
        feeder = structs.replace(feeder, T_world_part=transform.compose(change.T, place))
    if abs(feeder.when) in signals:
        feeder = structs.replace(feeder, after=_later(feeder.after, change.later))
    return feeder


def _later(time: float, seconds: float) -> float:
    return on_grid(max(time + seconds, 0.0))


def _signals(cell: Cell, names: frozenset[str]) -> frozenset[int]:
    """Return the signals that names refer to; a name may be a number."""
    known = {name: number for number, name in cell.names.items()}
    return frozenset(
        int(name) if name.isdecimal() else known[name] for name in names if name.isdecimal() or name in known
    )


# --- reading --------------------------------------------------------------------------------------------------------


def read_variants(text: ExerciseText, around: Situation) -> tuple[Variant, ...]:
    """Read each [[variant]]; record mistakes in `text`."""
    variants = list[Variant]()
    for entry in text.entries("variant", text.table.get("variant", []), ("seed", "group", *GROUP_KEYS)):
        seeds = _seeds(text, entry)
        given = entry.given.get("group", [])
        own = {key: value for key, value in entry.given.items() if key in GROUP_KEYS}
        rows = [own] if own or not given else []
        if not isinstance(given, list) or not all(isinstance(one, dict) for one in given):
            text.fault(entry, "group", "write [[variant.group]], and below it move = [...] and by = [...]")
            given = []
        groups = []
        for one in (*rows, *given):
            inner = CellEntry(f"{entry.name}", entry.lines, one)
            text.check_keys(inner, GROUP_KEYS)
            groups.append(_group(text, inner, around))
        for seed in seeds:
            if any(other.seed == seed for other in variants):
                text.fault(entry, "seed", f"{seed} is the seed of another variant: give each a seed of its own")
            variants.append(Variant(seed, tuple(groups)))
    return tuple(variants)


def _seeds(text: ExerciseText, entry: CellEntry) -> tuple[int, ...]:
    given = entry.given.get("seed")
    seeds = given if isinstance(given, list) else [given]
    if seeds and len(seeds) <= 100 and all(type(one) is int and 0 <= one <= 2**31 for one in seeds):
        return tuple(seeds)
    text.fault(entry, "seed", f"{text.prefix(given)}a whole number from 0, or a list of them such as [1, 2, 3]")
    return ()


def _group(text: ExerciseText, entry: CellEntry, around: Situation) -> Group:
    names = [str(one) if type(one) is int else one for one in text.list_of(entry, "move", 'names, such as ["box"]')]
    given, group = entry.given, Group(tuple(one for one in names if isinstance(one, str)))
    if len(group.names) < len(names):
        text.fault(entry, "move", 'each is a name in quotes, such as "box", or the number of a signal')
    placed = {name for name in group.names if place_of(around, name) is not None}
    timed = {name for name in group.names if _signals(around.cell, frozenset((name.lower(),)))}
    in_tables = {key_of(one) for rule in around.cell.follows for one in rule.variables}
    valued = {
        name
        for name in group.names
        if key_of(name) in in_tables or any(isinstance(one, float | int) for one in values_named(around.given, name))
    }
    for name in group.names:
        if name not in placed | timed | valued:
            what = f"{name[:40]!r} is nothing that can be moved"
            text.fault(entry, "move", f"{what}: a given location or real, a part, a fixture, a sensor or a signal")
    changes = {key for key in ("by", "turn", "later", "value", "shuffle") if key in given}
    if not changes:
        text.fault(entry, "by", "nothing changes: write by = [50, 50, 0], turn = 20, later = 0.5 or value = 3")
    if (changes & {"by", "turn"} and not placed) or ("later" in changes and not timed):
        text.fault(entry, "move", "by and turn move what has a place, later is for signals, value for reals")
    return structs.replace(
        group,  # reading these values in this order also reports their mistakes in this order
        by=text.place(entry, "by") if "by" in given else group.by,
        turn=radians(text.number(entry, "turn", 0.0, 180.0, "deg")) if "turn" in given else 0.0,
        shuffle="shuffle" in given and _shuffles(text, entry, _signals(around.cell, group.keys), around.cell),
        later=text.number(entry, "later", 0.0, LATEST, "s") if "later" in given else 0.0,
        value=text.number(entry, "value", 0.0, LIMIT) if "value" in given else 0.0,
        whole=type(given.get("value")) is int,
    )


def _shuffles(text: ExerciseText, entry: CellEntry, signals: frozenset[int], cell: Cell) -> bool:
    """Read whether the feeders of a group are shuffled. `signals`: the signals of the group."""
    shuffle = text.switch(entry, "shuffle")
    if not any(abs(one.when) in signals for one in cell.scene.feeders):
        text.fault(entry, "shuffle", "no feeder of the cell has one of these signals: name the signal in its when")
    return shuffle
