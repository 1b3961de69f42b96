"""Tests of `retarget.udp.natnet`."""
