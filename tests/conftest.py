"""The fast run, unless `--hypothesis-profile=long` asks for the long one."""

from __future__ import annotations

from hypothesis import settings

from tests import examples  # it registers the profiles  # noqa: F401

settings.load_profile("fast")
