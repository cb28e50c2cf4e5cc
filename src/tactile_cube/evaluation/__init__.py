"""Protocols of the paper, baselines, perturbations, and verdicts on how an episode went."""
