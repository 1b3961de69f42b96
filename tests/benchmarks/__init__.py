"""Figures, each beside a peer in the same run where there is one. `python -m tests.benchmarks [NAME ...]`."""
