import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from tactile_cube.errors import InputError
from tactile_cube.simulation import native_library as module


@pytest.fixture
def empty_cache(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    monkeypatch.setattr(module, "cache_directory", lambda: tmp_path)
    return tmp_path


@pytest.mark.skipif(module.find_compiler() is None, reason="no C compiler here")
def test_several_processes_may_compile_at_once(empty_cache: Path) -> None:
    with ThreadPoolExecutor(4) as pool:
        built = list(pool.map(lambda _: module.native_library.__wrapped__(), range(4)))
    assert len(set(built)) == 1
    assert [file.name for file in empty_cache.iterdir()] == [built[0].name]


def test_without_a_compiler_the_error_says_what_to_do(empty_cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "find_compiler", lambda: None)
    with pytest.raises(InputError, match=r"choose simulation\.loop=python"):
        module.native_library.__wrapped__()


def test_a_compiler_that_fails_is_quoted(empty_cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "find_compiler", lambda: "/bin/false")
    with pytest.raises(InputError, match=r"/bin/false .* failed"):
        module.native_library.__wrapped__()


def test_importing_the_simulation_prints_nothing() -> None:
    code = "import tactile_cube.simulation, sys; print('end', file=sys.stderr)"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120, check=True)
    assert run.stderr == "end\n"
    assert run.stdout == ""
