"""`python -m tactile_cube.export`: see `tactile_cube.commands.export`."""

from tactile_cube.cli import command_line

main = command_line("export", __name__)
