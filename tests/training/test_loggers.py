"""metrics.csv and TorchRL's loggers."""

import csv
import sys
from pathlib import Path

import pytest
from PIL import Image

from tactile_cube.errors import InputError
from tactile_cube.training.loggers import MetricsTable, log_film, open_logger


def rows(folder: Path) -> list[dict[str, str]]:
    with (folder / "metrics.csv").open() as file:
        return list(csv.DictReader(file))


def test_the_table_has_one_row_a_call_and_columns_that_come_later_too(tmp_path: Path) -> None:
    table = MetricsTable(tmp_path, resumed_at=0)
    table.add(10, {"angle": 0.5})
    table.add(20, {"angle": 1.0, "late": 3.0})
    table.add(30, {"angle": 2.0})
    assert [list(row.values()) for row in rows(tmp_path)] == [["10", "0.5", ""], ["20", "1", "3"], ["30", "2", ""]]
    table.close()


def test_rows_after_the_checkpoint_are_replaced(tmp_path: Path) -> None:
    table = MetricsTable(tmp_path, resumed_at=0)
    for steps in (10, 20, 30):
        table.add(steps, {"angle": float(steps)})
    table.close()
    again = MetricsTable(tmp_path, resumed_at=20)
    again.add(30, {"angle": 99.0})
    again.close()
    assert [row["angle"] for row in rows(tmp_path)] == ["10", "20", "99"]


def test_tensorboard_gets_every_curve(tmp_path: Path) -> None:
    from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

    logger = open_logger(tmp_path, 0, {}, backend="tensorboard")
    assert logger is not None
    logger.log_metrics({"angle": 0.5, "length": 7.0}, step=10)
    logger.close()
    events = EventAccumulator(str(tmp_path / "tensorboard"))
    events.Reload()
    assert sorted(events.Tags()["scalars"]) == ["angle", "length"]
    assert events.Scalars("angle")[0].value == 0.5


@pytest.mark.parametrize(("backend", "message"), [("wandb", "pip install"), ("neptune", "choose tensorboard")])
def test_a_missing_logger_is_told(backend: str, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "wandb", None)
    monkeypatch.setattr("torchrl.record.loggers.wandb._has_wandb", False)
    with pytest.raises(InputError, match=rf"logger\.backend={backend}: .*{message}"):
        open_logger(tmp_path, 0, {}, backend=backend)


def test_weights_and_biases_gets_a_run_for_each_seed_and_stage_with_its_settings_and_films(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("wandb")
    monkeypatch.setenv("WANDB_MODE", "offline")
    frames = [Image.new("RGB", (16, 16), colour) for colour in ("red", "blue")]
    frames[0].save(tmp_path / "film.gif", save_all=True, append_images=frames[1:])

    def sent(folder: str, resumed_at: int = 0) -> tuple[str, str, str]:
        (tmp_path / folder).mkdir(parents=True, exist_ok=True)
        logger = open_logger(tmp_path / folder, resumed_at, {"agent": {"gamma": 0.9}}, backend="wandb")
        assert logger is not None
        logger.log_metrics({"angle": 0.5}, step=10)
        log_film(logger, tmp_path / "film.gif", 10)
        run = logger.experiment
        assert run.config["agent"] == {"gamma": 0.9}
        logger.close()
        assert list((tmp_path / folder).glob("wandb/offline-run-*/*.wandb"))
        return run.id, run.name, run.group

    first = sent("curriculum-seed0/gaiting")
    assert first[1:] == ("curriculum-seed0/gaiting", "curriculum-seed0")
    assert sent("curriculum-seed0/gaiting", resumed_at=10)[0] == first[0]
    others = ["curriculum-seed1/gaiting", "curriculum-seed0/holding", "again/curriculum-seed0/gaiting"]
    assert len({first[0], *(sent(other)[0] for other in others)}) == 4
