"""Fault injection: training runs, damaged files, attacks on the control loop, and growth over long runs."""
