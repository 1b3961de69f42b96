"""Mirrors retarget.rig.display."""
