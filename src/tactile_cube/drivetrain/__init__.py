"""From a desired joint angle to a joint torque: target filter, impedance law, elasticity, dry friction, effects."""

from tactile_cube.drivetrain.constants import DrivetrainConstants, check_damping_stability, damping_number
from tactile_cube.drivetrain.plant import Plant

__all__ = ["DrivetrainConstants", "Plant", "check_damping_stability", "damping_number"]
