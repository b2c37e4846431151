"""The fast run, unless `--hypothesis-profile=long` asks for the long one."""

from __future__ import annotations

import os

from hypothesis import settings

from tests import examples  # it registers the profiles  # noqa: F401

settings.load_profile("fast")
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)  # each of hundreds of processes would compile all of the product anew
