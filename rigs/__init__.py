"""Rigs that ship with retarget, one folder each: rig.toml, the mesh as GLB, its licence."""
