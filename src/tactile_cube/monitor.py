"""`python -m tactile_cube.monitor`: see `tactile_cube.commands.monitor`."""

from tactile_cube.cli import command_line

main = command_line("monitor", __name__)
