"""Every command loads; that all other imports lead somewhere, mypy checks."""

import subprocess
import sys

from tactile_cube.command_help import commands


def test_every_command_can_be_imported() -> None:
    # in a process of its own: a command's module takes the place of the package's function of that name
    imports = "".join(f"from tactile_cube.{name} import main\nassert callable(main)\n" for name in commands())
    done = subprocess.run([sys.executable, "-c", imports], check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
