"""`retarget doctor` as a user meets it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from click.testing import CliRunner, Result

from retarget.cli.main import main
from retarget.markers.c3d import read_c3d
from retarget.udp.natnet.playback import AtEnd
from retarget.udp.sockets import LOOPBACK, open_udp
from tests.cli.test_errors import TAKE
from tests.udp.natnet.broken import BrokenServer, Script, losing_every_tenth
from tests.udp.natnet.live import serve, take, url

if TYPE_CHECKING:
    from retarget.frames import MarkerFrame


def doctor(*arguments: str) -> Result:
    return CliRunner().invoke(main, ["doctor", "--seconds", "0.2", *arguments])


def sentence(result: Result) -> str:
    assert result.exit_code == 1, result.output
    lines = result.stderr.strip().splitlines()
    assert len(lines) == 1, result.stderr
    return lines[0]


@pytest.fixture
def nobody() -> str:
    """An address at which nobody is."""
    with open_udp() as free:
        return f"natnet://{LOOPBACK}:{free.address[1]}"


@pytest.fixture(scope="module")
def performance() -> list[MarkerFrame]:
    return list(read_c3d(Path(TAKE)))[:240]


@pytest.fixture
def card(tmp_path: Path) -> str:
    """A layout for the markers of `take`, and one that they do not have."""
    heads = "".join(f"marker0{i} = {{ head = true }}\n" for i in range(3))
    sites = 'marker03 = { site = "chin" }\nmarker04 = { site = "noseTip" }\nabsent = { site = "lipLower" }\n'
    path = tmp_path / "mine.toml"
    path.write_text(f'version = 1\nname = "mine"\n[markers]\n{heads}{sites}')
    return str(path)


def test_a_healthy_server_passes_to_the_last_step(performance: list[MarkerFrame]) -> None:
    with serve(performance, at_end=AtEnd.LOOP) as server:
        result = doctor(url(server))
    assert result.exit_code == 0, result.output
    assert result.stderr == ""
    lines = result.stdout.splitlines()
    steps = " ".join(line.split()[1] for line in lines if line.startswith("✓"))
    assert steps == "address answer stream version names frames markers clock losses layout"
    assert "face24: 24 of its 24 markers, which drive 20 of the 41 sites of the rig human" in result.stdout


def test_a_script_gets_every_step_with_its_outcome(performance: list[MarkerFrame]) -> None:
    with serve(performance, at_end=AtEnd.LOOP) as server:
        result = doctor(url(server), "--json")
        report = json.loads(result.stdout)
        assert report["source"] == url(server)
    assert result.exit_code == 0
    assert {step["outcome"] for step in report["steps"]} == {"passed"}
    assert set(report["steps"][0]) == {"name", "outcome", "found", "cause", "advice"}


def test_the_step_that_fails_is_named_with_its_cause_and_what_to_do(nobody: str) -> None:
    result = doctor(nobody)
    assert "the step 'answer'" in sentence(result)
    assert nobody in sentence(result)
    assert "✓ address" in result.stdout
    assert "✗ answer" in result.stdout
    assert "because the server is not running" in result.stdout
    assert "not examined: stream, version, names, frames, markers, clock, losses, layout" in result.stdout


def test_a_script_gets_the_failure_in_both_ways(nobody: str) -> None:
    result = doctor(nobody, "--json")
    steps = {step["name"]: step for step in json.loads(result.stdout)["steps"]}
    assert steps["answer"]["outcome"] == "failed"
    assert steps["layout"]["outcome"] == "skipped"
    assert "no program listens" in sentence(result)


def test_what_can_be_lived_with_is_no_failure(card: str) -> None:
    with BrokenServer(Script(version=(4, 9))) as server:
        result = doctor(server.url, "--layout", card)
    assert result.exit_code == 0
    assert "! version" in result.stdout
    assert "→ choose an older bitstream" in result.stdout


def test_lost_frames_are_told_and_the_layout_is_looked_at_all_the_same() -> None:
    with BrokenServer(Script(frame=losing_every_tenth)) as server:
        result = doctor(server.url)
    assert "'losses'" in sentence(result)
    assert "✗ layout" in result.stdout


def test_names_that_no_layout_has_fail_with_the_names() -> None:
    with serve(take(240), at_end=AtEnd.LOOP) as server:
        text = sentence(doctor(url(server)))
    assert "none of the 24 marker names is known: marker00" in text
    assert "--layout" in text


def test_a_layout_of_ones_own_is_examined_with_what_it_misses(card: str) -> None:
    with serve(take(240), at_end=AtEnd.LOOP) as server:
        result = doctor(url(server), "--layout", card)
    assert result.exit_code == 0, result.output
    assert "! layout" in result.stdout
    text = " ".join(result.stdout.split())
    assert "mine: 5 of its 6 markers, which drive 2 of the 41 sites of the rig human; missing: absent" in text


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (["take.c3d"], "not the address of a NatNet server"),
        (["natnet://127.0.0.1:9", "--layout", "nothing"], "no layout 'nothing'"),
        (["natnet://127.0.0.1:9", "--rig", "nobody"], "human"),
    ],
)
def test_wrong_arguments_are_told_before_anything_is_examined(arguments: list[str], word: str) -> None:
    result = doctor(*arguments)
    assert word in sentence(result)
    assert result.stdout == ""


def test_what_the_connection_says_itself_comes_only_when_asked_for() -> None:
    script = Script(tail=bytes(9))  # frames that cannot be read make the connection complain
    with BrokenServer(script) as server:
        assert len(doctor(server.url).stderr.splitlines()) == 1
        told = CliRunner().invoke(main, ["-v", "doctor", "--seconds", "0.2", server.url])
    assert len(told.stderr.splitlines()) > 1
