"""`python -m tactile_cube.view`: see `tactile_cube.commands.view`."""

from tactile_cube.cli import command_line

main = command_line("view", __name__)
