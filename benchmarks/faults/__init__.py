"""Faults at random moments: what a training run, a file and a long life survive."""
