"""Tests of retarget.markers."""
