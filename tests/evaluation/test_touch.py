import numpy as np
import pytest

from tactile_cube.evaluation.episode_record import ContactTable
from tactile_cube.evaluation.verdict import finger_history, support, touched_faces, touching
from tests.evaluation.synthetic import SPOTS, contacts, episode


def test_standing_fingers_visit_the_faces_that_come_by() -> None:
    """The cube turns a full turn in -z under the ring finger at -y, which meets -y, +x, +y, -x and -y again."""
    history = finger_history(episode(angle=2 * np.pi), 0)
    assert history.faces == ("-y", "+x", "+y", "-x", "-y")
    assert history.face_changes == 4
    assert history.lifts == 0


def test_carried_fingers_stay_on_their_faces() -> None:
    record = episode(angle=1.5, carried=True)
    assert [finger_history(record, finger).faces for finger in range(4)] == [("-y",), ("+x",), ("+y",), ("-x",)]


def test_a_lift_counts_when_the_finger_comes_back() -> None:
    touch = np.ones((101, 4), dtype=bool)
    touch[20:25, 1] = touch[50:51, 1] = False  # comes back twice
    touch[80:, 2] = False  # never comes back
    touch[:10, 3] = False  # had not touched before
    record = episode(angle=0.0, touch=touch)
    assert [finger_history(record, finger).lifts for finger in range(4)] == [0, 2, 0, 0]


def test_a_brush_below_the_threshold_is_no_touch() -> None:
    spots = np.tile(SPOTS, (11, 1, 1))
    record = episode(steps=10, contacts=contacts(np.ones((11, 4), dtype=bool), spots, force=0.01))
    assert not touching(record).any()


def test_faces_are_told_apart_on_a_cuboid() -> None:
    """On a long cuboid a point far along x, but not at its end, belongs to the long side."""
    touch = np.zeros((2, 4), dtype=bool)
    touch[:, 0] = True
    spots = np.zeros((2, 4, 3))
    spots[:, 0] = [0.05, -0.04, 0.0]
    size = np.array([0.2, 0.08, 0.08])
    record = episode(angle=0.0, steps=1, contacts=contacts(touch, spots), cube_size=size)
    assert touched_faces(record).tolist() == [3, 3]


def table(*rows: tuple[int, int, bool, float]) -> ContactTable:
    """Contacts of step, finger, whether its tip touches, and normal force [N]."""
    step, finger, tip, force = (np.array(column) for column in zip(*rows, strict=True))
    nowhere = np.zeros((len(rows), 3))
    return ContactTable(step, finger, tip, nowhere, nowhere, force, np.zeros(len(rows)))


@pytest.mark.parametrize(
    ("rows", "expected"),
    [
        ([(1, 0, True, 1.0), (1, 1, True, 1.0), (1, 2, True, 2.0)], (0.5, 0.0, 0.0)),
        ([(1, 0, True, 1.0), (1, 0, True, 1.0), (1, 1, True, 1.0)], (0.0, 0.0, 0.0)),  # two tips, three points
        ([(1, 0, True, 1.0), (1, 1, True, 1.0), (1, 2, False, 2.0)], (0.0, 0.5, 0.5)),
        ([(1, 0, True, 3.0), (2, 0, False, 0.5), (2, 3, False, 0.5)], (0.0, 0.5, 0.25)),
        ([(0, 0, False, 9.0), (2, 0, True, 1.0)], (0.0, 0.0, 0.0)),  # the start does not count
        ([(1, 0, False, 0.01)], (0.0, 0.0, 1.0)),  # a brush bears all there is, and is no touch
        ([(1, 0, False, 0.015), (1, 0, False, 0.015)], (0.0, 0.5, 1.0)),  # two points of one touch
        ([(1, 0, True, 0.0)], (0.0, 0.0, 0.0)),
    ],
)
def test_what_bears_the_cube_in_two_steps(
    rows: list[tuple[int, int, bool, float]], expected: tuple[float, ...]
) -> None:
    found = support(episode(steps=2, contacts=table(*rows)))
    assert (found["tip_support"], found["link_contact"], found["link_force_share"]) == expected
