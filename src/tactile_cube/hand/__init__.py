"""The mechanism: the hand's geometry, masses and limits, its kinematics and its URDF description."""

from tactile_cube.hand.dlr_hand2 import DLR_HAND2, published_hand
from tactile_cube.hand.gait import Gait
from tactile_cube.hand.hand import Hand
from tactile_cube.hand.kinematics import grasp_angles, tip_positions
from tactile_cube.hand.urdf_hand import hand_from_urdf

__all__ = ["DLR_HAND2", "Gait", "Hand", "grasp_angles", "hand_from_urdf", "published_hand", "tip_positions"]
