"""Recall of a search's proposals: how often the hidden set of effects was among the sets that it judged.

    python -m benchmarks.regression.recall docs/results/data/rounds/sealed_1300000.jsonl.gz

Counted are the draws of a blind round whose effects the catalogue has, in its own form or in another author's. A set
holds the truth if each hidden effect is in it, by a right name and at its joints; it is the truth if no other law is.
"""

import gzip
import json
import sys
from collections import Counter
from pathlib import Path
from typing import Any


def laws(label: str) -> dict[str, set[str]]:
    """Return law -> joints of a set's label, such as `backlash(play)@q1 & payload(mass, distance)@q2`."""
    found: dict[str, set[str]] = {}
    for part in label.split(" & "):
        name, _, joints = part.partition("@")
        found.setdefault(name.partition("(")[0], set()).update(joints.split(","))
    return found


def holds(label: str, hidden: list[dict[str, Any]]) -> str:
    """Return `true` if a set is the hidden one, `larger` if it holds it beside other laws, else an empty string."""
    found = laws(label)
    names = [
        {
            name
            for name in truth.get("names", [truth["name"]])
            if name in found and (truth["any_joint"] or set(truth["joints"]) <= found[name])
        }
        for truth in hidden
    ]
    if not all(names):
        return ""
    return "true" if found.keys() <= set().union(*names) else "larger"


def reached(line: dict[str, Any]) -> str:
    """Return how far the search came with the hidden set of one draw."""
    hidden, ranking = line["truth"]["effects"], line["diagnosis"]["ranking"]
    judged = {holds(one["effects"], hidden) for one in ranking if one["held_out_error_over_noise"] is not None}
    if "true" in judged:
        return "judged"
    if "larger" in judged:
        return "judged within a larger set"
    return "fitted, not judged" if any(holds(one["effects"], hidden) for one in ranking) else "never fitted"


def counted(lines: list[dict[str, Any]]) -> Counter[str]:
    """Return how many draws came how far, of those with effects that the catalogue has."""
    known = [line for line in lines if all(one["in_catalogue"] for one in line["truth"]["effects"])]
    return Counter(reached(line) for line in known if line["truth"]["effects"])


if __name__ == "__main__":
    found = counted([json.loads(line) for line in gzip.decompress(Path(sys.argv[1]).read_bytes()).splitlines()])
    for words, draws in found.most_common():
        print(f"{draws:4d} of {found.total()}  {words}")
