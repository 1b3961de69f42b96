"""Recording: what is handed over is in the file, whatever happens to the disk and the process."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
import time
from collections import Counter
from typing import TYPE_CHECKING

import pytest
from mcap.reader import make_reader
from mcap.stream_reader import StreamReader

from retarget.errors import OutputError
from retarget.take.message import TOPICS, unpack
from retarget.take.metadata import RECORD_NAME, TakeMetadata
from retarget.take.reader import read_take
from retarget.take.recorder import TakeRecorder
from tests.take.sessions import METADATA, made_up

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from retarget.udp.datagram import Datagram


def record(path: Path, datagrams: list[Datagram], metadata: TakeMetadata = METADATA) -> None:
    with TakeRecorder(path, metadata) as recorder:
        for datagram in datagrams:
            recorder(datagram)


def test_stock_mcap_reader_finds_every_datagram_metadata_and_attachment(tmp_path: Path) -> None:
    datagrams, path = made_up(3000), tmp_path / "take.mcap"
    with TakeRecorder(path, METADATA) as recorder:
        recorder.attach("models.bin", "application/octet-stream", b"marker names")
        for datagram in datagrams:
            recorder(datagram)
    channels = {topic: name for name, topic in TOPICS.items()}
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        found = [(channel, message) for _, channel, message in reader.iter_messages(log_time_order=False)]
        summary, attachments = reader.get_summary(), list(reader.iter_attachments())
        [metadata] = [record.metadata for record in reader.iter_metadata() if record.name == RECORD_NAME]
    with path.open("rb") as file:
        kinds = Counter(type(record).__name__ for record in StreamReader(file, validate_crcs=True).records)
    assert kinds["Message"] == len(datagrams)
    assert kinds["ChunkIndex"] * 2 >= kinds["MessageIndex"] > 0
    assert [unpack(message.data, channels[channel.topic]) for channel, message in found] == datagrams
    assert [message.log_time for _, message in found] == [round(d.received_s * 1e9) + 10**18 for d in datagrams]
    assert summary is not None
    assert summary.statistics is not None
    assert summary.statistics.message_count == len(datagrams)
    assert metadata["layout"] == "face24"
    assert [a.data for a in attachments] == [b"marker names"]


def test_stock_mcap_reader_finds_a_time_range_through_the_index(tmp_path: Path) -> None:
    datagrams, path = made_up(3000), tmp_path / "take.mcap"
    record(path, datagrams)
    start, end = 10**18 + 1010 * 10**9, 10**18 + 1012 * 10**9
    with path.open("rb") as file:
        messages = make_reader(file).iter_messages(starting_at=start, ending_before=end)
        stamps = [message.log_time for _, _, message in messages]
    assert len(stamps) == 240
    assert stamps == sorted(stamps)


def test_take_reads_back_what_was_recorded(tmp_path: Path) -> None:
    datagrams, path = made_up(2000), tmp_path / "take.mcap"
    record(path, datagrams)
    take = read_take(path)
    assert list(take) == datagrams
    assert take.metadata == METADATA
    assert take.counts == {"command": 200, "data": 1800}
    assert take.cut == ""


def test_datagrams_reach_the_file_while_recording_goes_on(tmp_path: Path) -> None:
    datagrams, path = made_up(20), tmp_path / "take.mcap"
    with TakeRecorder(path, METADATA) as recorder:
        for datagram in datagrams:
            recorder(datagram)
        deadline = time.monotonic() + 10.0
        while recorder.recorded < len(datagrams) and time.monotonic() < deadline:
            time.sleep(0.01)
        assert list(read_take(path)) == datagrams


def test_datagrams_of_two_threads_keep_their_order_and_none_is_lost(tmp_path: Path) -> None:
    path, halves = tmp_path / "take.mcap", (made_up(5000, seed=1), made_up(5000, seed=2))
    with TakeRecorder(path, METADATA) as recorder:

        def hand_over(datagrams: list[Datagram]) -> None:
            for datagram in datagrams:
                recorder(datagram)

        threads = [threading.Thread(target=hand_over, args=(half,)) for half in halves]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    found = list(read_take(path))
    assert len(found) == 10_000
    for half in halves:
        own = set(half)
        assert [datagram for datagram in found if datagram in own] == half


def test_existing_take_is_never_overwritten(tmp_path: Path) -> None:
    path = tmp_path / "take.mcap"
    path.write_bytes(b"precious")
    with pytest.raises(OutputError, match="exists"):
        TakeRecorder(path, METADATA)
    assert path.read_bytes() == b"precious"


def test_folder_that_does_not_exist_is_said_in_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="cannot be written"):
        TakeRecorder(tmp_path / "nowhere" / "take.mcap", METADATA)


def test_disk_that_does_not_keep_up_ends_the_recording_loudly_and_keeps_what_came_before(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    datagrams, path = made_up(4000), tmp_path / "take.mcap"
    stalled, write = threading.Event(), os.write

    def slow_write(descriptor: int, data: bytes) -> int:
        stalled.wait(20.0)
        return write(descriptor, data)

    recorder = TakeRecorder(path, METADATA, memory_bytes=400_000)
    monkeypatch.setattr(os, "write", slow_write)
    for datagram in datagrams:
        recorder(datagram)
    assert recorder.failure is not None
    lost = recorder.unrecorded
    stalled.set()
    with pytest.raises(OutputError, match="too slow"):
        recorder.close()
    assert "does not keep up" in caplog.text
    assert 0 < lost < len(datagrams)
    take = read_take(path)
    assert take.cut == ""
    assert list(take) == datagrams[: len(datagrams) - lost]


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A disk of one megabyte."""
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=1m", "tmpfs", str(tmp_path)], capture_output=True, check=False
    )
    if mounted.returncode:
        pytest.skip("a small disk can only be mounted by root")
    yield tmp_path
    subprocess.run(["umount", "-l", str(tmp_path)], check=True)


