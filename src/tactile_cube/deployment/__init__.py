"""The trained policy on the robot: a 10 Hz controller and exported networks, without TorchRL."""
