"""The blind rounds of key.yaml, all kinds side by side, at the commit that is checked out.

    python -m benchmarks.blind.rounds --out outputs/rounds

Each kind gets a few draws in turn, so that a round that ends early has all of them. The same command goes on where it
stopped. It runs nothing where a file of the key is not the one that was committed with it: `--seal` writes the key's
sums anew, for rounds that are still to be drawn.
"""

import argparse
import hashlib
import re
import subprocess
import sys
from pathlib import Path

import yaml

HERE = Path(__file__).parent
KEY = HERE / "key.yaml"
AT_ONCE = 5
"""Draws of a kind before the next kind has its turn."""


def sums() -> dict[str, str]:
    """SHA-256 of every file that makes the worlds or judges the answers."""
    return {file.name: hashlib.sha256(file.read_bytes()).hexdigest() for file in sorted(HERE.glob("*.py"))}


def changed(key: dict[str, dict[str, str]]) -> list[str]:
    """Files that are not those of the key."""
    now = sums()
    return sorted(name for name in {*now, *key["files"]} if now.get(name) != key["files"].get(name))


def main() -> None:
    """Draw what is not drawn yet."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("outputs/rounds"))
    key = yaml.safe_load(KEY.read_text())
    kinds = list(key["rounds"])
    parser.add_argument("--only", nargs="+", choices=kinds, default=kinds, help="another process may draw the others")
    parser.add_argument("--seal", action="store_true", help="write the sums of today's files into the key")
    args = parser.parse_args()
    if args.seal:
        head = KEY.read_text().partition("files:")[0]
        KEY.write_text(head + yaml.safe_dump({"files": sums()}))
        return
    if found := changed(key):
        sys.exit(f"error: {KEY}: {', '.join(found)} changed after the key; check out the commit that it came with")
    rounds = {name: words for name, words in key["rounds"].items() if name in args.only}
    most = max(int(re.search(r"--draws (\d+)", words)[1]) for words in rounds.values())  # type: ignore[index]
    for reached in range(AT_ONCE, most + AT_ONCE, AT_ONCE):
        for name, words in rounds.items():
            draws = int(re.search(r"--draws (\d+)", words)[1])  # type: ignore[index]
            if draws <= reached - AT_ONCE:
                continue
            part = re.sub(r"--draws \d+", f"--draws {min(draws, reached)}", words)
            command = [sys.executable, "-m", *part.split(), "--out", str(args.out / name)]
            print(f"{name}: {part}", flush=True)
            subprocess.run(command, check=False)  # a kind that fails leaves the others their turn


if __name__ == "__main__":
    main()
