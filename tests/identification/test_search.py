import pytest

from tactile_cube.drivetrain.effects import find_effect
from tactile_cube.identification.candidates import Candidate, forms
from tactile_cube.identification.search import of_each

FIT = object()  # stands for a fit: the choice goes by order alone


@pytest.mark.parametrize(
    ("order", "count", "chosen"),
    [("aaabbcd", 3, "aabc"), ("aaab", 3, "aaab"), ("abcd", 2, "abc"), ("aabbb", 1, "aa")],
)
def test_no_effect_is_crowded_out_by_variants_of_another(order: str, count: int, chosen: str) -> None:
    effects = dict(zip("abcd", ("torque_bias", "cogging", "backlash", "joint_stop"), strict=True))
    letter = {name: key for key, name in effects.items()}
    pairs = [(Candidate(e, (f"q{k}",), forms(e)[0]), FIT) for k, e in enumerate(find_effect(effects[x]) for x in order)]
    kept = of_each(pairs, count)  # type: ignore[arg-type]
    assert "".join(letter[candidate.effect.name] for candidate, _ in kept) == chosen
    assert [c.joints for c, _ in kept] == sorted(c.joints for c, _ in kept)
