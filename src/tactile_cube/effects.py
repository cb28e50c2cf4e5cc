"""`python -m tactile_cube.effects`: see `tactile_cube.commands.effects`."""

from tactile_cube.cli import command_line

main = command_line("effects", __name__)
