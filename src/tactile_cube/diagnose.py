"""`python -m tactile_cube.diagnose`: see `tactile_cube.commands.diagnose`."""

from tactile_cube.cli import command_line

main = command_line("diagnose", __name__)
