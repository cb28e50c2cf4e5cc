"""Many episodes in a few numbers: success with an interval, angles, verdicts, and the table on the terminal."""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import mannwhitneyu

from tactile_cube.evaluation.protocol import UNCHANGED
from tactile_cube.evaluation.verdict import SUCCESS, EpisodeResult, EpisodeVerdict

NO_PROPERTY = ("seed", "force_seed")  # seeds: their size has no physical meaning
SIGNIFICANT = 0.05  # for all constants together: one false name in twenty evaluations
LEAST = 5  # episodes lost and kept, below which no test can tell


@dataclass(frozen=True)
class Summary:
    """Summary of a set of episodes: mostly means of the values that `EpisodeResult` has under the same names.

    Attributes:
        mean_angle: of the final angles, as `std_angle`, `median_angle` and `best_angle` are [rad].
        low_angle: below which their lowest tenth lies [rad].
        success_means: what success is, in words.
        success_low: lower end of the 95 % interval of the success rate; `success_high`: upper end.
        kept: episodes that ended with the cube in the hand.
        rate: mean of final angle over duration [rad/s].
        drift: median [m/s].
        verdicts: how often each verdict was given.
        exploits: how often each exploit was found.
    """

    episodes: int
    mean_angle: float
    std_angle: float
    median_angle: float
    low_angle: float
    best_angle: float
    successes: int
    success_means: str
    success_low: float
    success_high: float
    kept: int
    rate: float
    finger_lifts: float
    tip_support: float
    link_contact: float
    link_force_share: float
    rise: float
    drift: float
    reward_terms: dict[str, float]
    verdicts: dict[str, int]
    exploits: dict[str, int]


def summarise(results: Sequence[EpisodeResult]) -> Summary:
    """Return the numbers of a set of episodes."""

    def mean(values: Sequence[float]) -> float:
        return float(np.mean(values))

    angles = np.array([result.final_angle for result in results])
    successes = sum(result.success for result in results)
    low, high = wilson_interval(successes, len(results))
    return Summary(
        episodes=len(results),
        mean_angle=float(angles.mean()),
        std_angle=float(angles.std()),
        median_angle=float(np.median(angles)),
        low_angle=float(np.quantile(angles, 0.1)),
        best_angle=float(angles.max()),
        successes=successes,
        success_means=SUCCESS,
        success_low=low,
        success_high=high,
        kept=sum(result.kept for result in results),
        rate=mean([result.final_angle / max(result.duration, 1e-9) for result in results]),
        finger_lifts=mean([sum(result.finger_lifts) for result in results]),
        tip_support=mean([result.tip_support for result in results]),
        link_contact=mean([result.link_contact for result in results]),
        link_force_share=mean([result.link_force_share for result in results]),
        rise=mean([result.rise for result in results]),
        drift=float(np.median([result.drift for result in results])),
        reward_terms={name: mean([one.reward_terms[name] for one in results]) for name in results[0].reward_terms},
        verdicts={verdict.value: sum(result.verdict == verdict for result in results) for verdict in EpisodeVerdict},
        exploits=dict(Counter(name for result in results for name in result.exploits)),
    )


def wilson_interval(successes: int, trials: int, z: float = 1.96) -> tuple[float, float]:
    """Return the 95 % interval of a rate; unlike the normal one it holds at 0 and 1, and for few trials.

    Source: Wilson, J. Am. Stat. Assoc. 22 (1927).
    """
    rate, square = successes / trials, z * z / trials
    middle = (rate + square / 2) / (1 + square)
    half = z / (1 + square) * math.sqrt(rate * (1 - rate) / trials + square / (4 * trials))
    return max(0.0, middle - half), min(1.0, middle + half)


HEADER = (
    f"{'run':>4} {'angle':>8} {'late':>6} {'time':>7}  {'verdict':<17}{'ending':<12}{'lifts':>6}{'faces':>9}{'tilt':>7}"
    f"{'rise':>6}{'tips':>6}{'links':>7}{'force':>7}  exploits\n"
    "(angle, and late: its part in the last 40 % [rad]; time [s]; tilt [deg]; rise: height above the start then [mm];\n"
    "contacts at 10 Hz [%]: time with three or more tips on the cube, with another link on it, its part of the force)"
)


