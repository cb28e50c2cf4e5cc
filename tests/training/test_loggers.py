"""metrics.csv and TensorBoard."""

import csv
import sys
from pathlib import Path

import pytest

from tactile_cube.errors import InputError
from tactile_cube.training.loggers import CsvLogger, TensorBoardLogger, WandbLogger


def rows(folder: Path) -> list[dict[str, str]]:
    with (folder / "metrics.csv").open() as file:
        return list(csv.DictReader(file))


def test_csv_has_one_row_a_call(tmp_path: Path) -> None:
    logger = CsvLogger(tmp_path, resumed_at=0)
    logger.log(10, {"angle": 0.5})
    logger.log(20, {"angle": 1.0, "late": 3.0})
    assert rows(tmp_path) == [{"steps": "10", "angle": "0.5"}, {"steps": "20", "angle": "1"}]
    logger.close()


def test_rows_after_the_checkpoint_are_replaced(tmp_path: Path) -> None:
    logger = CsvLogger(tmp_path, resumed_at=0)
    for steps in (10, 20, 30):
        logger.log(steps, {"angle": float(steps)})
    logger.close()
    again = CsvLogger(tmp_path, resumed_at=20)
    again.log(30, {"angle": 99.0})
    again.close()
    assert [row["angle"] for row in rows(tmp_path)] == ["10", "20", "99"]


def test_tensorboard_gets_every_curve(tmp_path: Path) -> None:
    from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

    logger = TensorBoardLogger(tmp_path, resumed_at=0)
    logger.log(10, {"angle": 0.5, "length": 7.0})
    logger.close()
    events = EventAccumulator(str(tmp_path / "tensorboard"))
    events.Reload()
    assert sorted(events.Tags()["scalars"]) == ["angle", "length"]
    assert events.Scalars("angle")[0].value == 0.5


def test_missing_weights_and_biases_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "wandb", None)
    with pytest.raises(InputError, match="pip install"):
        WandbLogger(tmp_path, resumed_at=0, config={})


def test_weights_and_biases_gets_a_run_for_each_seed_and_stage_with_its_settings(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("wandb")
    monkeypatch.setenv("WANDB_MODE", "offline")

    def sent(folder: str, resumed_at: int = 0) -> tuple[str, str, str]:
        (tmp_path / folder).mkdir(parents=True, exist_ok=True)
        logger = WandbLogger(tmp_path / folder, resumed_at, config={"agent": {"gamma": 0.9}})
        logger.log(10, {"angle": 0.5})
        assert logger._run.config["agent"] == {"gamma": 0.9}
        logger.close()
        assert list((tmp_path / folder).glob("wandb/offline-run-*/*.wandb"))
        return logger._run.id, logger._run.name, logger._run.group

    first = sent("curriculum-seed0/gaiting")
    assert first[1:] == ("curriculum-seed0/gaiting", "curriculum-seed0")
    assert sent("curriculum-seed0/gaiting", resumed_at=10)[0] == first[0]
    others = ["curriculum-seed1/gaiting", "curriculum-seed0/holding", "again/curriculum-seed0/gaiting"]
    assert len({first[0], *(sent(other)[0] for other in others)}) == 4
