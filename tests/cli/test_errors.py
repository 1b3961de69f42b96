"""Bad input: one sentence that names the thing, and exit status 1; wrong usage: 2."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from retarget.cli.main import main
from retarget.performer import save_performer
from retarget.rig.load import load_rig
from retarget.udp.sockets import open_udp
from tests.synthetic.face import face_layout, make_face

TAKE = str(Path(__file__).parents[2] / "takes" / "demo.c3d")


def retarget(*arguments: str) -> Result:
    return CliRunner().invoke(main, arguments)


def sentence(result: Result) -> str:
    assert result.exit_code == 1, result.output
    assert "Traceback" not in result.output
    lines = result.stderr.strip().splitlines()
    assert len(lines) == 1
    return lines[0]


def test_a_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    assert "no file" in sentence(retarget("run", str(tmp_path / "none.c3d"), "--to", str(tmp_path / "p.csv")))


def test_a_file_that_is_no_c3d_is_refused(tmp_path: Path) -> None:
    (tmp_path / "junk.c3d").write_bytes(bytes(range(256)) * 20)
    assert "not a C3D file" in sentence(retarget("run", str(tmp_path / "junk.c3d"), "--to", str(tmp_path / "p.csv")))


def test_a_source_of_unknown_kind_lists_the_known_ones(tmp_path: Path) -> None:
    (tmp_path / "take.xyz").touch()
    assert "natnet://HOST, udp://:PORT, camera:0" in sentence(retarget("run", str(tmp_path / "take.xyz")))


def test_a_sink_of_unknown_kind_lists_the_known_ones() -> None:
    assert "window, *.csv, *.mp4" in sentence(retarget("run", TAKE, "--to", "out.xyz"))


@pytest.mark.parametrize("name", ["p.csv", "p.mp4"])
def test_an_output_that_cannot_be_written_is_named(tmp_path: Path, name: str) -> None:
    target = str(tmp_path / "absent" / name)
    assert target in sentence(retarget("run", TAKE, "--to", target))


def test_an_unknown_rig_lists_those_there_are() -> None:
    assert "human" in sentence(retarget("run", TAKE, "--rig", "nobody", "--to", "p.csv"))


def test_a_truncated_glb_tells_how_much_is_missing(tmp_path: Path) -> None:
    whole = (load_rig("human").path.parent / "human.glb").read_bytes()
    (tmp_path / "face.glb").write_bytes(whole[:5000])
    text = sentence(retarget("run", TAKE, "--rig", str(tmp_path / "face.glb"), "--to", "p.csv"))
    assert f"{len(whole)} bytes" in text
    assert "5000" in text


def test_a_misspelt_key_of_a_performer_is_named_with_its_neighbour(tmp_path: Path) -> None:
    face = make_face(load_rig("human"), face_layout(), np.random.default_rng(1))
    path = tmp_path / "ana.toml"
    save_performer(face.performer, path)
    path.write_text(path.read_text().replace("scale =", "skale ="))
    text = sentence(retarget("run", TAKE, "--performer", str(path), "--to", str(tmp_path / "p.csv")))
    assert "skale" in text
    assert "scale" in text


def test_nobody_at_the_address_says_what_to_check() -> None:
    with open_udp("127.0.0.1", 0) as silent:
        text = sentence(retarget("run", f"natnet://127.0.0.1:{silent.address[1]}", "--to", "p.csv"))
    assert "Nobody answers" in text
    assert "firewall" in text


def test_a_port_in_use_is_named() -> None:
    with open_udp("127.0.0.1", 0) as taken:
        port = taken.address[1]
        assert str(port) in sentence(retarget("replay", TAKE, "--port", str(port)))


def test_markers_that_the_rig_does_not_know_are_listed_with_those_expected(tmp_path: Path) -> None:
    import ezc3d

    take = ezc3d.c3d()
    take["parameters"]["POINT"]["RATE"]["value"] = [100]
    take["parameters"]["POINT"]["UNITS"]["value"] = ["mm"]
    take["parameters"]["POINT"]["LABELS"]["value"] = ["LKNE", "RKNE"]
    take["data"]["points"] = np.ones((4, 2, 5))
    take.write(str(tmp_path / "legs.c3d"))
    text = sentence(retarget("run", str(tmp_path / "legs.c3d"), "--to", str(tmp_path / "p.csv")))
    assert "LKNE, RKNE" in text
    assert "lipCornerLeft" in text


def test_a_window_without_a_screen_says_what_to_write_instead(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    assert "--to out.mp4" in sentence(retarget("run", TAKE))


@pytest.mark.parametrize(
    "arguments",
    [
        ("run", TAKE, "--size", "big"),
        ("run", TAKE, "--background", "300,0,0"),
        ("run", TAKE, "--framing", "feet"),
        ("run",),
        ("jump",),
        ("replay", TAKE, "--port", "70000"),
    ],
)
def test_wrong_usage_has_status_two(arguments: tuple[str, ...]) -> None:
    assert retarget(*arguments).exit_code == 2


def test_a_session_file_with_an_unknown_option_is_refused(tmp_path: Path) -> None:
    (tmp_path / "session.toml").write_text('siez = "320x240"\n')
    text = sentence(retarget("run", TAKE, "--config", str(tmp_path / "session.toml"), "--to", str(tmp_path / "p.csv")))
    assert "siez" in text
    assert "size" in text
