"""A cursor over one datagram that never reads past its end.

Counts are bounded by the bytes left before anything is made for them, so no datagram costs more memory than its own
size in order of magnitude. Every mistake in the bytes is a `ProtocolError`.
"""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, Any

import numpy as np

from retarget.errors import ProtocolError
from retarget.udp.natnet.records import FLOAT, INT, NO_FLOATS, NO_POSITIONS
from retarget.udp.natnet.text import text_from_octets

if TYPE_CHECKING:
    from numpy.typing import NDArray

_INT32 = struct.Struct("<i").unpack_from
_ndarray = np.ndarray
_PAIR = struct.Struct("<ii").unpack_from


class Cursor:
    """Reads forward through `data`; arrays are read-only views of it."""

    __slots__ = ("at", "data", "end")

    def __init__(self, data: bytes, at: int = 0) -> None:
        self.data = data
        self.at = at
        self.end = len(data)

    @property
    def left(self) -> int:
        """Bytes not yet read."""
        return self.end - self.at

    def unpack(self, form: struct.Struct) -> tuple[Any, ...]:
        """Read the numbers of `form`."""
        try:
            values = form.unpack_from(self.data, self.at)
        except struct.error:
            raise self._cut_short() from None
        self.at += form.size
        return values

    def int32(self) -> int:
        """Read one signed number of 32 bits."""
        at = self.at
        self.at = at + 4
        try:
            value: int = _INT32(self.data, at)[0]
        except struct.error:
            raise self._cut_short() from None
        return value

    def int32_pair(self) -> tuple[int, int]:
        """Read two signed numbers of 32 bits."""
        at = self.at
        self.at = at + 8
        try:
            first, second = _PAIR(self.data, at)
        except struct.error:
            raise self._cut_short() from None
        return first, second

    def last(self, form: struct.Struct) -> tuple[Any, ...]:
        """Read the numbers of `form`, which must be all that is left."""
        if self.end - self.at != form.size:
            raise ProtocolError(
                f"{self.left} bytes are left at byte {self.at}, where the last {form.size} are expected."
            )
        return self.unpack(form)

    def count(self, entry_octets: int, most: int | None = None) -> int:
        """Read how many entries follow, of at least `entry_octets` bytes each and at most `most`."""
        return self.bounded(self.int32(), entry_octets, most)

    def bounded(self, count: int, entry_octets: int, most: int | None = None) -> int:
        """Return `count` if so many entries of at least `entry_octets` bytes can follow, at most `most`."""
        if not 0 <= count * entry_octets <= self.end - self.at:
            raise ProtocolError(
                f"{count} entries of {entry_octets} bytes are announced at byte {self.at}; {self.left} bytes are left."
            )
        if most is not None and count > most:
            raise ProtocolError(f"{count} entries are announced at byte {self.at}; at most {most} are allowed.")
        return count

    def octets(self, count: int) -> bytes:
        """Read `count` bytes."""
        start = self.at
        self.at += self.bounded(count, 1)
        return self.data[start : self.at]

    def rest(self) -> bytes:
        """Read all that is left."""
        return self.octets(self.left)

    def text(self) -> str:
        """Read text up to its closing NUL."""
        start = self.at
        stop = self.data.find(b"\0", start)
        if stop < 0:
            raise ProtocolError(f"The name at byte {start} has no end.")
        self.at = stop + 1
        return text_from_octets(self.data[start:stop])

    def texts(self, count: int) -> tuple[str, ...]:
        """Read several texts."""
        return tuple(self.text() for _ in range(count))

    def table(self, record: np.dtype[np.void], count: int) -> NDArray[np.void]:
        """View `count` records, (count,)."""
        return self._view((count,), record, count * record.itemsize)

    def positions(self, count: int) -> NDArray[np.float32]:
        """View `count` points, (count, 3)."""
        return self._view((count, 3), FLOAT, 12 * count) if count else NO_POSITIONS

    def floats(self, count: int) -> NDArray[np.float32]:
        """View `count` numbers, (count,)."""
        return self._view((count,), FLOAT, 4 * count) if count else NO_FLOATS

    def ints(self, count: int) -> NDArray[np.int32]:
        """View `count` whole numbers, (count,)."""
        return self._view((count,), INT, 4 * count)

    def finish(self) -> None:
        """Refuse bytes behind the end of the message."""
        if self.at != self.end:
            raise ProtocolError(f"{self.left} bytes follow the end of the message at byte {self.at}.")

    def _cut_short(self) -> ProtocolError:
        return ProtocolError(f"The datagram ends at byte {self.end}, in the middle of a number.")

    def _view(self, shape: tuple[int, ...], kind: np.dtype[Any], octets: int) -> NDArray[Any]:
        start = self.at
        self.at = stop = start + octets
        if not start <= stop <= self.end:
            raise ProtocolError(f"{octets} bytes are announced at byte {start}; the datagram ends at byte {self.end}.")
        return _ndarray(shape, kind, self.data, start)
