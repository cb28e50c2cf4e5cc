"""How soft the skin of the fingertips is."""

from tactile_cube.drivetrain.effects import Parameter
from tactile_cube.simulation.contact_effects.contact_effect import ContactEffect


class TipCompliance(ContactEffect):
    """A fingertip gives way in proportion to the normal force."""

    name = "tip_compliance"
    constant = "tip_compliance"
    parameters = (
        Parameter("compliance", "m/N", neutral=0.0, low=0.0, high=2e-3, typical=3e-4, source="stiffness 1e3..1e4 N/m"),
    )
