"""Takes on disk: raw datagrams that survive a cut, network captures, and conversion between all that holds markers."""
