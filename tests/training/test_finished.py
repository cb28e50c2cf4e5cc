"""A finished run is known by its settings, and left in peace."""

from pathlib import Path

from tactile_cube.training.finished import FILE, Finished

CONFIG = {"seed": 1, "training": {"steps": 100, "resume": "auto"}, "hidden": [16, 16]}


def finished(folder: Path) -> None:
    (folder / "policy.safetensors").touch()
    Finished("all 100 steps done", 100, 1.5, CONFIG).write(folder)


def test_the_same_settings_find_it(tmp_path: Path) -> None:
    assert Finished.of(tmp_path, CONFIG) is None
    finished(tmp_path)
    found = Finished.of(tmp_path, CONFIG | {"hidden": (16, 16)})
    assert found is not None
    assert (found.reason, found.steps, found.final_angle) == ("all 100 steps done", 100, 1.5)


def test_more_steps_starting_over_or_a_lost_policy_do_not(tmp_path: Path) -> None:
    finished(tmp_path)
    assert Finished.of(tmp_path, CONFIG | {"training": {"steps": 200, "resume": "auto"}}) is None
    never = CONFIG | {"training": {"steps": 100, "resume": "never"}}
    Finished("all 100 steps done", 100, 1.5, never).write(tmp_path)
    assert Finished.of(tmp_path, never) is None
    finished(tmp_path)
    (tmp_path / "policy.safetensors").unlink()
    assert Finished.of(tmp_path, CONFIG) is None


def test_a_damaged_file_counts_for_nothing(tmp_path: Path) -> None:
    finished(tmp_path)
    (tmp_path / FILE).write_text("{")
    assert Finished.of(tmp_path, CONFIG) is None
