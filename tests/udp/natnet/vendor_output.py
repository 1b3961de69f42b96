"""What the vendor's own sample client printed of the recorded session, and our frames in the same words."""

from __future__ import annotations

import re
from decimal import ROUND_HALF_UP, Decimal
from typing import TYPE_CHECKING

from tests.udp.natnet.captures import VENDOR_OUTPUT

if TYPE_CHECKING:
    from collections.abc import Iterator

    import numpy as np
    from numpy.typing import NDArray

    from retarget.udp.natnet.framedata import FrameOfData
    from retarget.udp.natnet.models import MarkerSetDescription, ModelDef, RigidBodyDescription

_FRAME_LINE = re.compile(
    r"(Timestamp|Software latency|System latency|Timecode) : |Other Marker|Rigid Bod(ies|y) \[|Skeletons \["
    r"|Labeled Marker|Force Plate \[|Device \[|\tx\t|\t\S+\t\S+\t\S+\t\S+\t\S+\t\S+\t\S+$"
)
"""Lines of a frame. Others come from another thread; the total latency needs the client's clock."""


def printed_frames() -> list[list[str]]:
    """The lines of each frame that the vendor's client printed."""
    frames: list[list[str]] = []
    for line in VENDOR_OUTPUT.read_text().splitlines():
        if line.startswith("FrameID : "):
            frames.append([line])
        elif frames and _FRAME_LINE.match(line):
            frames[-1].append(line)
    return frames


def printed_models() -> list[str]:
    """The lines of the model definition that the vendor's client printed."""
    text = VENDOR_OUTPUT.read_text()
    start = text.index("Data Description # 0")
    return text[start : text.index("FrameID", start)].splitlines()


def frame_lines(frame: FrameOfData, clock_hz: int) -> Iterator[str]:
    """Our frame as the vendor's client prints one."""
    assert frame.ticks is not None
    software_ms = 1000 * (frame.ticks.transmit - frame.ticks.received) / clock_hz
    system_ms = 1000 * (frame.ticks.transmit - frame.ticks.mid_exposure) / clock_hz
    code = frame.timecode.to_bytes(4, "big")
    yield f"FrameID : {frame.number}"
    yield f"Timestamp : {_two(frame.timestamp_s)}"
    yield f"Software latency : {_two(software_ms)} milliseconds"
    yield f"System latency : {_two(system_ms)} milliseconds"
    yield "Timecode : " + ":".join(f"{part:02d}" for part in code) + f".{frame.timecode_subframe}"
    yield f"Other Markers [Count={len(frame.other_markers)}]"
    for index, position in enumerate(frame.other_markers):
        yield f"Other Marker {index} : {_tabbed(position)}"
    yield from _body_lines(frame)
    yield f"Skeletons [Count={len(frame.skeletons)}]"
    yield from _labelled_lines(frame)
    yield f"Force Plate [Count={len(frame.force_plates)}]"
    yield f"Device [Count={len(frame.devices)}]"


def _body_lines(frame: FrameOfData) -> Iterator[str]:
    bodies = frame.bodies
    yield f"Rigid Bodies [Count={len(bodies)}]"
    for row in range(len(bodies)):
        yield f"Rigid Body [ID={bodies.ids[row]}  Error={_two(bodies.errors[row])}  Valid={int(bodies.tracked[row])}]"
        yield "\tx\ty\tz\tqx\tqy\tqz\tqw"
        yield f"\t{_tabbed(bodies.positions[row])}\t{_tabbed(bodies.quats_xyzw[row])}"


def _labelled_lines(frame: FrameOfData) -> Iterator[str]:
    markers = frame.labelled
    yield f"Labeled Markers [Count={len(markers)}]"
    for row in range(len(markers)):
        position = ",".join(_two(value) for value in markers.positions[row])
        yield (
            f"Labeled Marker [ModelID={markers.model_ids[row]}, MarkerID={markers.member_ids[row]}, "
            f"Occluded={int(markers.occluded[row])}, PCSolved={int(markers.point_cloud_solved[row])}, "
            f"ModelSolved={int(markers.model_filled[row])}] [size={_two(markers.sizes[row])}] [pos={position}]"
        )


def model_lines(models: ModelDef) -> Iterator[str]:
    """Our model definition, one rigid body and marker sets behind it, as the vendor's client prints it."""
    (body,) = models.rigid_bodies
    yield "Data Description # 0 (type=1)"
    yield from _described_body_lines(body)
    for index, markers in enumerate(models.marker_sets, start=1):
        yield f"Data Description # {index} (type=0)"
        yield from _described_set_lines(markers)


def _described_body_lines(body: RigidBodyDescription) -> Iterator[str]:
    yield f"RigidBody Name : {body.name}"
    yield f"RigidBody ID : {body.id}"
    yield f"RigidBody Parent ID : {body.parent_id}"
    yield "Parent Offset : " + ",".join(_two(value) for value in body.offset)
    assert body.markers is not None
    for index, position in enumerate(body.markers.positions):
        yield f"\tMarker #{index}:"
        yield "\t\tPosition: " + ", ".join(_two(value) for value in position)


def _described_set_lines(markers: MarkerSetDescription) -> Iterator[str]:
    yield f"MarkerSet Name : {markers.name}"
    yield from markers.marker_names


def _tabbed(values: NDArray[np.float32]) -> str:
    return "\t".join(_two(value) for value in values)


def _two(value: float | None) -> str:
    """Two decimals as the vendor's C library prints them: of 17 significant digits, ties away from zero."""
    assert value is not None
    return str(Decimal(f"{value:.17g}").quantize(Decimal("0.01"), ROUND_HALF_UP))
