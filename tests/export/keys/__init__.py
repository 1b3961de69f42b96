"""Key-frame reduction."""
