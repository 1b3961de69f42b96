"""Landmarks, poses and measures, against other programs and known truth."""
