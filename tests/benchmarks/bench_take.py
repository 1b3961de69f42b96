"""Takes: how fast they are recorded and read, how soon a place in an hour is reached; the peer is the stock library."""

from __future__ import annotations

import logging
import tempfile
import threading
import time
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

from retarget.frames import MarkerLayout
from retarget.markers.clip import MarkerClip
from retarget.take.convert import write_take
from retarget.take.decode import frames
from retarget.take.encode import datagrams_of
from retarget.take.message import ENCODING, TOPICS, pack
from retarget.take.metadata import TakeMetadata
from retarget.take.reader import read_take
from retarget.take.recorder import TakeRecorder
from retarget.udp.datagram import Datagram
from tests.benchmarks.report import Row, seconds_per_call

if TYPE_CHECKING:
    from collections.abc import Iterator

MESSAGES = 60_000
RATE_HZ = 240.0
HOUR_S = 3600.0


def rows() -> Iterator[Row]:
    """Recording, reading and seeking."""
    logging.getLogger("retarget.take").setLevel(logging.CRITICAL)  # the queue is meant to grow here
    payloads = _payloads()
    with tempfile.TemporaryDirectory() as folder:
        datagrams = _at_rate(payloads, MESSAGES, 50_000.0)
        yield _recording(Path(folder) / "recorded.mcap", datagrams)
        yield _handing_over(Path(folder) / "handed.mcap", datagrams)
        yield _reading(Path(folder) / "recorded.mcap")
        yield _decoding(Path(folder) / "decoded.mcap")
    with tempfile.TemporaryDirectory() as folder:
        yield from _hour(Path(folder) / "hour.mcap", payloads)


def _payloads() -> list[bytes]:
    """Frames of bitstream 4.1 with 24 moving markers."""
    rng = np.random.default_rng(4)
    positions = rng.normal(size=(1, 24, 3)) + np.cumsum(rng.normal(scale=1e-3, size=(500, 24, 3)), axis=0)
    clip = MarkerClip(MarkerLayout("face", tuple(f"m{i}" for i in range(24))), RATE_HZ, positions, Path("face"))
    return [datagram.payload for datagram in datagrams_of(clip) if datagram.channel == "data"]


def _at_rate(payloads: list[bytes], count: int, rate_hz: float) -> list[Datagram]:
    peer = ("127.0.0.1", 1511)
    return [Datagram(i / rate_hz, "in", "data", peer, payloads[i % len(payloads)]) for i in range(count)]


def _recording(path: Path, datagrams: list[Datagram]) -> Row:
    start = time.perf_counter()
    with TakeRecorder(path, TakeMetadata()) as recorder:
        for datagram in datagrams:
            recorder(datagram)
    ours = len(datagrams) / (time.perf_counter() - start)
    if recorder.recorded != len(datagrams):
        raise RuntimeError("The recorder lost datagrams")
    peer = _stock_recording(path.with_name("stock.mcap"), datagrams)
    return Row("record, LZ4 chunks of 64 KiB", ours, "datagrams/s", "mcap", peer, aim="50,000")


def _stock_recording(path: Path, datagrams: list[Datagram]) -> float:
    start = time.perf_counter()
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=64 * 1024, compression=CompressionType.LZ4)
        writer.start()
        channel = writer.register_channel(TOPICS["data"], ENCODING, 0)
        for datagram in datagrams:
            stamp = round(datagram.received_s * 1e9)
            writer.add_message(channel, stamp, pack(datagram), stamp)
        writer.finish()  # type: ignore[no-untyped-call]
    return len(datagrams) / (time.perf_counter() - start)


def _handing_over(path: Path, datagrams: list[Datagram]) -> Row:
    """How long the receiver's thread is held up by one datagram at 4 x 240 Hz, while another thread computes."""
    busy = threading.Event()
    other = threading.Thread(target=_compute_until, args=(busy,), daemon=True)
    other.start()
    delays = []
    with TakeRecorder(path, TakeMetadata()) as recorder:
        for datagram in datagrams[:2000]:
            start = time.perf_counter()
            recorder(datagram)
            delays.append(time.perf_counter() - start)
            time.sleep(1 / 960)
    busy.set()
    other.join()
    return Row("hand over while another thread computes, p99", float(np.percentile(delays, 99)) * 1e6, "us")


def _compute_until(done: threading.Event) -> None:
    while not done.is_set():
        sum(range(10_000))


def _reading(path: Path) -> Row:
    start = time.perf_counter()
    count = sum(1 for _ in read_take(path))
    ours = count / (time.perf_counter() - start)
    start = time.perf_counter()
    with path.open("rb") as file:
        peer = sum(1 for _ in make_reader(file, validate_crcs=True).iter_messages()) / (time.perf_counter() - start)
    return Row("read with checksums", ours, "datagrams/s", "mcap", peer)


def _decoding(path: Path) -> Row:
    rng = np.random.default_rng(5)
    clip = MarkerClip(
        MarkerLayout("face", tuple(f"m{i}" for i in range(24))), RATE_HZ, rng.normal(size=(5000, 24, 3)), path
    )
    write_take(path, datagrams_of(clip), TakeMetadata())
    start = time.perf_counter()
    count = sum(1 for _ in frames(read_take(path)))
    return Row("decode a take to marker frames", count / (time.perf_counter() - start), "frames/s")


def _hour(path: Path, payloads: list[bytes]) -> Iterator[Row]:
    """An hour at 240 Hz in chunks of a tenth of a second, as a live recording has them."""
    _write_hour(path, payloads)
    yield Row("an hour of 24 markers at 240 Hz on disk", path.stat().st_size / 1e6, "MB")
    yield Row("open that hour", seconds_per_call(lambda: read_take(path), 3, 1) * 1e3, "ms", *_stock_opening(path))
    take = read_take(path)
    rng = np.random.default_rng(6)

    def seek() -> None:
        next(take.seek(float(rng.uniform(0, HOUR_S))))

    def stock_seek() -> None:
        with path.open("rb") as file:
            next(make_reader(file).iter_messages(starting_at=int(rng.uniform(0, HOUR_S) * 1e9)))

    peer = seconds_per_call(stock_seek, 3, 1) * 1e3
    yield Row("seek in it, once open", seconds_per_call(seek, 100, 5) * 1e3, "ms", "mcap, from closed", peer)
    with path.open("r+b") as file:
        file.truncate(path.stat().st_size - 5_000_000)
    yield Row("open it cut, by walking its chunks", seconds_per_call(lambda: read_take(path), 3, 0) * 1e3, "ms")


def _stock_opening(path: Path) -> tuple[str, float]:
    def read_summary() -> None:
        with path.open("rb") as file:
            make_reader(file).get_summary()

    return "mcap", seconds_per_call(read_summary, 3, 1) * 1e3


def _write_hour(path: Path, payloads: list[bytes]) -> None:
    from retarget.take.append_file import AppendFile
    from retarget.take.mcap_writer import TakeBytes

    writer, file = TakeBytes(TakeMetadata(clock_offset_ns=0)), AppendFile(path)
    file.append(writer.opening())
    stream = iter(_at_rate(payloads, int(HOUR_S * RATE_HZ), RATE_HZ))
    while chunk := list(islice(stream, int(RATE_HZ / 10))):
        file.append(writer.chunk(chunk))
    file.append(writer.closing())
    file.close()
