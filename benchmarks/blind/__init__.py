"""Blind rounds: effects hidden in worlds that share no code with the package, diagnosed by its commands, scored."""
