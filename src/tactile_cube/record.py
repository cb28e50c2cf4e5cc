"""`python -m tactile_cube.record`: see `tactile_cube.commands.record`."""

from tactile_cube.cli import command_line

main = command_line("record", __name__)
