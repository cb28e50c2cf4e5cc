"""A rotor that is heavier, seen from the joint, than stated."""

from tactile_cube.drivetrain.effects.effect import Array, Effect, Parameter, Place, Stage, View


class ReflectedInertia(Effect):
    """Rotor inertia beyond the nominal one, i^2 J, in joint space.

    Source: data sheets give J; gear ratios of 100 to 200 square its error.
    """

    name = "reflected_inertia"
    stage = Stage.MECHANISM
    parameters = (Parameter("excess", "kg m^2", 0.0, -0.003, 0.1, 0.003, "0.002-0.01 kg m^2"),)

    @staticmethod
    def configure(view: View, place: Place, p: Array) -> None:  # noqa: D102
        view("reflected_inertia")[..., place.joint] += p[..., 0]
