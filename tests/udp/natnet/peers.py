"""Decoders that nobody here wrote; each takes a datagram. Imports happen inside: a missing one skips its tests only."""

from __future__ import annotations

from typing import Any


def natnet_frame(datagram: bytes, version: tuple[int, int]) -> Any:
    """PyPI `natnet` 0.3.0; it reads 3.0 to 4.2, and does not know the precision time stamp."""
    from natnet.data_frame import DataFrame
    from natnet.packet_buffer import PacketBuffer
    from natnet.version import Version

    return DataFrame.read_from_buffer(PacketBuffer(datagram[4:]), Version(*version))


def natnet_models(datagram: bytes, version: tuple[int, int]) -> Any:
    """PyPI `natnet` 0.3.0; it reads three of a force plate's four corners."""
    from natnet.data_descriptions import DataDescriptions
    from natnet.packet_buffer import PacketBuffer
    from natnet.version import Version

    return DataDescriptions.read_from_buffer(PacketBuffer(datagram[4:]), Version(*version))


def natnetsdk_frame(datagram: bytes, version: tuple[int, int]) -> Any:
    """PyPI `natnetsdk` 4.1.1, the vendor's Python sample; its answer and how many bytes it read."""
    from natnetsdk.NatNetClient import NatNetClient

    payload = datagram[4:]
    read, data = NatNetClient()._NatNetClient__unpack_mocap_data(payload, len(payload), *version)
    return data, read


def natnetsdk_models(datagram: bytes, version: tuple[int, int]) -> Any:
    """PyPI `natnetsdk` 4.1.1, the vendor's Python sample; its answer and how many bytes it read."""
    from natnetsdk.NatNetClient import NatNetClient

    payload = datagram[4:]
    read, data = NatNetClient()._NatNetClient__unpack_data_descriptions(payload, len(payload), *version)
    return data, read


def optirx_frame(datagram: bytes, version: tuple[int, int]) -> Any:
    """PyPI `optirx` 1.9; it reads 2.5 to 2.9."""
    import optirx

    return optirx.unpack(datagram, (*version, 0, 0))
