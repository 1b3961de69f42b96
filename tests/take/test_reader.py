"""Takes that are whole, cut, damaged, foreign and empty."""

from __future__ import annotations

import random
from typing import TYPE_CHECKING

import pytest
from mcap.writer import CompressionType, Writer

from retarget.errors import InputError
from retarget.take.message import ENCODING, TOPICS, pack
from retarget.take.metadata import TakeMetadata
from retarget.take.reader import read_take
from tests.take.sessions import METADATA, made_up, write_chunks

if TYPE_CHECKING:
    from pathlib import Path

    from retarget.udp.datagram import Datagram


@pytest.fixture
def small_take(tmp_path: Path) -> tuple[Path, list[list[Datagram]], list[int]]:
    """A file of four chunks of seven datagrams, and the file's size after the opening and after each chunk."""
    datagrams, path = made_up(28, longest=40), tmp_path / "small.mcap"
    chunks = [datagrams[i : i + 7] for i in range(0, 28, 7)]
    return path, chunks, write_chunks(path, chunks)


def test_take_cut_at_every_byte_gives_all_whole_chunks_or_says_that_nothing_is_in_it(
    small_take: tuple[Path, list[list[Datagram]], list[int]], tmp_path: Path
) -> None:
    whole, chunks, sizes = small_take
    data, path = whole.read_bytes(), tmp_path / "cut.mcap"
    for size in range(len(data)):
        path.write_bytes(data[:size])
        expected = [d for chunk, end in zip(chunks, sizes[1:], strict=True) if end <= size for d in chunk]
        try:
            take = read_take(path)
        except InputError as error:
            told = str(error)
            assert not expected, told
            assert any(words in told for words in ("no datagram", "is empty", "does not start")), told
            continue
        found = list(take)
        assert found[: len(expected)] == expected
        assert len(found) - len(expected) in (0, 7)  # a chunk whose message index is cut is still whole
        assert sum(take.counts.values()) == len(found)
        assert "cut at byte" in take.cut


def test_cut_take_is_told_in_the_log(
    small_take: tuple[Path, list[list[Datagram]], list[int]], caplog: pytest.LogCaptureFixture
) -> None:
    path, _, sizes = small_take
    path.write_bytes(path.read_bytes()[: sizes[3] + 20])
    take = read_take(path)
    assert take.cut in caplog.text
    assert "21 datagrams over 0.167 s" in take.cut
    assert take.duration_s == pytest.approx(20 / 120)


def test_cut_take_keeps_metadata_and_position_by_time(
    small_take: tuple[Path, list[list[Datagram]], list[int]],
) -> None:
    path, chunks, sizes = small_take
    path.write_bytes(path.read_bytes()[: sizes[3]])
    take = read_take(path)
    assert take.metadata == METADATA
    assert list(take.seek(0.1)) == [d for chunk in chunks[:3] for d in chunk if d.received_s >= 1000.1]


def test_end_of_zeros_as_after_a_power_failure_is_left_out(
    small_take: tuple[Path, list[list[Datagram]], list[int]],
) -> None:
    path, chunks, sizes = small_take
    data = path.read_bytes()
    path.write_bytes(data[: sizes[3] + 60] + bytes(sizes[4] - sizes[3] - 60))
    assert list(read_take(path)) == [d for chunk in chunks[:3] for d in chunk]


def test_damaged_chunk_in_the_middle_is_skipped_with_a_word(
    small_take: tuple[Path, list[list[Datagram]], list[int]], caplog: pytest.LogCaptureFixture
) -> None:
    path, chunks, sizes = small_take
    data = bytearray(path.read_bytes())
    data[sizes[1] + 100] ^= 0x55
    path.write_bytes(data)
    take = read_take(path)
    assert list(take) == [*chunks[0], *chunks[2], *chunks[3]]
    assert f"at byte {sizes[1] + 9} are lost" in caplog.text


def test_damaged_index_is_made_up_for_by_walking_the_file(
    small_take: tuple[Path, list[list[Datagram]], list[int]],
) -> None:
    path, chunks, sizes = small_take
    data = bytearray(path.read_bytes())
    data[sizes[4] + 200] ^= 0x55
    path.write_bytes(data)
    assert list(read_take(path)) == [d for chunk in chunks for d in chunk]


