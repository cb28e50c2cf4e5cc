"""How often the 95 % intervals of a blind round hold the number that its generator hid.

    python -m benchmarks.regression.intervals docs/results/data/rounds/sealed_1300000.jsonl.gz

Counted are the effects that an answer names at their joints, in all numbers that generator and catalogue call the same.
"""

import gzip
import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

OTHERWISE = {("coupling_error", "ratio"), ("friction_drift", "friction"), ("asymmetric_friction", "friction")}
"""Numbers that mean something else in the generator: a whole ratio, friction with the one that is stated."""


def held(line: dict[str, Any]) -> Iterator[tuple[str, bool]]:
    """Yield `effect.parameter` and whether its interval holds the truth, for one draw."""
    for truth in line["truth"]["effects"]:
        for found in line["diagnosis"]["effects"]:
            if found["name"] == truth["name"] and set(found["joints"]) == set(truth["joints"]):
                for name in found["parameters"].keys() & truth["parameters"].keys():
                    one = found["parameters"][name]
                    if (truth["name"], name) not in OTHERWISE and "low" in one:
                        yield f"{truth['name']}.{name}", one["low"] <= truth["parameters"][name] <= one["high"]


if __name__ == "__main__":
    lines = [json.loads(line) for line in gzip.decompress(Path(sys.argv[1]).read_bytes()).splitlines()]
    counted = [one for line in lines for one in held(line)]
    print(f"{sum(holds for _, holds in counted)} of {len(counted)} intervals hold the hidden number")
