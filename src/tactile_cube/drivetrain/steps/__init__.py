"""What every step of a chain computes; loaded by `kernel` once for each plant, with a generated module `plant`."""
