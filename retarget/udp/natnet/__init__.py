"""NatNet, bitstream 2.5 to 4.3, both directions."""
