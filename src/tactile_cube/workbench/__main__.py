"""`python -m tactile_cube.workbench`."""

from tactile_cube.workbench import main

if __name__ == "__main__":
    main()
