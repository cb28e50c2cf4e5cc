"""Find which physical effect a model lacks: multiple shooting, screening of the catalogue, held-out validation."""
