"""What OpenVHead's server wants to hear, out of marker frames of a face mesh or of 68 landmarks.

The frames' metres are looked at by a virtual camera, so that it does not matter whether they come from a camera here,
over the network, or from a take. Two ways: "openvhead" is its own chain, flaws and all; "steady" reads landmarks to the
subpixel, calms landmarks and measures by One-Euro filters and keeps the quaternion on one hemisphere, so that nothing
jumps when a stream begins or the head turns.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np

from retarget.camera import ibug68
from retarget.camera.head_pose import CV_TO_HOUSE, OPENVHEAD_MODEL, OPENVHEAD_POINTS, HeadPoseTracker
from retarget.camera.landmarks import IBUG68, MESH478
from retarget.camera.measures import OpenVHeadMeasures, openvhead_measures, reference_length
from retarget.camera.metric import pixels_of
from retarget.camera.openvhead import DECIMALS, OpenVHeadChain, OpenVHeadValues
from retarget.errors import InputError
from retarget.filters import OneEuro
from retarget.geometry import align_hemisphere, quat_from_matrix

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from retarget.frames import MarkerFrame, MarkerLayout

    Array = NDArray[np.float64]

SIZE = (640, 480)
"""Of the virtual camera [px]; its focal length is the width, as OpenVHead has it."""
MIN_CUTOFF_HZ, BETA = 1.0, 20.0
"""Of the One-Euro filters, on landmarks over the face's reference length and on measures."""
_FACING_XYZW = np.array([1.0, 0.0, 0.0, 0.0])
"""A frontal face in OpenCV's axes, from which the receiver starts as well."""

Style = Literal["openvhead", "steady"]


class OpenVHeadFeed:
    """From frames in order to OpenVHead's numbers."""

    def __init__(self, style: Style = "steady") -> None:
        self._chain = OpenVHeadChain(SIZE) if style == "openvhead" else _SteadyChain()
        self._layout: MarkerLayout | None = None
        self._from_mesh = False

    def reset(self) -> None:
        """Forget all frames."""
        self._chain.reset()

    def __call__(self, frame: MarkerFrame) -> OpenVHeadValues | None:
        """The numbers for `frame` in ``camera`` [m]; None without a face, as OpenVHead then says nothing.

        InputError where the frame's markers are neither a face mesh nor the 68 landmarks.
        """
        if frame.layout is not self._layout:
            self._learn(frame.layout)
        positions = ibug68.from_mesh(frame.positions) if self._from_mesh else frame.positions
        points = pixels_of(positions, SIZE)
        if not np.isfinite(points).all():
            return None
        if isinstance(self._chain, _SteadyChain):
            return self._chain(points, frame.time_s)
        return self._chain(np.rint(points))

    def _learn(self, layout: MarkerLayout) -> None:
        if layout.names not in {MESH478.names, IBUG68.names}:
            raise InputError(
                f"OpenVHead needs the landmarks of a camera ({MESH478.name} or {IBUG68.name}); the markers of this "
                f"source are {layout.name}."
            )
        self._layout, self._from_mesh = layout, layout.names == MESH478.names
        self.reset()


class _SteadyChain:
    """The same numbers without OpenVHead's flaws."""

    def __init__(self) -> None:
        self._calm_points = OneEuro(MIN_CUTOFF_HZ, BETA)
        self._calm_measures = OneEuro(MIN_CUTOFF_HZ, BETA)  # of their own: a blink is small beside the face
        self._track = HeadPoseTracker(OPENVHEAD_MODEL, SIZE)
        self.reset()

    def reset(self) -> None:
        self._calm_points.reset()
        self._calm_measures.reset()
        self._track.reset()
        self._quat = _FACING_XYZW
        self._reference_px: float | None = None

    def __call__(self, points: Array, time_s: float) -> OpenVHeadValues | None:
        if self._reference_px is None:
            self._reference_px = reference_length(points)
        six = points[list(OPENVHEAD_POINTS)] / self._reference_px
        pose = self._track(self._calm_points(six.ravel(), time_s).reshape(-1, 2) * self._reference_px)
        measures = self._calm_measures(np.array(openvhead_measures(points)), time_s)
        if pose is None:
            return None
        T = pose.T_camera_head
        self._quat = align_hemisphere(quat_from_matrix(CV_TO_HOUSE @ T[:3, :3]), self._quat)
        quat_wxyz = np.round(np.roll(self._quat, 1), DECIMALS)
        return OpenVHeadValues(CV_TO_HOUSE @ T[:3, 3], quat_wxyz, OpenVHeadMeasures(*measures.tolist()))
