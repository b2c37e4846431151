"""What is heavy (the robot, the language, numpy) is made ready behind the first prompt, in a thread of its own."""

from __future__ import annotations

from collections.abc import Callable
from threading import Thread
from typing import Generic, TypeVar

V = TypeVar("V")


class Backstage(Generic[V]):
    """Makes one value in the background. `ready` never waits; `wait` does, and raises what the making raised."""

    def __init__(self, make: Callable[[], V], when_ready: Callable[[], None] = lambda: None) -> None:
        self._make, self._when_ready = make, when_ready
        self._thread: Thread | None = None
        self._value: V | None = None
        self._error: BaseException | None = None

    def begin(self) -> None:
        """Start, unless it has been started."""
        if self._thread is None:
            self._thread = Thread(target=self._work, name="backstage", daemon=True)
            self._thread.start()

    def _work(self) -> None:
        try:
            self._value = self._make()
        except BaseException as error:  # kept for whoever waits
            self._error = error
        self._when_ready()

    @property
    def ready(self) -> V | None:
        """The value, or None while there is none."""
        return self._value

    def wait(self) -> V:
        """The value, begun now if need be."""
        self.begin()
        assert self._thread is not None
        self._thread.join()
        if self._error is not None:
            raise self._error
        assert self._value is not None
        return self._value
