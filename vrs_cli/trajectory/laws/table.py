"""`LAWS[profile]`: the motion law of every profile."""

from __future__ import annotations

from importlib import import_module

from vrs_cli.kinematics.profile import Profile
from vrs_cli.trajectory.laws.law import Law


class _Laws(dict[Profile, Law]):
    def __missing__(self, profile: Profile) -> Law:
        """Read the file that is named after the profile, which most programs do for one profile alone."""
        law: Law = import_module(f"{__package__}.{profile.value}").LAW
        return self.setdefault(profile, law)


LAWS = _Laws()
