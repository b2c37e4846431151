"""What a broadcast needs of the sockets of `websockets`: to send bytes that many share, deflated or not.

A message that one connection alone gets goes through `connection.send`, and is not deflated: so it does not come
between those that refer to each other (RFC 7692, 7.2.3.2).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from websockets.asyncio.server import ServerConnection
from websockets.exceptions import NegotiationError
from websockets.extensions import Extension
from websockets.extensions.permessage_deflate import PerMessageDeflate, ServerPerMessageDeflateFactory
from websockets.frames import OP_BINARY, OP_TEXT, Frame
from websockets.protocol import OPEN
from websockets.typing import ExtensionParameter

from vrs_cli.net.stream import WINDOW_BITS, Packet


class SocketSink:
    """A connection of a server, as a `Sink`."""

    def __init__(self, connection: ServerConnection) -> None:
        self._protocol, self._transport = connection.protocol, connection.transport
        self.deflates = any(isinstance(extension, Inflating) for extension in connection.protocol.extensions)

    @property
    def waiting(self) -> int:
        return self._transport.get_write_buffer_size()

    def send(self, *packets: Packet) -> None:
        """A frame is made once for all: `websockets.broadcast` makes it anew for each connection."""
        if self._protocol.state is OPEN and not self._transport.is_closing():
            for packet in packets:
                if not packet.frame:  # RFC 6455, 5.2
                    frame = Frame(OP_TEXT if packet.text else OP_BINARY, packet.data)
                    packet.frame = frame.serialize(mask=False, extensions=[] if packet.place is None else [_Deflated()])
            self._transport.write(b"".join([packet.frame for packet in packets]))


class _Deflated(Extension):
    """Marks what is deflated already (RFC 7692, 6)."""

    def encode(self, frame: Frame) -> Frame:
        return replace(frame, rsv1=True)


class Inflating(PerMessageDeflate):
    """Inflates what comes, and sends what it is given as it is."""

    def encode(self, frame: Frame) -> Frame:
        return frame


class SharedDeflate(ServerPerMessageDeflateFactory):
    """Agrees on what is deflated once for all: whole windows, and contexts that go on from message to message. With a
    client that wants less nothing is deflated.
    """

    def __init__(self) -> None:
        super().__init__(client_no_context_takeover=True)  # nothing is to be kept for a client that says little

    def process_request_params(
        self, params: Sequence[ExtensionParameter], accepted_extensions: Sequence[Extension]
    ) -> tuple[list[ExtensionParameter], PerMessageDeflate]:
        answer, agreed = super().process_request_params(params, accepted_extensions)
        if agreed.local_no_context_takeover or agreed.local_max_window_bits < WINDOW_BITS:
            raise NegotiationError("what is sent to all is deflated with whole windows")
        return answer, Inflating(
            agreed.remote_no_context_takeover,
            True,  # no memory is held for deflating
            agreed.remote_max_window_bits,
            WINDOW_BITS,
        )
