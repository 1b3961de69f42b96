"""Mirrors retarget.rig."""
