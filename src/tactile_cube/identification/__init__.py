"""Finding which physical effect a model lacks: fit by multiple shooting, screen the catalogue, decide on held-out trials."""
