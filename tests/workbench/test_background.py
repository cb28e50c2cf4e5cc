"""A diagnosis in a process of its own."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tactile_cube.errors import InputError
from tactile_cube.identification.in_words import PARTIAL
from tactile_cube.measurement.recordings.recording import Recording
from tactile_cube.workbench.background import Diagnosing
from tests.workbench.small_bench import STRIBECK, partly_known


def test_an_answer_that_names_no_effect_for_certain_has_those_of_its_model(tmp_path: Path) -> None:
    running = Diagnosing(partly_known(tmp_path), None, (), 0, tmp_path / "found")
    found = running.wait()
    assert found is not None
    assert PARTIAL in found.text
    assert STRIBECK in found.effects
    assert [term.label for term in found.fitted.model.terms] == found.effects


def test_a_diagnosis_is_stopped_at_once(measured: Recording, tmp_path: Path) -> None:
    running = Diagnosing(measured, None, (), 0, tmp_path / "found")
    lines = running.lines()
    next(lines)
    began = time.monotonic()
    running.stop()
    rest = list(lines)
    assert running.found is None
    assert len(rest) < 5
    assert time.monotonic() - began < 5.0


RUNNING = """
import sys
from pathlib import Path
from tactile_cube.measurement.recordings.reading import read_recording
from tactile_cube.workbench.background import Diagnosing
if __name__ == "__main__":
    running = Diagnosing(read_recording(Path(sys.argv[1])), None, (), 0, Path(__file__).parent / "found")
    lines = running.lines()
    print(running._process.pid, next(lines), flush=True)
    running.wait()
"""


def test_a_diagnosis_ends_with_the_workbench_however_it_ends(measured: Recording, tmp_path: Path) -> None:
    (tmp_path / "running.py").write_text(RUNNING)
    words = [sys.executable, str(tmp_path / "running.py"), str(measured.folder)]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as workbench:
        assert workbench.stdout is not None
        diagnosis = int(workbench.stdout.readline().split()[0])
        os.kill(diagnosis, 0)
        workbench.kill()
        workbench.wait()
    for _ in range(100):
        if not _runs(diagnosis):
            return
        time.sleep(0.1)
    os.kill(diagnosis, signal.SIGKILL)
    pytest.fail("the diagnosis outlives its workbench")


def _runs(process: int) -> bool:
    state = Path(f"/proc/{process}/stat")
    return state.exists() and state.read_text().rpartition(")")[2].split()[0] != "Z"


def test_what_diagnose_refuses_is_raised_here(measured: Recording, tmp_path: Path) -> None:
    running = Diagnosing(measured.with_trials(measured.trials[:1]), None, (), 0, tmp_path / "found")
    with pytest.raises(InputError, match="1 trial in all"):
        running.wait()
