"""Tests of retarget.filters."""
