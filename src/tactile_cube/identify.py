"""`python -m tactile_cube.identify`."""

from tactile_cube.cli import command_line

main = command_line("identify")

if __name__ == "__main__":
    main()
