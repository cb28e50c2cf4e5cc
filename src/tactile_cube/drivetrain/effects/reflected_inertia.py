"""A rotor that is heavier, seen from the joint, than stated."""

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Place, Stage, View


class ReflectedInertia(Effect):
    """Rotor that is heavier, seen from the joint, than stated.

    M_jj += excess, where the nominal rotor counts with i^2 J for the gear ratio i.

    In data: an error proportional to the acceleration.
    Confused with: `actuator_lag`, `command_delay`, `payload`.
    Source: data sheets give J; gear ratios of 100 to 200 square its error.
    """

    name = "reflected_inertia"
    stage = Stage.MECHANISM
    parameters = (Parameter("excess", "kg m^2", 0.0, -0.003, 0.1, 0.003, "0.002-0.01 kg m^2"),)

    @staticmethod
    def configure(view: View, place: Place, p: Array) -> None:
        """Add to the reflected inertia."""
        view("reflected_inertia")[..., place.joint] += p[..., 0]
