"""The fast run, unless `--hypothesis-profile=long` asks for the long one."""

from __future__ import annotations

import faulthandler
import gc
import os
import signal
import sys
import time
from math import inf
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import settings

from tests import examples  # it registers the profiles  # noqa: F401
from tests.live import mark_live
from vrs_cli.__main__ import COLLECT_AFTER

if TYPE_CHECKING:
    from xdist.scheduler import LoadScopeScheduling
    from xdist.workermanage import WorkerController

WITH_BROWSER = ("tests/api/test_answers.py", "tests/render/test_page_export.py", "tests/render/test_pictures.py")
FIRST = ("browser", "tests/docs/test_examples.py")  # the scopes that take longest: begun last, they would run alone
HANGS, ARMS = 600.0, 60.0  # [s] until a test that hangs ends the process, and between two starts of that watch
settings.load_profile("fast")
gc.disable()  # until all tests are collected: they stay
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)  # each of hundreds of processes would compile all of the product anew
sys.dont_write_bytecode = False  # pytest would rewrite the assertions of all tests anew in each run: 5 s of each worker
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # run in the background of a script
    signal.signal(signal.SIGINT, signal.default_int_handler)  # processes that a test starts hear Ctrl-C


class Watch:
    """Ends the process of a test that hangs, and shows where all its threads are. Pytest's own `faulthandler_timeout`
    starts and ends a thread for each test, which takes 8 ms on a busy machine; this one does so once a minute.
    """

    def __init__(self) -> None:
        assert sys.__stderr__ is not None
        self._file, self._armed = os.dup(sys.__stderr__.fileno()), -inf

    def pytest_runtest_logstart(self) -> None:
        if time.monotonic() > self._armed + ARMS:
            self._armed = time.monotonic()
            faulthandler.dump_traceback_later(HANGS + ARMS, exit=True, file=self._file)

    def pytest_enter_pdb(self) -> None:
        faulthandler.cancel_dump_traceback_later()

    def pytest_unconfigure(self) -> None:
        faulthandler.cancel_dump_traceback_later()


def pytest_configure(config: pytest.Config) -> None:
    if config.getoption("dist", "no") == "no":  # where tests run, not in the process that gives them out
        config.pluginmanager.register(Watch())


@pytest.hookimpl(tryfirst=True)  # before `-m live` chooses
def pytest_collection_modifyitems(items: list[pytest.Function]) -> None:
    mark_live(items)


@pytest.hookimpl(trylast=True)
def pytest_collection_finish() -> None:
    """Thousands of tests are no garbage: no collection looks at them again."""
    gc.freeze()
    gc.set_threshold(COLLECT_AFTER)  # as `vrs` does
    gc.enable()


@pytest.hookimpl(trylast=True)
def pytest_runtest_teardown(item: pytest.Item, nextitem: pytest.Item | None) -> None:
    """What a file of tests leaves in caches is no garbage either: a collection in later tests would take a second."""
    if nextitem is None or nextitem.path != item.path:
        gc.collect()
        gc.freeze()


@pytest.hookimpl(optionalhook=True)  # of pytest-xdist
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> LoadScopeScheduling:
    """Give each file of tests to one worker, and all tests with a browser to one: browsers draw one at a time."""
    from xdist.scheduler import LoadScopeScheduling

    class OneWorkerPerFile(LoadScopeScheduling):
        def _split_scope(self, nodeid: str) -> str:
            file = nodeid.split("::")[0]
            return "browser" if file.startswith("tests/page/") or file in WITH_BROWSER else file

        def _assign_work_unit(self, node: WorkerController) -> None:
            for scope in FIRST:
                if scope in self.workqueue:
                    self.workqueue.move_to_end(scope, last=False)
                    break
            super()._assign_work_unit(node)

    return OneWorkerPerFile(config, log)
