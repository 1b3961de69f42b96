"""Tests of the rigs that ship, and of the recipe of the default one."""
