"""Captures: a real one, Wireshark's own tools, and packets made by hand as the specifications say."""

from __future__ import annotations

import contextlib
import random
import shutil
import struct
import subprocess
from collections import Counter
from typing import TYPE_CHECKING

import pytest
from hypothesis import given
from hypothesis import strategies as st

from retarget.errors import InputError, OutputError
from retarget.take.capture_writer import write_capture
from retarget.take.network import UdpExtractor, UdpPacket, ethernet_frame
from retarget.take.reader import read_take
from retarget.udp.datagram import Datagram
from tests.take.sessions import METADATA, made_up, motive_session

if TYPE_CHECKING:
    from pathlib import Path

SERVER, CLIENT = ("10.0.0.7", 1511), ("10.0.0.9", 40000)
FRAME = struct.pack("<HH", 7, 3000) + bytes(range(250)) * 12


def ip_packets(payload: bytes, source: tuple[str, int] = SERVER, destination: tuple[str, int] = CLIENT) -> list[bytes]:
    """The datagram as IP fragments of at most 1,480 bytes, as an Ethernet card sends them."""
    whole = ethernet_frame(UdpPacket(source, destination, payload), identification=77)[14:]
    header, body = whole[:20], whole[20:]
    parts = []
    for start in range(0, len(body), 1480):
        piece, more = body[start : start + 1480], start + 1480 < len(body)
        flags = struct.pack(">H", (0x2000 if more else 0) | start // 8)
        parts.append(header[:2] + struct.pack(">H", 20 + len(piece)) + header[4:6] + flags + header[8:] + piece)
    return parts


def pcap(packets: list[bytes], link_type: int, order: str = "<", magic: int = 0xA1B2C3D4) -> bytes:
    head = struct.pack(order + "IHHiIII", magic, 2, 4, 0, 0, 65535, link_type)
    return head + b"".join(
        struct.pack(order + "IIII", 1_700_000_000 + i, 250_000, len(p), len(p)) + p for i, p in enumerate(packets)
    )


def test_real_motive_session_is_read_with_the_roles_of_both_ends() -> None:
    take = read_take(motive_session())
    kinds = Counter((d.channel, d.direction, d.peer, d.payload[0]) for d in take)
    server = "192.168.0.106"
    assert kinds == {
        ("data", "in", (server, 1511), 7): 518,
        ("command", "out", (server, 1510), 12): 9,
        ("command", "in", (server, 1510), 13): 9,
        ("command", "out", (server, 1510), 2): 4,
        ("command", "in", (server, 1510), 3): 3,
        ("command", "in", (server, 1510), 1): 2,
        ("command", "in", (server, 1510), 5): 1,
        ("command", "in", (server, 1510), 100): 1,
        ("command", "out", (server, 1510), 4): 1,
        ("command", "out", (server, 1510), 0): 1,
        ("command", "out", ("192.168.0.255", 1510), 14): 1,
    }
    assert take.duration_s == pytest.approx(6.844636, abs=1e-9)
    assert take.metadata.clock_offset_ns == 1509244022606067000


def test_real_motive_session_survives_the_way_to_a_capture_of_ours_and_back(tmp_path: Path) -> None:
    session = read_take(motive_session())
    write_capture(tmp_path / "again.pcapng", session, session.metadata)
    again = read_take(tmp_path / "again.pcapng")
    assert list(again) == list(session)
    assert again.metadata == session.metadata


@pytest.mark.skipif(shutil.which("tshark") is None, reason="tshark is not installed")
def test_wireshark_reads_our_captures_and_finds_their_checksums_right(tmp_path: Path) -> None:
    datagrams, path = made_up(60), tmp_path / "ours.pcapng"
    assert write_capture(path, datagrams, METADATA) == 60
    fields = ["frame.time_epoch", "ip.checksum.status", "udp.checksum.status", "ip.src", "udp.dstport", "udp.payload"]
    asked = [word for field in fields for word in ("-e", field)]
    checks = ["-o", "ip.check_checksum:TRUE", "-o", "udp.check_checksum:TRUE"]
    told = subprocess.run(["tshark", "-r", path, "-T", "fields", *checks, *asked], capture_output=True, text=True)
    rows = [line.split("\t") for line in told.stdout.splitlines()]
    assert len(rows) == 60
    for row, datagram in zip(rows, datagrams, strict=True):
        assert float(row[0]) == pytest.approx(1e9 + datagram.received_s, abs=1e-6)
        assert row[1:3] == ["1", "1"]
        assert row[3] == ("192.0.2.1" if datagram.direction == "out" else "10.0.0.7")
        assert row[5] == datagram.payload.hex()


@pytest.mark.skipif(shutil.which("editcap") is None, reason="editcap is not installed")
@pytest.mark.parametrize("form", ["pcap", "nsecpcap"])
def test_classic_captures_give_the_same_session(tmp_path: Path, form: str) -> None:
    session, path = motive_session(), tmp_path / "classic.pcap"
    subprocess.run(["editcap", "-F", form, session, path], check=True, capture_output=True)
    assert list(read_take(path)) == list(read_take(session))


@pytest.mark.parametrize(("order", "magic", "fraction_ns"), [("<", 0xA1B2C3D4, 1000), (">", 0xA1B23C4D, 1)])
def test_classic_captures_of_both_byte_orders_and_resolutions(
    tmp_path: Path, order: str, magic: int, fraction_ns: int
) -> None:
    path = tmp_path / "made.pcap"
    path.write_bytes(pcap([*ip_packets(FRAME), *ip_packets(FRAME)], 101, order, magic))
    take = read_take(path)
    assert [d.payload for d in take] == [FRAME, FRAME]
    assert take.metadata.clock_offset_ns == 1_700_000_002 * 10**9 + 250_000 * fraction_ns


def block(order: str, kind: int, body: bytes) -> bytes:
    length = struct.pack(order + "I", len(body) + 12)
    return struct.pack(order + "I", kind) + length + body + length


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize(("resolution", "ticks"), [(9, 1_500_000_000), (3, 1_500), (0x94, 3 << 19)])
def test_every_byte_order_resolution_and_kind_of_block_of_pcapng_is_read(
    tmp_path: Path, order: str, resolution: int, ticks: int
) -> None:
    """1.5 s after the interface's offset of 100 s, whatever a tick is; the unknown block in between does no harm."""
    section = block(order, 0x0A0D0D0A, struct.pack(order + "IHHq", 0x1A2B3C4D, 1, 0, -1))
    options = struct.pack(order + "HHB3x", 9, 1, resolution) + struct.pack(order + "HHq", 14, 8, 100) + bytes(4)
    interface = block(order, 1, struct.pack(order + "HHI", 101, 0, 0) + options)
    packet = ip_packets(b"\7\0\2\0ab")[0]
    padded = packet + bytes(-len(packet) % 4)
    stamp = (ticks >> 32, ticks & 0xFFFF_FFFF, len(packet), len(packet))
    enhanced = block(order, 6, struct.pack(order + "IIIII", 0, *stamp) + padded)
    old = block(order, 2, struct.pack(order + "HHIIII", 0, 0, *stamp) + padded)
    simple = block(order, 3, struct.pack(order + "I", len(packet)) + padded)
    path = tmp_path / "made.pcapng"
    path.write_bytes(section + interface + enhanced + block(order, 0xBAD, b"what") + simple + old)
    take = read_take(path)
    assert [d.payload for d in take] == [b"\7\0\2\0ab"] * 2
    assert take.metadata.clock_offset_ns == 101_500_000_000


def test_second_section_may_have_another_byte_order(tmp_path: Path) -> None:
    parts = b""
    packet = ip_packets(b"\7\0\0\0")[0]
    for order in "<>":
        parts += block(order, 0x0A0D0D0A, struct.pack(order + "IHHq", 0x1A2B3C4D, 1, 0, -1))
        parts += block(order, 1, struct.pack(order + "HHI", 101, 0, 0))
        parts += block(order, 6, struct.pack(order + "IIIII", 0, 0, 7, len(packet), len(packet)) + packet)
    (tmp_path / "two.pcapng").write_bytes(parts)
    assert len(list(read_take(tmp_path / "two.pcapng"))) == 2


ETHERNET = bytes(12) + b"\x08\x00"


@pytest.mark.parametrize(
    ("link_type", "header"),
    [
        (1, ETHERNET),
        (1, bytes(12) + b"\x81\x00\x00\x05" + b"\x08\x00"),
        (113, bytes(14) + b"\x08\x00"),
        (276, b"\x08\x00" + bytes(18)),
        (0, struct.pack("<I", 2)),
        (0, struct.pack(">I", 2)),
        (101, b""),
    ],
    ids=["ethernet", "vlan", "cooked", "cooked 2", "loopback", "loopback of a big-endian machine", "raw"],
)
def test_every_link_type_gives_the_same_datagram(tmp_path: Path, link_type: int, header: bytes) -> None:
    path = tmp_path / "made.pcap"
    path.write_bytes(pcap([header + part for part in ip_packets(FRAME)], link_type))
    assert list(read_take(path)) == [Datagram(0.0, "in", "data", SERVER, FRAME)]


def test_fragments_are_put_together_in_any_order_and_a_missing_one_is_told(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path, parts = tmp_path / "made.pcap", ip_packets(FRAME)
    assert len(parts) == 3
    lacking = ip_packets(FRAME, destination=("10.0.0.10", 40000))[:2]
    path.write_bytes(pcap([parts[2], parts[0], *lacking, parts[1]], 101))
    assert [d.payload for d in read_take(path)] == [FRAME]
    assert "1 datagrams of which a fragment is missing" in caplog.text


def test_frames_to_several_clients_are_read_once(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    path, other = tmp_path / "made.pcap", ("10.0.0.10", 40001)
    packets = [ip_packets(FRAME, destination=to)[0:3] for to in (CLIENT, other, CLIENT, other, CLIENT)]
    path.write_bytes(pcap([part for parts in packets for part in parts], 101))
    assert len(list(read_take(path))) == 3
    assert "those to 10.0.0.9:40000 are read, 2 others left out" in caplog.text


def test_capture_without_natnet_says_so(tmp_path: Path) -> None:
    path = tmp_path / "dns.pcap"
    path.write_bytes(pcap(ip_packets(b"question", ("10.0.0.1", 53), ("10.0.0.9", 5000)), 101))
    with pytest.raises(InputError, match="no NatNet datagram"):
        read_take(path)


def test_cut_capture_gives_what_stood_before_the_cut(tmp_path: Path) -> None:
    data, path = motive_session().read_bytes(), tmp_path / "cut.pcapng"
    whole = list(read_take(motive_session()))
    for size in range(0, 8000, 13):
        path.write_bytes(data[:size])
        try:
            found = list(read_take(path))
        except InputError:
            continue
        assert found == whole[: len(found)]
    assert len(found) > 15


def test_mutated_capture_never_raises_anything_but_an_input_error(tmp_path: Path) -> None:
    rng, path = random.Random(3), tmp_path / "mutated.pcapng"
    whole = motive_session().read_bytes()[:6000]
    for _ in range(1000):
        data = bytearray(whole)
        for _ in range(rng.randint(1, 8)):
            data[rng.randrange(len(data))] = rng.choice((0, 1, 0x7F, 0xFF, rng.randrange(256)))
        path.write_bytes(data)
        with contextlib.suppress(InputError):
            assert len(list(read_take(path))) < 30


@given(st.binary(max_size=120))
def test_any_bytes_as_a_packet_are_counted_or_read(data: bytes) -> None:
    extractor = UdpExtractor()
    for link_type in (0, 1, 101, 113, 276):
        extractor(link_type, data)
    assert extractor.others + extractor.damaged + extractor.incomplete <= 5


def test_checksum_that_comes_out_as_zero_is_written_as_all_ones() -> None:
    """A UDP checksum of zero would mean that there is none (RFC 768)."""
    frames = [ethernet_frame(UdpPacket(SERVER, CLIENT, i.to_bytes(2, "big")), 0) for i in range(0x10000)]
    checksums = {frame[40:42] for frame in frames}
    assert b"\0\0" not in checksums
    assert b"\xff\xff" in checksums


def test_peer_without_an_ipv4_address_cannot_be_put_into_a_capture(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="no IPv4 address"):
        write_capture(tmp_path / "out.pcapng", [Datagram(0.0, "in", "data", ("fe80::1", 1511), b"")], METADATA)
