"""What we write, read by decoders that nobody here wrote: the same numbers in every section."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from retarget.udp.natnet.codec import encode
from retarget.udp.natnet.models import ForcePlateDescription, ModelDef
from retarget.udp.natnet.version import Bitstream
from tests.udp.natnet.examples import rich_frame, rich_models
from tests.udp.natnet.peers import natnet_frame, natnet_models, natnetsdk_frame, natnetsdk_models, optirx_frame

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike

    from retarget.udp.natnet.framedata import AnalogSamples, FrameOfData, LabelledMarkers, RigidBodies

NATNET_VERSIONS = [Bitstream(3, 1), Bitstream(4, 0), Bitstream(4, 1), Bitstream(4, 2)]
SDK_VERSIONS = [Bitstream(3, 0), Bitstream(3, 1), Bitstream(4, 0), Bitstream(4, 1)]


def assert_equal(theirs: ArrayLike, ours: ArrayLike) -> None:
    np.testing.assert_array_equal(np.asarray(theirs, np.float64), np.asarray(ours, np.float64))


class TestNatnet:
    """PyPI `natnet` 0.3.0."""

    @pytest.fixture(params=NATNET_VERSIONS, ids=str)
    def version(self, request: pytest.FixtureRequest) -> Bitstream:
        pytest.importorskip("natnet")
        version: Bitstream = request.param
        return version

    def test_reads_the_same_frame(self, version: Bitstream) -> None:
        ours = rich_frame(version)
        theirs = natnet_frame(encode(ours, version), version)
        assert theirs.prefix.frame_number == ours.number
        assert [s.model_name for s in theirs.marker_sets] == [s.name for s in ours.marker_sets]
        for their_set, our_set in zip(theirs.marker_sets, ours.marker_sets, strict=True):
            assert_equal(their_set.marker_pos_list, our_set.positions)
        assert_equal(theirs.unlabeled_marker_pos, ours.other_markers)
        self._same_bodies(theirs.rigid_bodies, ours.bodies, "marker_error")
        for their_skeleton, our_skeleton in zip(theirs.skeletons, ours.skeletons, strict=True):
            assert their_skeleton.id_num == our_skeleton.id
            self._same_bodies(their_skeleton.rigid_bodies, our_skeleton.bones, "marker_error")
        self._same_markers(theirs.labeled_markers, ours.labelled)
        self._same_analog(theirs.force_plates, ours.force_plates)
        self._same_analog(theirs.devices, ours.devices)

    def test_reads_the_same_times(self, version: Bitstream) -> None:
        ours = rich_frame(version)
        theirs = natnet_frame(encode(ours, version), version).suffix
        stamps = (theirs.stamp_camera_mid_exposure, theirs.stamp_data_received, theirs.stamp_transmit)
        assert (theirs.timecode, theirs.timecode_sub) == (ours.timecode, ours.timecode_subframe)
        assert (theirs.timestamp, stamps) == (ours.timestamp_s, ours.ticks)

    @pytest.mark.parametrize("version", [Bitstream(4, 1), Bitstream(4, 2)], indirect=True, ids=str)
    def test_reads_the_same_assets(self, version: Bitstream) -> None:
        ours = rich_frame(version)
        for their_asset, our_asset in zip(
            natnet_frame(encode(ours, version), version).assets, ours.assets, strict=True
        ):
            assert their_asset.asset_id == our_asset.id
            self._same_bodies(their_asset.rigid_bodies, our_asset.bodies, "mean_error")
            assert_equal([m.marker_id for m in their_asset.markers], our_asset.markers.ids)
            assert_equal([m.pos for m in their_asset.markers], our_asset.markers.positions)
            assert_equal([m.marker_params for m in their_asset.markers], our_asset.markers.params)

    def test_reads_the_same_model_definition(self, version: Bitstream) -> None:
        models = rich_models(version)
        ours = ModelDef(tuple(d for d in models.descriptions if not isinstance(d, ForcePlateDescription)))
        theirs = natnet_models(encode(ours, version), version)
        assert [tuple(s) for s in theirs.marker_sets] == [(s.name, s.marker_names) for s in ours.marker_sets]
        (band,) = ours.rigid_bodies
        (their_band,) = theirs.rigid_bodies
        assert (their_band.name, their_band.id_num, their_band.parent_id) == (band.name, band.id, 2**32 - 1)
        assert_equal(their_band.pos, band.offset)
        assert band.markers is not None
        assert_equal([m.pos for m in their_band.markers], band.markers.positions)
        assert_equal([m.active_label for m in their_band.markers], band.markers.active_labels)
        if version >= (4, 0):
            assert tuple(m.name for m in their_band.markers) == band.markers.names
        if version >= (4, 2):
            assert_equal(their_band.quat, band.rotation_xyzw if band.rotation_xyzw is not None else ())
        assert [s.name for s in theirs.skeletons] == ["Ana"]
        assert [(d.name, d.channel_names) for d in theirs.devices] == [("Glove", ("thumb", "index"))]
        assert [c.name for c in theirs.cameras] == ["Prime 13"]
        assert [a.name for a in theirs.assets] == (["Jacket"] if version >= (4, 1) else [])

    @staticmethod
    def _same_bodies(theirs: Sequence[Any], ours: RigidBodies, error: str) -> None:
        assert_equal([b.id_num for b in theirs], ours.ids)
        assert_equal([b.pos for b in theirs], ours.positions)
        assert_equal([b.rot for b in theirs], ours.quats_xyzw)
        assert_equal([getattr(b, error) for b in theirs], ours.errors)

    @staticmethod
    def _same_markers(theirs: Sequence[Any], ours: LabelledMarkers) -> None:
        assert_equal([m.model_id for m in theirs], ours.model_ids)
        assert_equal([m.marker_id for m in theirs], ours.member_ids)
        assert_equal([m.pos for m in theirs], ours.positions)
        assert_equal([m.size for m in theirs], ours.sizes)
        assert_equal([m.residual for m in theirs], ours.residuals)
        assert [m.occluded for m in theirs] == list(ours.occluded)
        assert [m.point_cloud_solved for m in theirs] == list(ours.point_cloud_solved)
        assert [m.model_solved for m in theirs] == list(ours.model_filled)
        assert [m.unlabeled for m in theirs] == list(ours.unlabelled)

    @staticmethod
    def _same_analog(theirs: Sequence[Any], ours: tuple[AnalogSamples, ...]) -> None:
        for their_box, our_box in zip(theirs, ours, strict=True):
            assert their_box.id_num == our_box.id
            for their_channel, our_channel in zip(their_box.channel_arrays, our_box.channels, strict=True):
                assert_equal(their_channel, our_channel)


class TestVendorsPythonSample:
    """PyPI `natnetsdk` 4.1.1; it counts the bytes that it read, all but the closing zero."""

    @pytest.fixture(params=SDK_VERSIONS, ids=str)
    def version(self, request: pytest.FixtureRequest) -> Bitstream:
        pytest.importorskip("natnetsdk")
        version: Bitstream = request.param
        return version

    def test_reads_the_same_frame_to_its_end(self, version: Bitstream) -> None:
        ours = rich_frame(version)
        datagram = encode(ours, version)
        theirs, read = natnetsdk_frame(datagram, version)
        assert read == len(datagram) - 4 - 4
        sets = theirs.marker_set_data.marker_data_list
        assert [s.model_name.decode() for s in sets] == [s.name for s in ours.marker_sets]
        for their_set, our_set in zip(sets, ours.marker_sets, strict=True):
            assert_equal(their_set.marker_pos_list, our_set.positions)
        assert_equal(theirs.legacy_other_markers.marker_pos_list, ours.other_markers)
        assert_equal([b.pos for b in theirs.rigid_body_data.rigid_body_list], ours.bodies.positions)
        bones = theirs.skeleton_data.skeleton_list[0].rigid_body_list
        assert_equal([b.rot for b in bones], ours.skeletons[0].bones.quats_xyzw)
        markers = theirs.labeled_marker_data.labeled_marker_list
        assert_equal([m.id_num for m in markers], ours.labelled.ids)
        assert_equal([m.pos for m in markers], ours.labelled.positions)
        assert_equal([m.param for m in markers], ours.labelled.params)
        self._same_suffix(theirs.suffix_data, ours, version)

    def test_reads_the_same_analog_samples(self, version: Bitstream) -> None:
        ours = rich_frame(version)
        theirs, _ = natnetsdk_frame(encode(ours, version), version)
        boxes = [*theirs.force_plate_data.force_plate_list, *theirs.device_data.device_list]
        for their_box, our_box in zip(boxes, [*ours.force_plates, *ours.devices], strict=True):
            for their_channel, our_channel in zip(their_box.channel_data_list, our_box.channels, strict=True):
                assert_equal(np.ravel(their_channel.frame_list), our_channel)

    def test_reads_the_same_model_definition_to_its_end(self, version: Bitstream) -> None:
        datagram = encode(rich_models(version), version)
        theirs, read = natnetsdk_models(datagram, version)
        assert read == len(datagram) - 4
        face = rich_models(version).marker_sets[0]
        assert [name.decode() for name in theirs.marker_set_list[0].marker_names_list] == list(face.marker_names)
        (plate,) = theirs.force_plate_list
        assert_equal(np.ravel(plate.corners), rich_plate(version).corners.ravel())
        assert_equal(plate.cal_matrix, rich_plate(version).calibration)
        assert [b.sz_name for b in theirs.rigid_body_list] == [b"Band"]
        assert [a.name for a in theirs.asset_list] == ([b"Jacket"] if version >= (4, 1) else [])

    @staticmethod
    def _same_suffix(theirs: Any, ours: FrameOfData, version: Bitstream) -> None:
        stamps = (theirs.stamp_camera_mid_exposure, theirs.stamp_data_received, theirs.stamp_transmit)
        assert stamps == ours.ticks
        assert theirs.timestamp == ours.timestamp_s
        assert (theirs.param, theirs.is_recording) == (ours.params, ours.recording)
        if version >= (4, 0):
            theirs_signed = (theirs.prec_timestamp_secs, theirs.prec_timestamp_frac_secs)
            assert tuple(part % 2**32 for part in theirs_signed) == ours.precision


def rich_plate(version: Bitstream) -> ForcePlateDescription:
    (plate,) = (d for d in rich_models(version).descriptions if isinstance(d, ForcePlateDescription))
    return plate


class TestOptirx:
    """PyPI `optirx` 1.9, which reads no force plates."""

    @pytest.fixture(
        params=[Bitstream(2, 5), Bitstream(2, 6), Bitstream(2, 7), Bitstream(2, 8), Bitstream(2, 9)], ids=str
    )
    def version(self, request: pytest.FixtureRequest) -> Bitstream:
        pytest.importorskip("optirx")
        version: Bitstream = request.param
        return version

    def test_reads_the_same_frame(self, version: Bitstream) -> None:
        ours = replace(rich_frame(version), force_plates=())
        theirs = optirx_frame(encode(ours, version), version)
        assert theirs.frameno == ours.number
        for our_set in ours.marker_sets:
            assert_equal(theirs.sets[our_set.name.encode()], our_set.positions)
        assert_equal(theirs.other_markers, ours.other_markers)
        self._same_bodies(theirs.rigid_bodies, ours.bodies)
        self._same_bodies(theirs.skeletons[0].rigid_bodies, ours.skeletons[0].bones)
        assert_equal([m.id for m in theirs.labeled_markers], ours.labelled.ids)
        assert_equal([m.position for m in theirs.labeled_markers], ours.labelled.positions)
        assert theirs.latency == ours.software_latency
        assert theirs.timecode == (ours.timecode, ours.timecode_subframe)

    def test_reads_the_same_flags_and_time(self, version: Bitstream) -> None:
        ours = replace(rich_frame(version), force_plates=())
        theirs = optirx_frame(encode(ours, version), version)
        if version < (2, 6):
            assert (theirs.timestamp, theirs.is_recording) == (None, None)
            return
        assert (theirs.timestamp, theirs.is_recording) == (ours.timestamp_s, ours.recording)
        assert theirs.tracked_models_changed == ours.models_changed
        assert [m.occluded for m in theirs.labeled_markers] == list(ours.labelled.occluded)
        assert [m.model_solved for m in theirs.labeled_markers] == list(ours.labelled.model_filled)

    @staticmethod
    def _same_bodies(theirs: Sequence[Any], ours: RigidBodies) -> None:
        assert_equal([b.id for b in theirs], ours.ids)
        assert_equal([b.orientation for b in theirs], ours.quats_xyzw)
        for body, markers in zip(theirs, ours.markers, strict=True):
            assert_equal(body.markers, markers.positions)
            assert_equal(body.mrk_ids, markers.ids)
            assert_equal(body.mrk_sizes, markers.sizes)
