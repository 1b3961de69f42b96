"""Pictures of films, folders and cameras; a camera is stood in for, and films are written by OpenCV."""

from __future__ import annotations

import threading
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import cv2
import numpy as np
import pytest

from retarget.camera.files import FilmPictures, FolderPictures
from retarget.camera.live import CameraPictures
from retarget.camera.pictures import open_pictures
from retarget.errors import ConnectionFailedError, InputError

if TYPE_CHECKING:
    from collections.abc import Callable


def film(path: Path, count: int = 10, rate_hz: float = 25.0) -> Path:
    """Grey pictures that grow brighter by 8 a picture."""
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), rate_hz, (64, 48))
    for i in range(count):
        writer.write(np.full((48, 64, 3), 8 * i, np.uint8))
    writer.release()
    return path


def test_a_film_is_read_whole_in_order_and_on_time(tmp_path: Path) -> None:
    with FilmPictures(film(tmp_path / "film.avi")) as pictures:
        assert (pictures.rate_hz, pictures.count, pictures.live) == (25.0, 10, False)
        read = list(pictures)
    assert [picture.number for picture in read] == list(range(10))
    assert [picture.time_s for picture in read] == pytest.approx(np.arange(10) / 25)
    assert [picture.image.mean() for picture in read] == pytest.approx(8 * np.arange(10), abs=3)


def test_a_stopped_film_gives_no_more_pictures(tmp_path: Path) -> None:
    with FilmPictures(film(tmp_path / "film.avi")) as pictures:
        read = []
        for picture in pictures:
            read.append(picture)
            pictures.stop()
    assert len(read) == 1


def test_a_film_that_is_absent_or_unreadable_is_told(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    broken = tmp_path / "broken.mp4"
    broken.write_bytes(b"this is not a film" * 100)
    with pytest.raises(InputError, match="cannot be read as a video"), FilmPictures(broken):
        pass
    with pytest.raises(InputError, match="no video file"), FilmPictures(tmp_path / "none.mp4"):
        pass
    assert "VIDEOIO" not in capfd.readouterr().err


def test_a_film_that_is_cut_short_gives_what_it_has(tmp_path: Path) -> None:
    whole = film(tmp_path / "film.avi", count=30)
    whole.write_bytes(whole.read_bytes()[: whole.stat().st_size // 2])
    with FilmPictures(whole) as pictures:
        assert 0 < len(list(pictures)) < 30


def test_the_pictures_of_a_folder_come_in_the_order_of_their_numbers(tmp_path: Path) -> None:
    for number in (10, 9, 2):
        cv2.imwrite(str(tmp_path / f"frame_{number}.png"), np.full((8, 8, 3), number, np.uint8))
    (tmp_path / "notes.txt").write_text("not a picture")
    with FolderPictures(tmp_path) as pictures:
        read = list(pictures)
    assert [picture.image[0, 0, 0] for picture in read] == [2, 9, 10]
    assert [picture.time_s for picture in read] == pytest.approx([0, 1 / 30, 2 / 30])


def test_a_folder_without_pictures_or_with_a_broken_one_is_told(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="holds no picture"), FolderPictures(tmp_path):
        pass
    (tmp_path / "broken.png").write_bytes(b"no")
    with FolderPictures(tmp_path) as pictures, pytest.raises(InputError, match=r"broken\.png cannot be read"):
        list(pictures)


class FakeCapture:
    """A camera that shows its count; `pictures` until it is unplugged."""

    def __init__(self, pictures: int = 10**9, opened: bool = True) -> None:
        self.left = pictures
        self.shown = 0
        self.opened = opened
        self.released = False
        self.pause_s = 0.001

    def isOpened(self) -> bool:
        return self.opened

    def get(self, _: int) -> float:
        return 30.0

    def read(self) -> tuple[bool, Any]:
        time.sleep(self.pause_s)
        if self.shown >= self.left:
            return False, None
        self.shown += 1
        return True, np.full((4, 4, 3), self.shown % 256, np.uint8)

    def release(self) -> None:
        self.released = True


def opener(capture: FakeCapture) -> Callable[[int], cv2.VideoCapture]:
    return cast("Callable[[int], cv2.VideoCapture]", lambda _: capture)


def test_of_a_cameras_pictures_the_newest_wins_and_the_others_are_counted() -> None:
    capture = FakeCapture()
    with CameraPictures(0, opener(capture)) as camera:
        assert (camera.live, camera.rate_hz, camera.count) == (True, 30.0, None)
        numbers = []
        for picture in camera:
            numbers.append(picture.number)
            time.sleep(0.02)
            assert time.monotonic() - picture.time_s < 1.0
            if len(numbers) == 5:
                camera.stop()
        assert camera.dropped > 5
        assert numbers == sorted(set(numbers))
    assert capture.released


def test_a_camera_that_is_unplugged_is_told() -> None:
    with CameraPictures(3, opener(FakeCapture(5))) as camera, pytest.raises(ConnectionFailedError, match="Camera 3"):
        list(camera)


def test_a_waiting_camera_can_be_stopped() -> None:
    capture = FakeCapture()
    capture.pause_s = 0.5
    with CameraPictures(0, opener(capture)) as camera:
        threading.Timer(0.05, camera.stop).start()
        assert list(camera) == []


def test_no_camera_and_a_busy_camera_are_told_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    closed = opener(FakeCapture(opened=False))
    with pytest.raises(ConnectionFailedError, match="no camera 77"), CameraPictures(77, closed):
        pass
    monkeypatch.setattr(Path, "exists", lambda _: True)
    with pytest.raises(ConnectionFailedError, match="another program may be using it"), CameraPictures(77, closed):
        pass


def test_a_machine_without_a_camera_says_so_in_one_sentence(capfd: pytest.CaptureFixture[str]) -> None:
    if Path("/dev/video99").exists():
        pytest.skip("this machine has a hundred cameras")
    with pytest.raises(ConnectionFailedError, match="There is no camera 99"), CameraPictures(99):
        pass
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize("where", ["camera:", "camera:x", "notes.txt", "camera:-1"])
def test_what_is_no_source_of_pictures_is_told(where: str) -> None:
    with pytest.raises(InputError, match="no source of pictures"):
        open_pictures(where)


def test_a_source_is_chosen_by_what_it_is(tmp_path: Path) -> None:
    assert isinstance(open_pictures("camera:1"), CameraPictures)
    assert isinstance(open_pictures("clip.MP4"), FilmPictures)
    assert isinstance(open_pictures(str(tmp_path)), FolderPictures)
