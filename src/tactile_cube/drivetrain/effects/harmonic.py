"""The number of repetitions of an effect in a turn of its joint."""

from tactile_cube.drivetrain.effects.effect import Parameter


def harmonic(source: str) -> Parameter:
    """Return the parameter `harmonic`: repetitions in 2 pi rad of the joint [1/rad].

    Its scale is a change that moves the ripple by a part of a period at the end of the range.
    """
    return Parameter("harmonic", "1/rad", neutral=10.0, low=1.0, high=250.0, typical=10.0, source=source, scale=0.5)
