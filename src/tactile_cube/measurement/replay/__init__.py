"""A recording's commands through a simulation, with the numbers of a model, read out as a log would."""
