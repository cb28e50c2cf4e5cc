"""Finding which physical effect a model lacks: fit by multiple shooting, screen the catalogue, judge on others."""
