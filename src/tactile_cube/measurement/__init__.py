"""Recordings of a rig: read, check, split, their noise floor, and how well a simulation follows them."""
