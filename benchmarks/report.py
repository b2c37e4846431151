"""A table of our figures beside those of peers."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from rich.console import Console
from rich.table import Table


@dataclass(frozen=True)
class Figure:
    """One kind of work [us]. `bar` is what we want of it, in words; `peers` by their titles."""

    work: str
    ours: float
    bar: str = ""
    peers: Mapping[str, float] = field(default_factory=dict)


def show(title: str, figures: Iterable[Figure], notes: Iterable[str] = ()) -> None:
    """Ours, what we want, and every peer with the ratio ours / theirs."""
    console = Console(width=120)
    table = Table("work", "ours, us", "bar", "peers, us (ours / theirs)", title=title)
    for figure in figures:
        beside = [f"{name} {theirs:.3g} ({figure.ours / theirs:.2f})" for name, theirs in figure.peers.items()]
        table.add_row(figure.work, f"{figure.ours:.3g}", figure.bar, ", ".join(beside))
    console.print(table)
    for note in notes:
        console.print(note)
