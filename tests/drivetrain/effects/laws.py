"""Effects that only tests use."""

from tactile_cube.drivetrain.effects import JOINT_TORQUE, POSITION, VELOCITY, Effect, Parameter, Stage


class CableDrag(Effect):
    """A spring to zero and a drag that the neighbour on the left feels."""

    name = "cable_drag"
    stage = Stage.JOINT_TORQUE
    parameters = (
        Parameter("stiffness", "N m/rad", 0.0, 0.0, 1.0, 0.1, "test"),
        Parameter("drag", "N m s/rad", 0.0, 0.0, 1.0, 0.1, "test"),
    )

    @staticmethod
    def law(x, j, p, s, dt):
        return x[JOINT_TORQUE, j] - p[0] * x[POSITION, j] - p[1] * x[VELOCITY, max(j - 1, 0)]


class HeavyTip(Effect):
    """A mass at the joint's own link."""

    name = "heavy_tip"
    stage = Stage.MECHANISM
    parameters = (Parameter("mass", "kg", 0.0, 0.0, 1.0, 0.05, "test"),)

    @staticmethod
    def configure(view, place, p):
        view("mass")[..., place.chain, place.link] += p[..., 0]


NOT_AN_EFFECT = 3
