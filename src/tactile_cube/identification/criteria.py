"""Thresholds of a diagnosis; conf/criteria states them with their reasons."""

from dataclasses import dataclass

from tactile_cube.errors import InputError


@dataclass(frozen=True)
class Criteria:
    """Thresholds: errors in units of the sensor noise, shares of squared errors, all on held-out trials.

    Attributes:
        floor: error above which a joint is off, so that something is looked for there.
        adequate: error that a model may have to which nothing significant can be added.
        tolerated: error up to which an explanation is complete.
        least_gain: share that an effect has to explain at least; its price.
        detail: share of its own error by which a law may differ from the real one.
        band: standard deviations of the held-out difference from which on one set is worse than another.
        significant: probability that a named set is chance, all that was looked at counted.
        most: share of the excess error that an explanation explains at least; a further effect, of what is left.
        nearly_whole: share from which on it is the whole but for a detail.
        most_simulated: steps, times joints, that a search may simulate; then it ends with its best answer.
        margin: part of a joint's limits (half its range, its speed, its torque) that a proposed command keeps free.
    """

    floor: float = 1.1
    adequate: float = 1.3
    tolerated: float = 1.6
    least_gain: float = 0.04
    detail: float = 0.25
    band: float = 2.6
    significant: float = 0.01
    most: float = 0.9
    nearly_whole: float = 0.98
    most_simulated: float = 4.5e8
    margin: float = 0.1

    def __post_init__(self) -> None:
        """Refuse a margin that would let a command leave the limits.

        Raises:
            InputError: it is not a share from 0 to below 1.
        """
        if not 0.0 <= self.margin < 1.0:
            raise InputError(f"criteria.margin={self.margin}: not a share of a limit; give 0 to below 1, such as 0.1")


STANDARD = Criteria()  # the defaults, the same as in conf/criteria/standard.yaml
