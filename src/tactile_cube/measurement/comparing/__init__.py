"""Measurement beside simulation: errors, where they are, the noise floor, and what is left in the residual."""
