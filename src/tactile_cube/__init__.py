"""Teach a torque-controlled hand to turn an object by touch alone, in a simulation that matches the measured hand."""

import sys

if "gymnasium" in sys.modules:  # only then can anybody ask Gymnasium for the environment; importing it here costs 0.2 s
    from tactile_cube.registration import register

    register()
