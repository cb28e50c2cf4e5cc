"""`tactile-cube COMMAND ...` and `python -m tactile_cube COMMAND ...`: as `python -m tactile_cube.COMMAND ...`."""

import sys

from tactile_cube.cli import command_line, fail, quiet_when_nobody_reads
from tactile_cube.composition import commands, suggestion
from tactile_cube.run_folder import USAGE_ERROR


@quiet_when_nobody_reads()
def main() -> None:
    """Run the command that the first word names; without one, say which there are."""
    known = commands()
    words = sys.argv[1:]
    if not words or words[0] in ("-h", "--help"):
        print("tactile-cube COMMAND [group=option] [key=value] ...\n\nCommands:")
        for name, summary in known.items():
            print(f"  {name:<{max(map(len, known))}} {summary}")
        print("\ntactile-cube COMMAND --help lists its groups and keys.")
        sys.exit(0 if words else USAGE_ERROR)
    if words[0] not in known:
        fail(f"{words[0]}: no such command; choose one of {', '.join(known)}{suggestion(words[0], known)}")
    sys.argv = [f"tactile_cube.{words[0]}", *words[1:]]
    command_line(words[0])()


if __name__ == "__main__":
    main()
