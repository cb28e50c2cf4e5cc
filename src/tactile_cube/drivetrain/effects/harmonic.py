"""The parameter by which an effect says how often it repeats with the position."""

from tactile_cube.drivetrain.effects.effect import Parameter


def harmonic(source: str) -> Parameter:
    """Repetitions in 2 pi rad of the joint [1/rad]; its scale moves a ripple by part of a period at the range's end."""
    return Parameter("harmonic", "1/rad", neutral=10.0, low=1.0, high=250.0, typical=10.0, source=source, scale=0.5)
