"""The only sockets of this package."""

from retarget.udp.sockets.addresses import (
    LOOPBACK,
    Address,
    broadcast_address,
    is_loopback,
    local_address_towards,
    local_addresses,
    resolve,
)
from retarget.udp.sockets.probe import Probe, Refusal
from retarget.udp.sockets.tcp import TcpListener, TcpStream, connect_tcp, listen_tcp
from retarget.udp.sockets.udp import (
    MAX_DATAGRAM,
    Received,
    UdpSocket,
    open_broadcast,
    open_broadcast_receiver,
    open_multicast_receiver,
    open_multicast_sender,
    open_udp,
)
from retarget.udp.sockets.waiting import wait_readable

__all__ = [
    "LOOPBACK", "MAX_DATAGRAM", "Address", "Probe", "Received", "Refusal", "TcpListener", "TcpStream", "UdpSocket",
    "broadcast_address", "connect_tcp", "is_loopback", "listen_tcp", "local_address_towards", "local_addresses",
    "open_broadcast", "open_broadcast_receiver", "open_multicast_receiver", "open_multicast_sender", "open_udp",
    "resolve", "wait_readable",
]  # fmt: skip
