"""Identification from recordings with an object: the constants of the contact."""
