"""`python -m tactile_cube.workbench`."""

from tactile_cube.cli import command_line

main = command_line("workbench")

if __name__ == "__main__":
    main()
