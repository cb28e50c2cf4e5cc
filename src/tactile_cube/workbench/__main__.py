"""`python -m tactile_cube.workbench`."""

from tactile_cube.cli import command_line

main = command_line("workbench", __name__)
