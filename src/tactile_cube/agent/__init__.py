"""Soft actor-critic with an asymmetric critic: networks, losses and optimisers behind one `update(batch)`."""
