"""One model and its numbers: simulated in many short windows at once, compared with the data, fitted."""
