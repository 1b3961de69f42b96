"""Pictures of a camera, taken by a thread of its own: the newest wins, those that nobody was ready for are counted."""

from __future__ import annotations

import threading
import time
from pathlib import Path
from typing import TYPE_CHECKING, Self

import numpy as np

from retarget.camera.pictures import Picture
from retarget.camera.quiet import quiet
from retarget.errors import ConnectionFailedError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    import cv2

PATIENCE_S = 5.0
"""Without a picture, after which a camera is taken for gone."""


class CameraPictures:
    """A camera; its newest picture, whenever somebody is ready for one."""

    live = True
    count = None

    def __init__(self, index: int, opener: Callable[[int], cv2.VideoCapture] | None = None) -> None:
        """`opener` stands in for OpenCV's capture, for cameras that it does not know."""
        self._index = index
        self._opener = opener
        self._capture: cv2.VideoCapture | None = None
        self._changed = threading.Condition()
        self._newest: Picture | None = None
        self._closing = False
        self._lost = False
        self.dropped = 0
        """Pictures that were overtaken."""

    @property
    def rate_hz(self) -> float | None:
        """As the camera tells [Hz]."""
        import cv2

        told = self._capture.get(cv2.CAP_PROP_FPS) if self._capture is not None else 0.0
        return told if np.isfinite(told) and told > 0 else None

    def stop(self) -> None:
        """No picture after the current one."""
        self._closing = True  # no lock: a signal's function may interrupt the thread that holds it

    def __enter__(self) -> Self:
        self._capture = self._opened()
        self._closing = self._lost = False
        self._thread = threading.Thread(target=self._take, args=(self._capture,), name="camera", daemon=True)
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._closing = True
        self._thread.join(PATIENCE_S)
        if self._capture is not None:
            self._capture.release()

    def __iter__(self) -> Iterator[Picture]:
        patience_s = time.monotonic() + PATIENCE_S
        while not self._closing:
            picture = self._next(0.1)
            if picture is not None:
                patience_s = time.monotonic() + PATIENCE_S
                yield picture
            elif self._lost or time.monotonic() > patience_s:
                raise ConnectionFailedError(f"Camera {self._index} gives no more pictures; is it still plugged in?")

    def _next(self, timeout_s: float) -> Picture | None:
        with self._changed:
            self._changed.wait_for(lambda: self._newest is not None or self._lost, timeout_s)
            picture, self._newest = self._newest, None
            return picture

    def _opened(self) -> cv2.VideoCapture:
        import cv2

        with quiet():
            capture = (self._opener or cv2.VideoCapture)(self._index)
        if capture.isOpened():
            return capture
        capture.release()
        device = Path(f"/dev/video{self._index}")
        if device.exists():
            raise ConnectionFailedError(
                f"Camera {self._index} is there but cannot be opened: another program may be using it, or the rights "
                f"to {device} are missing."
            )
        raise ConnectionFailedError(
            f"There is no camera {self._index} on this machine; plug one in, try another number, or give a video file."
        )

    def _take(self, capture: cv2.VideoCapture) -> None:
        number = 0
        while not self._closing:
            found, image = capture.read()
            with self._changed:
                if not found:
                    self._lost = True
                else:
                    self.dropped += self._newest is not None
                    self._newest = Picture(number, time.monotonic(), np.asarray(image, np.uint8))
                self._changed.notify_all()
            if not found:
                return
            number += 1
