"""Collect one iteration ahead, learn, measure, save, go on: the training loop and its parts."""
