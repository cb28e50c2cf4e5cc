"""Speed: the same work given to this package and to its peers, in turns, in one run."""
