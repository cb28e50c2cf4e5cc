"""Which effects are missing: candidates, a first look, refits, held-out evidence, and what counts as simpler."""
