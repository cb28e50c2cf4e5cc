"""Small recordings made from known seeds, each with the answer that a diagnosis is to give."""
