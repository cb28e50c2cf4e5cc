"""`python -m tactile_cube.evaluate`: see `tactile_cube.commands.evaluate`."""

from tactile_cube.cli import command_line

main = command_line("evaluate", __name__)
