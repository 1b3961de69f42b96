"""What a server answers to REQUESTs: facts about the reel, and playback controls.

Commands and their answers are those of the vendor's NatNetRequests.h, frames counted from 0; `SetPlaybackSpeed` is
ours. Status 0 is success. What only a capture system can do (recording, other takes) is answered with status 1.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from retarget.errors import InputError
from retarget.udp.natnet.messages import Response, UnrecognizedRequest
from retarget.udp.natnet.playback import AtEnd

if TYPE_CHECKING:
    from collections.abc import Callable

    from retarget.udp.natnet.messages import Request
    from retarget.udp.natnet.playback import Playback

_DONE, _FAILED = Response.of_int32(0), Response.of_int32(1)
_EDIT_MODE = 2
_UNKNOWN = UnrecognizedRequest(bytes(264))


def answer_request(request: Request, playback: Playback, rate_hz: float) -> Response | UnrecognizedRequest:
    """Answer one request, and do what it asks for."""
    command, parameters = request.command, request.parameters
    if command == "FrameRate":
        return Response.of_float32(rate_hz)
    if command in _FACTS:
        return _FACTS[command]
    if command == "CurrentTakeLength":
        return Response.of_int32(playback.length)
    if command in _IMPOSSIBLE:
        return _FAILED
    control = _CONTROLS.get(command)
    if control is None:
        return _UNKNOWN
    try:
        control(playback, parameters[0] if parameters else "")
    except (ValueError, InputError):
        return _FAILED
    return _DONE


def _set_speed(playback: Playback, text: str) -> None:
    playback.speed = float(text)


def _set_looping(playback: Playback, text: str) -> None:
    playback.at_end = AtEnd.LOOP if int(text[:9]) else AtEnd.STOP


_FACTS = {
    "UnitsToMillimeters": Response.of_float32(1000.0),
    "CurrentMode": Response.of_int32(_EDIT_MODE),
    "AnalogSamplesPerMocapFrame": Response.of_int32(0),
    "EditMode": _DONE,
}
_IMPOSSIBLE = {
    "StartRecording",
    "StopRecording",
    "LiveMode",
    "SetRecordTakeName",
    "SetPlaybackTakeName",
    "SetCurrentSession",
}
_CONTROLS: dict[str, Callable[[Playback, str], None]] = {
    "TimelinePlay": lambda playback, _: playback.play(),
    "TimelineStop": lambda playback, _: playback.pause(),
    "SetPlaybackStartFrame": lambda playback, text: playback.begin_at(int(text[:9])),
    "SetPlaybackStopFrame": lambda playback, text: playback.end_at(int(text[:9])),
    "SetPlaybackCurrentFrame": lambda playback, text: playback.jump(int(text[:9])),
    "SetPlaybackLooping": _set_looping,
    "SetPlaybackSpeed": _set_speed,
}
