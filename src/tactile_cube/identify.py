"""`python -m tactile_cube.identify`: see `tactile_cube.commands.identify`."""

from tactile_cube.cli import command_line

main = command_line("identify", __name__)
