"""Bytes that many share, through real sockets to a client of `websockets` as it is."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence

import pytest
from websockets.asyncio.client import connect
from websockets.asyncio.server import Server, ServerConnection, serve
from websockets.extensions.permessage_deflate import ClientPerMessageDeflateFactory

from vrs_cli.net.server import SharedDeflate, SocketSink
from vrs_cli.net.stream import DeflateContext, Packet

TEXTS = [b"joint %d stands at some degrees; " % number * 30 for number in range(4)]


def heard(texts: Sequence[bytes], offer: ClientPerMessageDeflateFactory | None) -> tuple[list[object], bool]:
    """What a client gets that makes this offer, with something private between two messages for all; and whether it
    was deflated."""
    context, deflated = DeflateContext(), []

    async def tell(connection: ServerConnection) -> None:
        sink = SocketSink(connection)
        deflated.append(sink.deflates)
        assert await connection.recv() == "hello " * 100
        for number, text in enumerate(texts):
            packet = Packet(text, text=number % 2 == 0)
            sink.send(context.deflate(packet) if sink.deflates else packet)
            await connection.send(f"private {number} " * 50)
            assert sink.waiting == 0

    async def hear() -> list[object]:
        async with serve(tell, "127.0.0.1", 0, extensions=[SharedDeflate()], compression=None) as server:
            extensions = None if offer is None else [offer]
            async with connect(url(server), extensions=extensions, compression=None) as client:
                await client.send("hello " * 100)
                return [message async for message in client]

    return asyncio.run(hear()), deflated == [True]


@pytest.mark.parametrize(
    ("offer", "deflates"),
    [
        (ClientPerMessageDeflateFactory(), True),
        (ClientPerMessageDeflateFactory(client_max_window_bits=10), True),
        (ClientPerMessageDeflateFactory(server_max_window_bits=10), False),
        (ClientPerMessageDeflateFactory(server_no_context_takeover=True), False),
        (None, False),
    ],
)
def test_any_client_hears_what_is_meant_for_all_and_what_is_private(
    offer: ClientPerMessageDeflateFactory | None, deflates: bool
) -> None:
    messages, deflated = heard(TEXTS, offer)
    assert deflated is deflates
    assert messages[0::2] == [text.decode() if number % 2 == 0 else text for number, text in enumerate(TEXTS)]
    assert messages[1::2] == [f"private {number} " * 50 for number in range(4)]


def test_nothing_is_sent_to_who_has_gone() -> None:
    async def leave() -> int:
        done: asyncio.Future[int] = asyncio.get_running_loop().create_future()

        async def tell(connection: ServerConnection) -> None:
            sink = SocketSink(connection)
            await connection.close()
            sink.send(Packet(b"too late", text=True))
            done.set_result(sink.waiting)

        async with serve(tell, "127.0.0.1", 0) as server, connect(url(server)):
            return await done

    assert asyncio.run(leave()) == 0


def url(server: Server) -> str:
    return f"ws://127.0.0.1:{server.sockets[0].getsockname()[1]}"
