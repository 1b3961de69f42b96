"""The opposite of the cursor: gathers the bytes of one message, and says in a sentence what does not fit into it."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, Any

import numpy as np

from retarget.errors import InputError
from retarget.udp.natnet.records import FLOAT, INT
from retarget.udp.natnet.text import terminated

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

_INT32 = struct.Struct("<i")
_SIZED = struct.Struct("<ii")


class Writer:
    """Collects pieces; `getvalue` joins them."""

    __slots__ = ("pieces",)

    def __init__(self) -> None:
        self.pieces: list[bytes] = []

    def getvalue(self) -> bytes:
        """All that was written."""
        return b"".join(self.pieces)

    def pack(self, form: struct.Struct, *values: float | bytes) -> None:
        """Write numbers; raise `InputError` when one does not fit its field."""
        try:
            self.pieces.append(form.pack(*values))
        except (struct.error, OverflowError):
            shown = ", ".join(str(value) for value in values)
            raise InputError(f"The values {shown} do not fit into NatNet's fields ({form.format}).") from None

    def int32(self, value: int) -> None:
        """Write one signed number of 32 bits."""
        self.pack(_INT32, value)

    def octets(self, octets: bytes) -> None:
        """Write bytes as they are."""
        self.pieces.append(octets)

    def text(self, text: str) -> None:
        """Write text and its closing NUL."""
        self.pieces.append(terminated(text))

    def texts(self, texts: Iterable[str]) -> None:
        """Write several texts."""
        self.pieces.extend(terminated(text) for text in texts)

    def floats(self, values: NDArray[np.float32], *shape: int) -> None:
        """Write an array of float32; raise `InputError` unless it has this shape, -1 standing for any extent."""
        self._array(values, FLOAT, shape)

    def ints(self, values: NDArray[np.int32], *shape: int) -> None:
        """Write an array of int32; raise `InputError` unless it has this shape."""
        self._array(values, INT, shape)

    def table(self, table: NDArray[np.void]) -> None:
        """Write records as they are."""
        self.pieces.append(table.tobytes())

    def sized(self, count: int, body: Writer) -> None:
        """Write a section from 4.1: count, size, entries."""
        entries = body.getvalue()
        self.pack(_SIZED, count, len(entries))
        self.pieces.append(entries)

    def _array(self, values: NDArray[Any], kind: np.dtype[Any], shape: tuple[int, ...]) -> None:
        array = np.asarray(values, kind)
        fits = array.ndim == len(shape) and all(
            want in (-1, have) for want, have in zip(shape, array.shape, strict=True)
        )
        if not fits:
            raise InputError(f"An array of shape {shape} is wanted here, not {array.shape}.")
        self.pieces.append(array.tobytes())
