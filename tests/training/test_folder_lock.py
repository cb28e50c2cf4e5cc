from pathlib import Path

import pytest

from tactile_cube.errors import InputError
from tactile_cube.training.folder_lock import lock_folder


def test_a_second_run_in_the_same_folder_is_refused_until_the_first_ends(tmp_path: Path) -> None:
    first = lock_folder(tmp_path)
    with pytest.raises(InputError, match=f"{tmp_path}: another process trains"):
        lock_folder(tmp_path)
    first.release()
    lock_folder(tmp_path).release()
