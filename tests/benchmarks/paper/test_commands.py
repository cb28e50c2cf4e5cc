"""The commands of `benchmarks.paper` and `benchmarks.gait` as one types them."""

import sys
from pathlib import Path

import pytest
import yaml

from benchmarks.gait import __main__ as gait
from benchmarks.paper import __main__ as paper
from benchmarks.paper import ship
from benchmarks.paper.model_card import read_card
from tactile_cube.evaluation.policy_path import SHIPPED
from tactile_cube.training.ledger import LEDGER


def typed(monkeypatch: pytest.MonkeyPatch, *words: str) -> None:
    monkeypatch.setattr(sys, "argv", ["command", *words])


def test_the_page_in_the_docs_is_the_one_that_the_command_writes(tmp_path, monkeypatch) -> None:
    page = tmp_path / "a" / "page.md"
    typed(monkeypatch, "--page", str(page))
    paper.main()
    assert page.read_text(encoding="utf-8") == (paper.RESULTS / "paper.md").read_text(encoding="utf-8")


def test_the_table_of_a_multirun_is_printed_and_runs_that_did_not_finish_are_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("a-seed0", "a-seed1"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "metrics.csv").write_text("steps,final_angle\n1500,0.5\n")
    (tmp_path / "a-seed0" / "finished.json").write_text("{}")
    typed(monkeypatch, "--sweeps", str(tmp_path))
    paper.main()
    said = capsys.readouterr().out
    assert "| a | > 0.002 (at 0.5 rad), > 0.002 (at 0.5 rad) |" in said
    assert said.endswith("not finished: a-seed1\n")


def test_a_policy_is_shipped_with_its_card(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ship, "SHIPPED", tmp_path)
    (tmp_path / LEDGER).write_text('{"steps": 9, "simulating_hours": 1.5, "learning_hours": 2, "wall_hours": 3}')
    typed(monkeypatch, "table", "--run", str(tmp_path), "--name", "mine", "--limits", "None known.")
    ship.main()
    assert (tmp_path / "mine.safetensors").read_bytes() == (SHIPPED / "table.safetensors").read_bytes()
    assert read_card(tmp_path / "mine.md")["CPU hours"].startswith("3.50")


def test_a_gait_is_searched_for_another_hand_and_task(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    words = ("task=table", "task.episode_steps=3", "--generations", "1", "--population", "4", "--worlds", "1")
    typed(monkeypatch, "hand=three_finger", *words, "--out", str(tmp_path))
    gait.main()
    assert len(yaml.safe_load((tmp_path / "gait.yaml").read_text())["gaits"]["phases"]) == 3
    assert (tmp_path / LEDGER).is_file()
