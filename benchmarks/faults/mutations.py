"""Damage to files: bits and bytes as a disk or a transfer does it, words and numbers as people and programs do."""

import re
from collections.abc import Callable
from random import Random

NUMBER = re.compile(rb"(?<![\w.])[-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?")
WORD = re.compile(rb"[A-Za-z_][\w.]*")
VALUES = (
    *(b"nan", b".nan", b"inf", b"-.inf", b"1e308", b"-1e308", b"1e400", b"5e-324", b"0", b"-1", b"1e-12", b"123456"),
    *(b"99999999999999999999", b"9" * 5000, b"0x1F", b"1_000", b"1,5", b"2026-01-01", b"12:30:45", b"", b"''", b"~"),
    *(b"true", b"[]", b"{}", b"[1, 2]", b"{a: 1}", b"text", b"\xc3\xa9", b"\xff\xfe", b"\x00", b"../../etc/passwd"),
    *(b"&a [*a]", b"*b", b"!!python/name:os.system", b"[" * 3000, b"{a: " * 2000, b"${oc.env:HOME}", b"&lt;", b"%s"),
)
"""What may stand in the place of a number or a word."""


def damaged(content: bytes, random: Random) -> bytes:
    """The content with one to three damages."""
    for _ in range(random.choice((1, 1, 1, 2, 3))):
        content = random.choice(DAMAGES)(content, random)
    return content


def _flip(content: bytes, random: Random) -> bytes:
    changed = bytearray(content)
    for _ in range(random.choice((1, 1, 8))):
        if changed:
            changed[random.randrange(len(changed))] ^= 1 << random.randrange(8)
    return bytes(changed)


def _span(content: bytes, random: Random) -> tuple[int, int]:
    first = random.randrange(len(content) + 1)
    return first, min(len(content), first + random.choice((1, 4, 50, len(content))))


def _delete(content: bytes, random: Random) -> bytes:
    first, end = _span(content, random)
    return content[:first] + content[end:]


def _repeat(content: bytes, random: Random) -> bytes:
    first, end = _span(content, random)
    return content[:end] + content[first:end] + content[end:]


def _blank(content: bytes, random: Random) -> bytes:
    first, end = _span(content, random)
    return content[:first] + random.choice((b"\x00", b"\xff")) * (end - first) + content[end:]


def _insert(content: bytes, random: Random) -> bytes:
    at = random.randrange(len(content) + 1)
    return content[:at] + random.randbytes(random.choice((1, 3, 40))) + content[at:]


def _replace(pattern: re.Pattern[bytes]) -> Callable[[bytes, Random], bytes]:
    def replace(content: bytes, random: Random) -> bytes:
        found = list(pattern.finditer(content[:100_000]))
        if not found:
            return content
        spot = random.choice(found)
        other = random.choice(found).group()
        return content[: spot.start()] + random.choice((*VALUES, other, other)) + content[spot.end() :]

    return replace


def _lines(content: bytes, random: Random) -> bytes:
    lines = content.split(b"\n")
    one, other = random.randrange(len(lines)), random.randrange(len(lines))
    match random.randrange(4):
        case 0:
            del lines[one]
        case 1:
            lines.insert(other, lines[one])
        case 2:
            lines[one], lines[other] = lines[other], lines[one]
        case _:
            lines[one] = b"  " + lines[one]
    return b"\n".join(lines)


DAMAGES = (_flip, _delete, _repeat, _blank, _insert, _lines, *([_replace(NUMBER), _replace(WORD)] * 2))
