"""The numbers that decide what a diagnosis answers, each stated once; conf/criteria holds them with their reasons."""

from __future__ import annotations

from dataclasses import dataclass

from tactile_cube.errors import InputError


@dataclass(frozen=True)
class Criteria:
    """Errors are in units of the sensor noise, shares are of squared errors, all on held-out trials.

    Attributes:
        floor: error at which nothing is left to explain, if it is no more at any joint.
        adequate: error that a model may have, at each joint too, to which nothing significant can be added.
        tolerated: error up to which an explanation is complete.
        far: error of what is no explanation by itself, and that a near miss by one effect may have.
        least_gain: share that an effect has to explain at least.
        large_gain: share that no chance explains; also the part of its own error in which a law may differ in detail.
        completing: share of what is left that a further effect has to explain.
        most_gain: share that needs hardly any proof.
        most: share of the excess error that has to be explained.
        nearly_whole: share from which on an explanation lacks a detail at most.
        detail: share below which more numbers of an effect follow something else.
        small_part: share of the base error that is a detail where little is left.
        significant: p-value of an effect, corrected for the effects that were judged beside it.
        significant_if_large: the same for a large gain.
        significant_if_most: the same for most of the error, or one effect for all of it.
        likely: p-value at which a richer explanation stays in the race.
        clear: difference of squared errors in units of the sensor's variance that is evidence at all.
        stands_out: standard deviations by which it stands out of its scatter.
        few_segments: held-out segments below which a large gain may be unproven.
        alike: difference of two models' predictions below which they are one law in practice.
        margin: part of a joint's limits (half its range, its speed, its torque) that a proposed command keeps free.
    """

    floor: float = 1.1
    adequate: float = 1.3
    tolerated: float = 1.6
    far: float = 4.0
    least_gain: float = 0.04
    large_gain: float = 0.25
    completing: float = 0.6
    most_gain: float = 0.75
    most: float = 0.9
    nearly_whole: float = 0.98
    detail: float = 0.002
    small_part: float = 0.005
    significant: float = 2e-4
    significant_if_large: float = 1e-3
    significant_if_most: float = 1e-2
    likely: float = 0.05
    clear: float = 12.0
    stands_out: float = 2.6
    few_segments: int = 60
    alike: float = 0.1
    margin: float = 0.1

    def __post_init__(self) -> None:
        """Refuse a margin that would let a command leave the limits.

        Raises:
            InputError: it is no part of them.
        """
        if not 0.0 <= self.margin < 1.0:
            raise InputError(f"criteria.margin={self.margin}: is no part of a limit; take 0 to below 1, such as 0.1")


STANDARD = Criteria()
"""What conf/criteria/standard.yaml says too."""
