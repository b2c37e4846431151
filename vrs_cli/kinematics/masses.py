"""What a robot's file says of its masses and drives: one table a link, in SI units; centres in a TOML file in mm."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

from vrs_cli.kinematics.data_reader import LENGTH, PLAIN, POSITIVE, DataReader, Quantity
from vrs_cli.kinematics.transform import Vector

Inertia = tuple[float, float, float, float, float, float]  # xx, yy, zz, xy, xz, yz

DRIVE_KEYS: Mapping[str, Quantity] = {
    "rotor": PLAIN,
    "gear": POSITIVE,
    "viscous": PLAIN,
    "coulomb": PLAIN,
    "max_torque": POSITIVE,
}


class LinkMasses(NamedTuple):
    """The mass of a link [kg], its centre [m] in the frame of the link, its inertia about the centre along the axes of
    that frame [kg m2]; and the drive of its joint: the inertia of the motor's rotor [kg m2], viscous [N m s/rad] and
    Coulomb [N m] friction, all at the motor, which turns `gear` times while the joint turns once; the greatest torque
    at the joint [N m]. Of a joint that slides: forces, and turns of the motor [rad] a metre. None: nobody says it.
    """

    mass: float | None = None
    centre: Vector | None = None
    inertia: Inertia | None = None
    rotor: float | None = None
    gear: float | None = None
    viscous: float | None = None
    coulomb: float | None = None
    max_torque: float | None = None


def to_tables(masses: Iterable[LinkMasses]) -> list[dict[str, Any]]:
    """Return one table a link, in metres."""
    rows = (one._asdict().items() for one in masses)
    return [{key: list(x) if isinstance(x, tuple) else x for key, x in row if x is not None} for row in rows]


class MassReader(DataReader):
    """Makes masses of tables."""

    def masses(self, data: object, joints: int) -> tuple[LinkMasses, ...]:
        """Return those of all links. Raises FileDamaged."""
        if not isinstance(data, list | tuple) or len(data) != joints:
            found = f"there are {len(data)}" if isinstance(data, list | tuple) else "is not a list of tables"
            raise self.wrong("masses", found, f"write one [[masses]] table for each of the {joints} links")
        return tuple(self.link(table, f"masses {i}") for i, table in enumerate(data, 1))

    def link(self, data: object, key: str) -> LinkMasses:
        table = self.table(data, key, (), LinkMasses._fields)
        found: dict[str, Any] = {
            name: self.number(table[name], f"{key}: {name}", quantity)
            for name, quantity in {"mass": PLAIN, **DRIVE_KEYS}.items()
            if name in table
        }
        if below := [name for name, x in found.items() if x < 0.0]:
            raise self.wrong(f"{key}: {below[0]}", f"{found[below[0]]:g} is below zero", "give it without a sign")
        if "centre" in table:
            right = f"give [x, y, z]{self.in_unit(LENGTH)}, in the frame of the link"
            found["centre"] = self.listed(table["centre"], f"{key}: centre", [LENGTH] * 3, right)
        if "inertia" in table:
            found["inertia"] = self.inertia(table["inertia"], f"{key}: inertia")
        return LinkMasses(**found)

    def inertia(self, data: object, key: str) -> Inertia:
        right = "give [xx, yy, zz] or [xx, yy, zz, xy, xz, yz] about the centre of mass, in kg m2"
        short = isinstance(data, list | tuple) and len(data) == 3
        xx, yy, zz, *other = self.listed(data, key, [PLAIN] * (3 if short else 6), right)
        if min(xx, yy, zz) < 0.0:
            raise self.wrong(key, "a moment of inertia is below zero", right)
        xy, xz, yz = other or (0.0, 0.0, 0.0)
        return xx, yy, zz, xy, xz, yz
