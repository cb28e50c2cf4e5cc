"""From a desired joint angle to a joint torque: target filter, impedance law, elasticity, dry friction, effects."""

from tactile_cube.drivetrain.plant import DrivetrainConstants, Plant, check_damping_stability, damping_number

__all__ = ["DrivetrainConstants", "Plant", "check_damping_stability", "damping_number"]
