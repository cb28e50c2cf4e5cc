"""Numbers as a reader wants them: three digits, no powers of ten."""


def short(value: float) -> str:
    """Three significant digits: 0.0471, 12.3, 382."""
    return f"{value:.0f}" if abs(value) >= 99.95 else f"{value:.3g}"


def mrad(value: float) -> str:
    """An angle [rad] in mrad."""
    return f"{short(1e3 * value)} mrad"


def p_value(value: float) -> str:
    """A probability; very small ones are only said to be small."""
    return "< 0.001" if value < 1e-3 else f"{value:.3f}"
