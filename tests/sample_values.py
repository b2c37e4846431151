"""Arbitrary values of a type by its annotations, for hypothesis."""

from __future__ import annotations

import types
from collections.abc import Mapping
from dataclasses import is_dataclass
from enum import Enum
from functools import cache
from typing import Annotated, Any, TypeVar, Union, get_args, get_origin, get_type_hints

import msgspec
from hypothesis import strategies as st

from tests.files.trajectories import deltas, motions, segments, transforms
from vrs_cli.kinematics.joints import ALL, Configuration
from vrs_cli.kinematics.transform import Transform
from vrs_cli.trajectory.segment import Segment
from vrs_cli.trajectory.timeline import TimelineDelta
from vrs_cli.values.commands import Motion
from vrs_cli.wire.records import DeltaRecord, Motions, SegmentRecord, delta_record, segment_records

R = TypeVar("R", DeltaRecord, SegmentRecord)


def with_lists(record: R) -> R:
    """The record with lists where decoding makes lists."""
    return msgspec.convert(msgspec.to_builtins(record), type(record))


GIVEN: Mapping[Any, st.SearchStrategy[Any]] = {
    TimelineDelta: deltas,
    Segment: segments,
    Motion: motions,
    Transform: transforms,
    Configuration: st.sampled_from(ALL),
    float: st.floats(allow_nan=False, allow_infinity=False),
    int: st.integers(0, 2**53),
    bool: st.booleans(),
    bytes: st.binary(max_size=5),
    DeltaRecord: deltas.map(lambda delta: with_lists(delta_record(delta, Motions()))),
    SegmentRecord: segments.map(lambda segment: with_lists(segment_records([segment], Motions(), None)[0])),
    dict[str, Any]: st.dictionaries(st.text(max_size=5), st.integers(-9, 9) | st.text(max_size=5), max_size=2),
    str: st.text(max_size=5),
    type(None): st.none(),
    msgspec.UnsetType: st.just(msgspec.UNSET),
}


@cache
def values(kind: Any) -> st.SearchStrategy[Any]:
    """Values of a type, by its annotations."""
    if kind in GIVEN:
        return GIVEN[kind]
    origin, arguments = get_origin(kind), get_args(kind)
    if origin is Annotated:
        return _bounded(*arguments)
    if origin in (Union, types.UnionType):
        return st.one_of(*map(values, arguments))
    if origin is tuple and arguments[-1] is Ellipsis:
        return st.lists(values(arguments[0]), max_size=2).map(tuple)
    if origin is tuple:
        return st.tuples(*map(values, arguments))
    if origin is Mapping:
        return st.dictionaries(values(arguments[0]), values(arguments[1]), max_size=2)
    if isinstance(kind, type) and issubclass(kind, Enum):
        return st.sampled_from(kind)
    return _built(origin or kind, dict(zip(getattr(origin, "__parameters__", ()), arguments, strict=False)))


def _bounded(kind: Any, meta: msgspec.Meta) -> st.SearchStrategy[Any]:
    """Numbers within their bounds, and lists of a length that is allowed; texts are short anyway."""
    if kind in (int, float):
        draw = st.integers if kind is int else st.floats
        return draw(meta.ge if meta.gt is None else meta.gt or 1e-300, meta.le)  # type: ignore[operator]
    if get_origin(kind) is tuple:
        size = meta.min_length or 0
        return st.lists(values(get_args(kind)[0]), min_size=size, max_size=size + 1).map(tuple)
    return values(kind)


def _built(kind: type, given_types: Mapping[TypeVar, Any]) -> st.SearchStrategy[Any]:
    assert issubclass(kind, msgspec.Struct | tuple) or is_dataclass(kind), kind
    hints = get_type_hints(kind, include_extras=True)
    names = [name for name in hints if not name.startswith("_")]
    return st.builds(kind, **{name: values(_put(hints[name], given_types)) for name in names})


def _put(kind: Any, given_types: Mapping[TypeVar, Any]) -> Any:
    """A type with the types that stand for its variables."""
    if isinstance(kind, TypeVar):
        return given_types[kind]
    if get_origin(kind) in (Union, types.UnionType):
        return Union[tuple(_put(one, given_types) for one in get_args(kind))]  # noqa: UP007 (made at run time)
    return kind
