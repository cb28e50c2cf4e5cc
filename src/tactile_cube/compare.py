"""`python -m tactile_cube.compare`: see `tactile_cube.commands.compare`."""

from tactile_cube.cli import command_line

main = command_line("compare", __name__)
