"""Markers in, a living face out."""
