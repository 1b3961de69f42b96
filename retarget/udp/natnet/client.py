"""Commands to a NatNet server: recording, take names, playback; one question, one answer.

It has a socket of its own beside the stream's. Answers do not say what they answer, so whatever still waits is thrown
away before each question, and only the server's own address counts.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, TypeVar

from retarget.errors import ConnectionFailedError, InputError, ProtocolError
from retarget.udp.natnet.codec import decode, encode
from retarget.udp.natnet.messages import (
    Connect,
    Disconnect,
    Discovery,
    EchoRequest,
    EchoResponse,
    Request,
    RequestModelDef,
    Response,
    ServerInfo,
    UnrecognizedRequest,
)
from retarget.udp.natnet.models import ModelDef
from retarget.udp.natnet.url import COMMAND_PORT
from retarget.udp.natnet.version import Bitstream, parse_bitstream
from retarget.udp.sockets import local_address_towards, open_udp, resolve, wait_readable

if TYPE_CHECKING:
    from retarget.udp.natnet.messages import Message

Answer = TypeVar("Answer", ServerInfo, ModelDef, EchoResponse)

_TRIES = 3


class NatNetClient:
    """Talks to the command port of one server; use it as a context manager.

    Every method waits at most `patience_s` [s] and raises `ConnectionFailedError` when no answer comes, `InputError`
    when the server does not know the command or refuses it.
    """

    def __init__(
        self, host: str, port: int = COMMAND_PORT, *, local: str | None = None, patience_s: float = 1.5
    ) -> None:
        address = resolve(host)
        self._server = (address, port)
        self._patience_s = patience_s
        self._socket = open_udp(local if local is not None else local_address_towards(address))

    def __enter__(self) -> NatNetClient:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Give the port back."""
        self._socket.close()

    def server_info(self) -> ServerInfo:
        """What the server says of itself. Does not make it send frames here, unless it only answers to CONNECT."""
        try:
            return self._answer(Discovery(), ServerInfo)
        except ConnectionFailedError:
            info = self._answer(Connect(), ServerInfo)
            self._socket.send(encode(Disconnect()), self._server)
            return info

    def model_definitions(self) -> ModelDef:
        """Names of all markers and rigid bodies."""
        return self._answer(RequestModelDef(), ModelDef, self.server_info().sender.bitstream)

    def round_trip_s(self) -> float:
        """Time from an echo request to its answer [s]."""
        sent_s = time.monotonic()
        self._answer(EchoRequest(int(sent_s * 1e9)), EchoResponse)
        return time.monotonic() - sent_s

    def frame_rate_hz(self) -> float:
        """Frames per second."""
        response = self.ask("FrameRate")
        if response.float32 is None:
            raise ProtocolError(f"{self._name()} answers FrameRate with {len(response.octets)} bytes, not a number.")
        return response.float32

    def bitstream(self) -> Bitstream:
        """The bitstream that the server sends, from 4.0."""
        return parse_bitstream(self.ask("Bitstream").text.rpartition(",")[2])

    def start_recording(self) -> None:
        """Record a take."""
        self.do("StartRecording")

    def stop_recording(self) -> None:
        """End the take."""
        self.do("StopRecording")

    def set_record_take_name(self, name: str) -> None:
        """Name the take that is recorded next."""
        self.do("SetRecordTakeName", name)

    def set_playback_take_name(self, name: str) -> None:
        """Choose the take that is played."""
        self.do("SetPlaybackTakeName", name)

    def play(self) -> None:
        """Play the take."""
        self.do("TimelinePlay")

    def pause(self) -> None:
        """Stop where it is."""
        self.do("TimelineStop")

    def jump(self, frame: int) -> None:
        """Go to a frame of the take, counted from 0."""
        self.do("SetPlaybackCurrentFrame", frame)

    def play_range(self, first: int, last: int) -> None:
        """Play only from frame `first` to `last`, counted from 0."""
        self.do("SetPlaybackStartFrame", first)
        self.do("SetPlaybackStopFrame", last)

    def do(self, command: str, *parameters: object) -> None:
        """Send a command that is answered with a status."""
        status = self.ask(command, *parameters).int32
        if status != 0:
            raise InputError(f"{self._name()} refused {command} (status {status}).")

    def ask(self, command: str, *parameters: object) -> Response:
        """Send any request and return its answer."""
        answer = self._exchange(Request.of(command, *parameters), (Response, UnrecognizedRequest), None)
        if not isinstance(answer, Response):
            raise InputError(f"{self._name()} does not know the command {command}.")
        return answer

    def _answer(self, question: Message, kind: type[Answer], version: Bitstream | None = None) -> Answer:
        answer = self._exchange(question, (kind,), version)
        if not isinstance(answer, kind):
            raise ProtocolError(f"{self._name()} answers {type(question).__name__} with {type(answer).__name__}.")
        return answer

    def _exchange(self, question: Message, kinds: tuple[type, ...], version: Bitstream | None) -> Message:
        """Ask up to three times, and wait for an answer of one of `kinds`."""
        payload = encode(question)
        while self._socket.receive() is not None:
            pass
        for _ in range(_TRIES):
            self._socket.send(payload, self._server)
            answer = self._wait_for(kinds, version, self._patience_s / _TRIES)
            if answer is not None:
                return answer
        raise ConnectionFailedError(
            f"{self._name()} does not answer {_described(question)} within {self._patience_s:g} s. Check the address, "
            "the command port, and that streaming is switched on."
        )

    def _wait_for(self, kinds: tuple[type, ...], version: Bitstream | None, wait_s: float) -> Message | None:
        deadline_s = time.monotonic() + wait_s
        while (left_s := deadline_s - time.monotonic()) > 0:
            wait_readable([self._socket], left_s)
            while (received := self._socket.receive()) is not None:
                if received.peer != self._server:
                    continue
                try:
                    message = decode(received.payload, version)
                except ProtocolError:
                    continue
                if isinstance(message, kinds):
                    return message
        return None

    def _name(self) -> str:
        return f"{self._server[0]}:{self._server[1]}"


def _described(question: Message) -> str:
    return question.command if isinstance(question, Request) else type(question).__name__
