"""Allocator settings."""

import subprocess
import sys

import pytest

CODE = """
import resource, torch
from tactile_cube.training.heap import keep_freed_memory
torch.set_num_threads(1)
{call}
def faults():
    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    for _ in range(20): torch.ones(4_000_000)
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before
faults()
print(faults())
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="a matter of glibc")
def test_large_tensors_are_made_again_without_new_pages() -> None:
    faults = {}
    for call in ("", "keep_freed_memory()"):
        run = subprocess.run(
            [sys.executable, "-c", CODE.format(call=call)], capture_output=True, text=True, timeout=120, check=True
        )
        faults[call] = int(run.stdout)
    assert faults["keep_freed_memory()"] < 100 or faults["keep_freed_memory()"] < 0.1 * faults[""]
