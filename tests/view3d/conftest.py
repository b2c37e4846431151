"""The view is an extra: where viser is not installed, its tests are left out."""

from importlib.util import find_spec

collect_ignore_glob = [] if find_spec("viser") else ["test_*.py"]
