"""Numbers as a reader wants them."""


def p_value(value: float) -> str:
    """A probability; very small ones are only said to be small."""
    return "< 0.001" if value < 1e-3 else f"{value:.3f}"
