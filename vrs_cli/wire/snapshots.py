"""Snapshots as records, and the way between the two."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta, Struct

from vrs_cli.engine.settings import Settings
from vrs_cli.engine.snapshot import Snapshot
from vrs_cli.values.tagged import RobotAct, Spoken
from vrs_cli.wire.records import Count, Form, Motions, SegmentRecord, segment_records, segments_of


class SnapshotRecord(Struct, frozen=True):
    version: Count
    segments: Annotated[tuple[SegmentRecord, ...], Meta(min_length=1)]
    settings: Settings
    first: Count = 0


def snapshot_record(snapshot: Snapshot) -> SnapshotRecord:
    segments = segment_records(snapshot.segments, Motions(), None)
    return SnapshotRecord(snapshot.version, segments, snapshot.settings, snapshot.first)


def snapshot_of(record: SnapshotRecord, form: Form) -> Snapshot:
    """Raises RecordError."""
    segments = segments_of(record.segments, Motions(), None, form)
    return Snapshot(record.version, segments, record.settings, record.first)


class BranchShown(Spoken, frozen=True):
    snapshot: SnapshotRecord


class ShowBranch(RobotAct[BranchShown], frozen=True):
    """The timeline of a branch. Raises UsageError where there is none of the name."""

    name: str
