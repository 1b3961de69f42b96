"""Tests mirror the packages; the truth comes from outside."""
