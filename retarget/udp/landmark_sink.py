"""Marker frames out as datagrams (`retarget.udp.landmarks`)."""

from __future__ import annotations

import secrets
import time
from typing import TYPE_CHECKING

import numpy as np

from retarget.udp.address import parse_address
from retarget.udp.landmarks import PointsMessage, encode_layout, encode_points, layout_id
from retarget.udp.sockets import local_address_towards, open_udp

if TYPE_CHECKING:
    from retarget.frames import MarkerFrame, MarkerLayout

LAYOUT_EVERY_S = 1.0
"""Names are sent again, for receivers that came later or lost them."""


class LandmarkSink:
    """Sends frames to ``udp://HOST:PORT``; a context manager. Nobody need listen there."""

    def __init__(self, url: str) -> None:
        """InputError or `ConnectionFailedError` where the address cannot be used."""
        self._peer = parse_address(url, "udp")
        self._socket = open_udp(local_address_towards(self._peer[0]))
        self._session = secrets.randbits(32)
        self._layout: MarkerLayout | None = None
        self._layout_id = 0
        self._named_s = -np.inf
        self.sent = 0
        """Frames sent."""
        self.refused = 0
        """Frames that could not leave: nobody listens on this machine, or the network is down."""

    def __enter__(self) -> LandmarkSink:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Give the port back."""
        self._socket.close()

    def __call__(self, frame: MarkerFrame, confidence: float | None = None) -> None:
        """Send one frame; `confidence` 0 to 1 is by default the share of points seen. InputError as `encode_layout`."""
        self._tell_layout(frame.layout)
        seen = float(np.isfinite(frame.positions).all(axis=1).mean()) if confidence is None else confidence
        message = PointsMessage(
            self._layout_id, self._session, self.sent + self.refused, frame.time_s, seen, frame.positions
        )
        if self._socket.send(encode_points(message), self._peer):
            self.sent += 1
        else:
            self.refused += 1

    def _tell_layout(self, layout: MarkerLayout) -> None:
        now_s = time.monotonic()
        if layout is self._layout and now_s < self._named_s + LAYOUT_EVERY_S:
            return
        self._socket.send(encode_layout(layout), self._peer)
        self._layout, self._layout_id, self._named_s = layout, layout_id(layout.name, layout.names), now_s
