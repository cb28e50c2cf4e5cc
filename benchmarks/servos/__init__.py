"""Servos on a pendulum bench: published friction models beside ours, on runs that nothing was fitted to."""
