"""OpenVHead's message between its camera client and its Unity server, and how to find messages in a stream.

One text a picture: eleven numbers joined by ``:``, in the order of `OpenVHeadMessage`, and nothing behind it; so the
last number of one message runs into the first of the next wherever TCP puts them together. `OpenVHeadStream` counts
fields. Where two numbers touch, it cuts where both are as Python writes numbers; should several cuts do, at an edge of
what TCP delivered, before a minus sign, or where the head moves least. A newline behind each message, our extension,
leaves no doubt. Source: OpenVHead (T. Wu, MIT), commit 4c84abcc.
"""

from __future__ import annotations

import re
from typing import NamedTuple

from retarget.errors import ProtocolError

FIELDS = 11
PORT = 1755
MAX_FIELD_BYTES = 32
MAX_MESSAGE_BYTES = (FIELDS + 1) * (MAX_FIELD_BYTES + 1)
"""And the first field of the next."""
END = "<EOF>"
"""With which a client may say that it ends."""

_NUMBER = re.compile(r"-?(?:\d{1,310}(?:\.\d{1,30})?(?:e[-+]?\d{1,3})?|inf|nan)")


class OpenVHeadMessage(NamedTuple):
    """Eleven numbers, in the order of the wire."""

    tx: float
    """Translation in the unit of its six-point model, OpenCV's axes."""
    ty: float
    tz: float
    w: float
    """Quaternion, rounded to four decimals."""
    x: float
    y: float
    z: float
    left_eye: float
    """Openness of the eye on the picture's left."""
    right_eye: float
    mouth_width: float
    mouth_length: float


def encode(message: OpenVHeadMessage) -> bytes:
    """The text, as Python's `str` writes numbers, without any end."""
    return ":".join(str(float(value)) for value in message).encode()


def decode(payload: bytes) -> OpenVHeadMessage:
    """One whole message; ProtocolError where it is none."""
    try:
        texts = payload.decode("ascii").strip("\r\n").split(":")
    except UnicodeDecodeError as error:
        raise ProtocolError("A message of OpenVHead is ASCII text.") from error
    if len(texts) != FIELDS:
        raise ProtocolError(f"A message of OpenVHead has {FIELDS} fields, not {len(texts)}.")
    return OpenVHeadMessage(*(_number(text) for text in texts))


class OpenVHeadStream:
    """Feed it what TCP delivers; it answers with whole messages.

    The last message of what came so far waits in it, as nobody can tell whether its last number is complete, until more
    comes or `flush` says that nothing more is on the way.
    """

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Forget what waits, as after a new connection or an error."""
        self._text = ""
        self._edges: list[int] = []
        self._last: OpenVHeadMessage | None = None
        self.ended = False
        """Whether the client said that it ends."""

    @property
    def waits(self) -> bool:
        """Whether something waits for `flush`."""
        return bool(self._text)

    def feed(self, received: bytes) -> list[OpenVHeadMessage]:
        """The messages that are surely complete; ProtocolError, with all that waits forgotten, where none can be."""
        try:
            text = received.decode("ascii")
        except UnicodeDecodeError as error:
            self.reset()
            raise ProtocolError("OpenVHead sends ASCII text.") from error
        text, end, _ = text.partition(END)
        self._edges.append(len(self._text))
        self._text += text
        self.ended = self.ended or bool(end)
        try:
            return self._complete()
        except ProtocolError:
            self.reset()
            raise

    def flush(self) -> list[OpenVHeadMessage]:
        """What waits, if it is a whole message; for when the line has been silent, or is closed."""
        if self._text.count(":") != FIELDS - 1:
            return []
        text, self._text, self._edges = self._text, "", []
        try:
            return [self._take(text)]
        except ProtocolError:
            self._last = None
            raise

    def _complete(self) -> list[OpenVHeadMessage]:
        messages = []
        while (cut := self._cut()) is not None:
            text, behind = self._text[:cut], self._text[cut:]
            self._text = behind.lstrip("\r\n")
            shift = cut + len(behind) - len(self._text)
            self._edges = [edge - shift for edge in self._edges if edge >= shift]
            if text:
                messages.append(self._take(text))
        if len(self._text) > MAX_MESSAGE_BYTES:
            raise ProtocolError("What comes is no message of OpenVHead: it has no end.")
        return messages

    def _cut(self) -> int | None:
        """Where the first message ends, None while that is not sure."""
        head = self._text[: MAX_MESSAGE_BYTES + 1]
        newline = re.search("[\r\n]", head)
        colons = [found.start() for found in re.finditer(":", head)]
        if newline and (len(colons) < FIELDS or newline.start() < colons[FIELDS - 1]):
            return newline.start()
        if len(colons) < FIELDS:
            return None
        start, end = colons[FIELDS - 2] + 1, colons[FIELDS - 1]
        return start + self._split(self._text[start:end], start)

    def _split(self, touching: str, start: int) -> int:
        """Where in `touching`, which begins at `start`, one number ends and the next begins."""
        cuts = [i for i in range(1, len(touching)) if _is_canonical(touching[:i]) and _is_canonical(touching[i:])]
        if not cuts:
            raise ProtocolError(f"{touching[:60]!r} is not the last number of a message and the first of the next.")
        at_edge = [cut for cut in cuts if start + cut in self._edges]
        signed = [cut for cut in cuts if touching[cut] == "-"]
        last = self._last
        if at_edge or signed or last is None:
            return (at_edge or signed or cuts)[-1]
        return min(cuts, key=lambda cut: abs(float(touching[cut:]) - last.tx))

    def _take(self, text: str) -> OpenVHeadMessage:
        self._last = decode(text.encode())
        return self._last


def _number(text: str) -> float:
    if len(text) > MAX_FIELD_BYTES or not _NUMBER.fullmatch(text):
        raise ProtocolError(f"{text[:40]!r} is no number of OpenVHead.")
    return float(text)


def _is_canonical(text: str) -> bool:
    """Whether Python would write this very text."""
    return len(text) <= MAX_FIELD_BYTES and bool(_NUMBER.fullmatch(text)) and str(float(text)) == text
