"""Completion of `python -m tactile_cube.<command>` in bash."""

import os
import shutil
import subprocess
import sys

import pytest

from tactile_cube.command_help import install_script

COMPLETE = """
eval "$({python} -m tactile_cube.train -sc install=bash)"
COMP_LINE="{python} -m tactile_cube.train {line}"
_tactile_cube_complete
echo "${{COMPREPLY[@]}}"
"""


@pytest.mark.skipif(shutil.which("bash") is None, reason="needs bash")
@pytest.mark.parametrize(("line", "expected"), [("task=t", ["task=table"]), ("agent=sac agent.gam", ["agent.gamma="])])
def test_bash_completes_options_and_keys(line: str, expected: list[str]) -> None:
    script = COMPLETE.format(python=sys.executable, line=line)
    run = subprocess.run(["bash", "-c", script], env=dict(os.environ), capture_output=True, text=True, timeout=60)
    assert run.stdout.split() == expected, run.stderr


def test_only_bash_installation_is_ours() -> None:
    assert install_script(["-sc", "install=bash"])
    assert install_script(["-sc", "query=bash"]) is None
    assert install_script(["task=table"]) is None
