"""The face: rig file, joint mapping, jaw, skinning, display."""