def test_mutated_take_never_raises_anything_but_an_input_error(
    small_take: tuple[Path, list[list[Datagram]], list[int]], tmp_path: Path
) -> None:
    whole, rng, path = small_take[0].read_bytes(), random.Random(7), tmp_path / "mutated.mcap"
    opened = 0
    for _ in range(1500):
        data = bytearray(whole)
        for _ in range(rng.randint(1, 6)):
            data[rng.randrange(len(data))] = rng.choice((0, 1, 0x7F, 0xFF, rng.randrange(256)))
        path.write_bytes(data)
        try:
            take = read_take(path)
        except InputError:
            continue
        assert sum(1 for _ in take) <= 28
        opened += 1
    assert opened > 1000


@pytest.mark.parametrize("compression", [CompressionType.NONE, CompressionType.LZ4])
def test_take_written_with_the_stock_library_is_read(tmp_path: Path, compression: CompressionType) -> None:
    datagrams, path = made_up(500), tmp_path / "stock.mcap"
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=20_000, compression=compression)
        writer.start()
        channels = {name: writer.register_channel(topic, ENCODING, 0) for name, topic in TOPICS.items()}
        for datagram in datagrams:
            stamp = round(datagram.received_s * 1e9)
            writer.add_message(channels[datagram.channel], stamp, pack(datagram), stamp)
        writer.finish()  # type: ignore[no-untyped-call]
    take = read_take(path)
    assert list(take) == datagrams
    assert list(take.seek(3.0)) == [d for d in datagrams if d.received_s >= 1003.0]


def test_mcap_file_of_another_program_is_refused_by_name(tmp_path: Path) -> None:
    path = tmp_path / "robot.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        writer.add_message(writer.register_channel("/camera", "json", 0), 1, b"{}", 1)
        writer.finish()  # type: ignore[no-untyped-call]
    with pytest.raises(InputError, match=r"robot\.mcap is an MCAP file without NatNet datagrams"):
        read_take(path)


@pytest.mark.parametrize(("content", "words"), [(b"", "is empty"), (b"BVH HIERARCHY" * 50, "is no take")])
def test_empty_file_and_garbage_are_one_sentence(tmp_path: Path, content: bytes, words: str) -> None:
    path = tmp_path / "take.mcap"
    path.write_bytes(content)
    with pytest.raises(InputError, match=words):
        read_take(path)


def test_missing_file_is_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="No such file"):
        read_take(tmp_path / "none.mcap")


def test_recording_of_silence_says_that_nothing_is_in_it(tmp_path: Path) -> None:
    path = tmp_path / "silence.mcap"
    write_chunks(path, [])
    with pytest.raises(InputError, match="no datagram"):
        read_take(path)


def test_seek_gives_the_same_datagrams_as_reading_all_up_to_there(tmp_path: Path) -> None:
    datagrams, path = made_up(1000), tmp_path / "take.mcap"
    datagrams[300], datagrams[420] = datagrams[420], datagrams[300]  # two receiving threads do not keep the order
    write_chunks(path, [datagrams[i : i + 40] for i in range(0, 1000, 40)])
    take = read_take(path)
    for time_s in (0.0, 1 / 120, 2.5, 3.1, 3.49, 8.0, 8.4):
        assert list(take.seek(time_s)) == [d for d in datagrams if d.received_s >= take.start_s + time_s]


def test_two_iterations_at_once_do_not_disturb_each_other(tmp_path: Path) -> None:
    datagrams, path = made_up(100), tmp_path / "take.mcap"
    write_chunks(path, [datagrams[:50], datagrams[50:]])
    take = read_take(path)
    assert list(zip(take, take.seek(0.0), strict=True)) == [(d, d) for d in datagrams]


def test_metadata_without_a_clock_offset_gets_the_present_one(tmp_path: Path) -> None:
    path = tmp_path / "take.mcap"
    write_chunks(path, [made_up(3)], TakeMetadata(performer="Ana"))
    metadata = read_take(path).metadata
    assert metadata.performer == "Ana"
    assert metadata.clock_offset_ns is not None
    assert metadata.clock_offset_ns > 10**18
