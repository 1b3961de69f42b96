"""Poses become files for other programs."""
