"""Bodies in the plane: reading, measuring, converting, drawing."""
