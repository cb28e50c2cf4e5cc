"""Cases of contact with an answer from mechanics: how far each engine is from it at each accuracy setting."""

from benchmarks.mechanics.case import Answer, Case
from benchmarks.mechanics.creep import creep
from benchmarks.mechanics.impact import impact
from benchmarks.mechanics.lever import slide_and_spin, twist
from benchmarks.mechanics.pendulum import pendulum

CASES: dict[str, Case] = {
    "creep": creep,
    "twist": twist,
    "slide_and_spin": slide_and_spin,
    "hanging": pendulum,
    "impact": impact,
}
"""All cases by name, in the order of the table."""

__all__ = ["CASES", "Answer", "Case"]
