"""Teach a torque-controlled hand to turn an object by touch alone, in a simulation that matches the measured hand."""
