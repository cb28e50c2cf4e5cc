"""`python -m tactile_cube.average`: see `tactile_cube.commands.average`."""

from tactile_cube.cli import command_line

main = command_line("average", __name__)
