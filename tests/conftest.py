"""The fast run, unless `--hypothesis-profile=long` asks for the long one."""

from __future__ import annotations

import os
import signal

from hypothesis import settings

from tests import examples  # it registers the profiles  # noqa: F401
from tests.view3d.browser import browser, running_browser  # for all tests: one of each process  # noqa: F401

settings.load_profile("fast")
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)  # each of hundreds of processes would compile all of the product anew
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # run in the background of a script
    signal.signal(signal.SIGINT, signal.default_int_handler)  # processes that a test starts hear Ctrl-C
