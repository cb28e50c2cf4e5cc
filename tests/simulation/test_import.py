import subprocess
import sys


def test_importing_the_simulation_prints_nothing() -> None:
    code = "import tactile_cube.simulation, sys; print('end', file=sys.stderr)"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120, check=True)
    assert run.stderr == "end\n"
    assert run.stdout == ""
