"""Ramps of T_s, gravity and penalties; environments ask them for the conditions through set_progress."""

from tactile_cube.curriculum.ramps import LinearCurriculum, NoCurriculum, PerformanceCurriculum, Ramps

__all__ = ["LinearCurriculum", "NoCurriculum", "PerformanceCurriculum", "Ramps"]
