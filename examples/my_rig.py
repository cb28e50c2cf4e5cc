"""An effect of one's own, for docs/own_effect.md: the catalogue does not know it."""

from math import exp

from tactile_cube.drivetrain.effects import FRICTION, POSITION, Effect, Parameter, Stage


class CableDrag(Effect):
    """A cable in a sheath: the more the joint bends it, the harder it rubs (Euler and Eytelwein's rope on a drum)."""

    name = "cable_drag"
    stage = Stage.FRICTION
    parameters = (
        Parameter("tension", unit="N m", neutral=0.0, low=0.0, high=0.5, typical=0.02, source="spring balance"),
        Parameter("friction", unit="1/rad", neutral=1.5, low=0.2, high=4.0, typical=1.0, source="steel on steel"),
    )

    @staticmethod
    def law(x, j, p, s, dt):
        """Dry friction of joint j [N m]: what there is already, and the cable's share at this bend."""
        return x[FRICTION, j] + p[0] * (exp(p[1] * abs(x[POSITION, j])) - 1.0)
