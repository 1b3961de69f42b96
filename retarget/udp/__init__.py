"""Datagrams and streams: codecs between bytes and values, sessions, and the one file that opens sockets."""
