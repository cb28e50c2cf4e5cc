"""`python -m tactile_cube.deploy`: see `tactile_cube.commands.deploy`."""

from tactile_cube.cli import command_line

main = command_line("deploy", __name__)
