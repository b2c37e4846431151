"""Snapshots as records, and the way between the two."""

from __future__ import annotations

from typing import Annotated

from msgspec import UNSET, Meta, Struct, UnsetType

from vrs_cli.engine.feed import Snapshot
from vrs_cli.engine.settings import Settings
from vrs_cli.values.tagged import RobotAct, Spoken
from vrs_cli.values.world import WorldState
from vrs_cli.wire.records import (
    Count,
    EventRecord,
    Form,
    Motions,
    Number,
    Pieces,
    SegmentRecord,
    event_records,
    events_of,
    no_pieces,
    segment_records,
    segments_of,
)


class SnapshotRecord(Struct, frozen=True):
    version: Count
    segments: Annotated[tuple[SegmentRecord, ...], Meta(min_length=1)]
    settings: Settings
    first: Count = 0
    events: tuple[EventRecord, ...] | UnsetType = UNSET  # so that a snapshot without events has the bytes it had
    values: tuple[EventRecord, ...] | UnsetType = UNSET
    first_event: Count | UnsetType = UNSET
    world: WorldState | UnsetType = UNSET


def snapshot_record(snapshot: Snapshot, pieces: Pieces = no_pieces) -> SnapshotRecord:
    segments = segment_records(snapshot.segments, Motions(), None, pieces)
    return SnapshotRecord(
        snapshot.version,
        segments,
        snapshot.settings,
        snapshot.first,
        event_records(snapshot.events) or UNSET,
        event_records(snapshot.values) or UNSET,
        snapshot.first_event or UNSET,
        snapshot.world or UNSET,
    )


def snapshot_of(record: SnapshotRecord, form: Form) -> Snapshot:
    """Raises RecordError."""
    segments = segments_of(record.segments, Motions(), None, form)
    events, values = (() if one is UNSET else events_of(one) for one in (record.events, record.values))
    first_event = 0 if record.first_event is UNSET else record.first_event
    world = None if record.world is UNSET else record.world
    return Snapshot(record.version, segments, record.settings, record.first, events, values, first_event, world)


class BranchShown(Spoken, frozen=True):
    snapshot: SnapshotRecord


class ShowBranch(RobotAct[BranchShown], frozen=True):
    """The timeline of a branch; `joints`: as in `subscribe`. Raises UsageError where there is none of the name, and
    IllegalValue.
    """

    name: str
    joints: Number | None = None
