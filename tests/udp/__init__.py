"""Tests of `retarget.udp`."""
