"""Offline makers: a performer out of two short takes. Imports `retarget`, never the reverse."""
