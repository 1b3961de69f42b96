"""Takes: the stock MCAP reader, Wireshark's own dissector, real captures and a killed process are the judges."""
