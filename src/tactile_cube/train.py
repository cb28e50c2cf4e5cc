"""`python -m tactile_cube.train`: see `tactile_cube.commands.train`."""

from tactile_cube.cli import command_line

main = command_line("train", __name__)