def row(result: EpisodeResult, name: str = UNCHANGED) -> str:
    """Return an episode as a line of text; the variant's name is added where it changes something."""
    faces = "/".join(str(count) for count in result.faces_visited)
    measured = f"{result.final_angle:8.2f} {result.late_angle:6.2f} {result.duration:7.1f}"
    ending = "kept" if result.kept else result.ending
    counted = f"{sum(result.finger_lifts):6d}{faces:>9}{math.degrees(result.max_tilt):7.1f}{1e3 * result.rise:6.1f}"
    touched = f"{100 * result.tip_support:6.0f}{100 * result.link_contact:7.0f}{100 * result.link_force_share:7.0f}"
    remarks = f"{', '.join(result.exploits) or '-'}{'' if name == UNCHANGED else f'   [{name}]'}"
    return f"{result.episode:4d} {measured}  {result.verdict.value:<17}{ending:<12}{counted}{touched}  {remarks}"


def sentence(name: str, summary: Summary) -> str:
    """Return a summary: kept, successful and what that means, angles; then contacts, verdicts and reward."""
    verdicts = ", ".join(f"{count} {name.replace('_', ' ')}" for name, count in summary.verdicts.items() if count)
    terms = ", ".join(f"{name} {value:.1f}" for name, value in summary.reward_terms.items() if value)
    return (
        f"{name}: {summary.kept}/{summary.episodes} kept, {summary.successes}/{summary.episodes} successful (95 %: "
        f"{100 * summary.success_low:.0f} to {100 * summary.success_high:.0f} %; {summary.success_means}), "
        f"median {summary.median_angle:.2f} rad, lowest tenth below {summary.low_angle:.2f}, mean "
        f"{summary.mean_angle:.2f} +- {summary.std_angle:.2f}, best {summary.best_angle:.2f}\n"
        f"  three or more tips on the cube {100 * summary.tip_support:.0f} % of the time, another link "
        f"{100 * summary.link_contact:.0f} %, with {100 * summary.link_force_share:.0f} % of the normal force; the "
        f"cube {1e3 * summary.rise:.0f} mm above its start late on, median drift {1e3 * summary.drift:.2f} mm/s; "
        f"{summary.finger_lifts:.1f} finger lifts\n"
        f"  {verdicts}; reward {sum(summary.reward_terms.values()):.0f}: {terms}"
    )


@dataclass(frozen=True)
class LostWhere:
    """A constant of the world that separates kept objects from lost ones.

    Attributes:
        constant: its name.
        p_value: Mann-Whitney's, times the number of constants that were drawn.
        edges: lowest value, the two that divide the episodes into thirds, and highest [SI].
        kept: objects kept in each third, from the lowest values on.
        episodes: in each third.
    """

    constant: str
    p_value: float
    edges: tuple[float, ...]
    kept: tuple[int, ...]
    episodes: tuple[int, ...]

    @property
    def text(self) -> str:
        """The finding in words."""
        thirds = zip(self.kept, self.episodes, self.edges[:-1], self.edges[1:], strict=True)
        parts = (f"{kept} of {count} at {low:.3g} to {high:.3g}" for kept, count, low, high in thirds)
        return f"kept by {self.constant}: {', '.join(parts)} (p {self.p_value:.1e})"


def drawn(results: Sequence[EpisodeResult]) -> list[str]:
    """Return the constants that differ between the worlds of the episodes."""
    first = results[0].world
    numbers = [name for name, value in first.items() if isinstance(value, float) and name not in NO_PROPERTY]
    return [name for name in numbers if any(result.world[name] != first[name] for result in results)]


def lost_where(results: Sequence[EpisodeResult]) -> list[LostWhere]:
    """Return constants that separate kept objects from lost ones, surest first; none where too few were lost or kept.

    Source of the test: Mann and Whitney, Annals of Mathematical Statistics 18 (1947).
    """
    kept, names = np.array([result.kept for result in results]), drawn(results)
    found = []
    for name in names if min(kept.sum(), (~kept).sum()) >= LEAST else ():
        values = np.array([float(result.world[name]) for result in results])
        p_value = min(1.0, len(names) * float(mannwhitneyu(values[kept], values[~kept]).pvalue))
        if p_value < SIGNIFICANT:
            thirds = np.array_split(np.argsort(values, kind="stable"), 3)
            edges = tuple(float(values[k]) for k in (thirds[0][0], *(third[-1] for third in thirds)))
            counts, sizes = (tuple(int(of(third)) for third in thirds) for of in (lambda t: kept[t].sum(), len))
            found.append(LostWhere(name, p_value, edges, counts, sizes))
    return sorted(found, key=lambda one: one.p_value)
