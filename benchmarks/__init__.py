"""Benchmarks of this project; nothing here is needed to use it."""