def test_full_disk_is_said_and_what_was_written_is_kept(small_disk: Path, caplog: pytest.LogCaptureFixture) -> None:
    datagrams, path = made_up(20_000), small_disk / "take.mcap"
    with pytest.raises(OutputError, match="No space left"):
        record(path, datagrams)
    assert "No space left" in caplog.text
    found = list(read_take(path))
    assert 1000 < len(found) < len(datagrams)
    assert found == datagrams[: len(found)]


def test_full_disk_does_not_disturb_whoever_hands_datagrams_over(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> int:
        raise OSError(28, "No space left on device")

    recorder = TakeRecorder(tmp_path / "take.mcap", METADATA)
    monkeypatch.setattr(os, "write", refuse)
    for datagram in made_up(5000):
        recorder(datagram)
    with pytest.raises(OutputError, match="No space left"):
        recorder.close()
    assert recorder.recorded == 0
    assert recorder.unrecorded == 5000


CHILD = """
import sys, time
from pathlib import Path
from retarget.take.metadata import TakeMetadata
from retarget.take.recorder import TakeRecorder
from retarget.udp.datagram import Datagram

recorder = TakeRecorder(Path(sys.argv[1]), TakeMetadata())
while True:
    for _ in range(int(sys.argv[2])):
        now = time.monotonic()
        recorder(Datagram(now, "in", "data", ("127.0.0.1", 1511), now.hex().encode() * 30))
    sys.stdout.write(now.hex() + "\\n")
    sys.stdout.flush()
    time.sleep(0.004)
"""


def start_recording(path: Path, burst: int) -> subprocess.Popen[str]:
    command = [sys.executable, "-c", CHILD, str(path), str(burst)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, text=True)


def killed_after(child: subprocess.Popen[str], seconds: float) -> float:
    """Until when the child had handed datagrams over, by its own word [s, monotonic]."""
    assert child.stdout is not None
    with child, child.stdout:
        child.stdout.readline()
        time.sleep(seconds)
        child.kill()
        told = child.stdout.read().split("\n")
    return float.fromhex(told[-2])  # what follows the last line break may be cut


@pytest.mark.parametrize("burst", [1, 20], ids=["few datagrams", "many datagrams"])
def test_take_of_a_killed_process_lacks_no_more_than_a_quarter_of_a_second(tmp_path: Path, burst: int) -> None:
    """Ten processes die at different moments, five of them at work at a time."""
    losses = []
    for wave in range(2):
        paths = [tmp_path / f"{wave}{i}.mcap" for i in range(5)]
        children = [start_recording(path, burst) for path in paths]
        handed_over_until = [killed_after(child, 0.3 + 0.023 * wave) for child in children]
        for path, last in zip(paths, handed_over_until, strict=True):
            received = [datagram.received_s for datagram in read_take(path)]
            assert received == sorted(received)
            losses.append(last - received[-1])
    assert max(losses) < 0.25
