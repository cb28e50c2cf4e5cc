"""Softness of the fingertips' skin."""

from tactile_cube.drivetrain.effects import Parameter
from tactile_cube.simulation.contact_effects.contact_effect import ContactEffect


class TipCompliance(ContactEffect):
    """Fingertip skin that gives way in proportion to the normal force.

    depth = compliance * normal force.

    In data: closing fingers go further with the force.
    Confused with: `elasticity` of the joints, without a contact sensor.
    """

    name = "tip_compliance"
    constant = "tip_compliance"
    parameters = (
        Parameter("compliance", "m/N", neutral=0.0, low=0.0, high=2e-3, typical=3e-4, source="stiffness 1e3..1e4 N/m"),
    )
