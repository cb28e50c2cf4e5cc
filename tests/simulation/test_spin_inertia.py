import numpy as np

from tactile_cube.hand import DLR_HAND2
from tactile_cube.hand.rigid_body import RigidBodyTree
from tactile_cube.simulation.drive import TENDON_DAMPING, TENDON_STIFFNESS, spin_inertia, spin_shares
from tactile_cube.simulation.options import SimulationOptions

SHARES = spin_shares(RigidBodyTree.from_urdf(DLR_HAND2.finger_urdf(0)))


def test_links_spin_with_their_share_of_the_rotors_inertia() -> None:
    np.testing.assert_allclose(spin_inertia(DLR_HAND2, SHARES, np.full(12, 6e-3))[2], [6e-3, 3e-3, 2e-3, 1e-3])


def test_the_tendon_is_stable_however_small_the_rotors_are() -> None:
    dt = SimulationOptions().dt
    j3, j4 = spin_inertia(DLR_HAND2, SHARES, np.zeros(12))[0, 2:]
    w = (j3 + 4 * j4) / (j3 * j4)
    assert TENDON_STIFFNESS * dt**2 * w + 2 * TENDON_DAMPING * dt * w < 4
