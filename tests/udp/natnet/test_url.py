"""Addresses of NatNet servers."""

import pytest

from retarget.errors import InputError
from retarget.udp.natnet.url import NatNetUrl, parse_natnet_url
from retarget.udp.natnet.version import Bitstream


def test_a_host_is_enough() -> None:
    assert parse_natnet_url("natnet://192.168.1.10") == NatNetUrl("192.168.1.10")
    assert parse_natnet_url("natnet://capture-pc:1600/") == NatNetUrl("capture-pc", 1600)


def test_without_a_host_the_network_is_searched() -> None:
    assert parse_natnet_url("natnet://").host is None
    assert parse_natnet_url("natnet://?local=10.0.0.5") == NatNetUrl(None, local="10.0.0.5")


def test_every_option_is_read() -> None:
    url = "natnet://10.0.0.2:1512?multicast=239.1.2.3&local=10.0.0.5&data_port=9000&bitstream=3.1"
    assert parse_natnet_url(url) == NatNetUrl(
        "10.0.0.2", 1512, multicast=True, group="239.1.2.3", local="10.0.0.5", data_port=9000,
        bitstream=Bitstream(3, 1),
    )  # fmt: skip
    announced = parse_natnet_url("natnet://10.0.0.2?multicast=1")
    assert announced.multicast
    assert announced.group is None


@pytest.mark.parametrize(
    ("url", "word"),
    [
        ("natnet://h?interface=10.0.0.5", "'interface' is not known"),
        ("natnet://h?local=eth0", "local='eth0'"),
        ("natnet://h?multicast=yes", "multicast='yes'"),
        ("natnet://h?data_port=0", "port '0'"),
        ("natnet://h?data_port=1e3", "port '1e3'"),
        ("natnet://h?data_port=1511&data_port=1512", "given twice"),
        ("natnet://h:99999", "not an address"),
        ("natnet://h:0", "port '0'"),
        ("natnet://h?bitstream=4.9", "4.9"),
        ("natnet://h/live", "not the address of a NatNet server"),
        ("natnet://me@h", "not the address of a NatNet server"),
        ("udp://h", "not the address of a NatNet server"),
    ],
)
def test_what_cannot_be_used_is_named(url: str, word: str) -> None:
    with pytest.raises(InputError) as error:
        parse_natnet_url(url)
    assert word in str(error.value)
