"""A cable to a server, which can be pulled: a proxy between real sockets, in a thread of its own."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from threading import Event, Thread
from urllib.parse import urlsplit

from tests.live import PATIENCE

CHUNK = 65536


class Cable:
    """`url`: what leads over it. `carried`: connections that it carried; `pulled`: how often it was pulled."""

    def __init__(self, target: str) -> None:
        parts = urlsplit(target)
        self._target, self._path = (str(parts.hostname), parts.port or 0), parts.path
        self._loop, self._listening, self._flows = asyncio.new_event_loop(), Event(), asyncio.Event()
        self._flows.set()
        self._writers: set[asyncio.StreamWriter] = set()
        self.carried, self.pulled, self.url = 0, 0, ""
        self._shut = False
        self._thread = Thread(target=self._run, daemon=True)
        self._thread.start()
        assert self._listening.wait(PATIENCE)

    def pull(self) -> None:
        """Nothing is said, and what is on its way is lost."""
        self.pulled += 1
        asyncio.run_coroutine_threadsafe(self._pull(), self._loop).result(PATIENCE)

    def freeze(self) -> None:
        """Nothing comes through any more, and nobody is told."""
        self._loop.call_soon_threadsafe(self._flows.clear)

    def shut(self) -> None:
        """As `pull`, and who comes then is turned away until `open`."""
        self._shut = True
        self.pull()

    def open(self) -> None:
        self._shut = False

    def flow(self) -> None:
        """What was frozen comes through now, late."""
        self._loop.call_soon_threadsafe(self._flows.set)

    def close(self) -> None:
        self.pull()
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join(PATIENCE)

    async def _pull(self) -> None:
        self._flows.set()
        for writer in tuple(self._writers):
            writer.transport.abort()
        self._writers.clear()

    def _run(self) -> None:
        asyncio.set_event_loop(self._loop)
        server = self._loop.run_until_complete(asyncio.start_server(self._carry, "127.0.0.1", 0))
        self.url = f"ws://127.0.0.1:{server.sockets[0].getsockname()[1]}{self._path}"
        self._listening.set()
        self._loop.run_forever()
        self._loop.run_until_complete(self._let_go())
        self._loop.close()

    async def _let_go(self) -> None:
        """Nobody is to find what is still on its way when the loop is gone."""
        waiting = asyncio.all_tasks() - {asyncio.current_task()}
        for task in waiting:
            task.cancel()
        await asyncio.gather(*waiting, return_exceptions=True)

    async def _carry(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        if self._shut:
            writer.transport.abort()
            return
        with suppress(OSError):
            there_reader, there_writer = await asyncio.open_connection(*self._target)
            self.carried += 1
            self._writers |= {writer, there_writer}
            await asyncio.gather(self._copy(reader, there_writer), self._copy(there_reader, writer))

    async def _copy(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        with suppress(OSError):
            while data := await reader.read(CHUNK):
                await self._flows.wait()
                writer.write(data)
                await writer.drain()
        writer.close()


@contextmanager
def cable(target: str) -> Iterator[Cable]:
    it = Cable(target)
    try:
        yield it
    finally:
        it.close()
