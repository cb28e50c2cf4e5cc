"""One model and its numbers: simulated in many short stretches at once, compared with the data, fitted."""
