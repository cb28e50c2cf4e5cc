"""A file is whole or as it was before, and readable by whom the umask says."""

import os
from pathlib import Path

import pytest

from tactile_cube.whole_file import write_whole


def test_contents_and_mode(tmp_path: Path) -> None:
    before = os.umask(0o027)
    try:
        write_whole(tmp_path / "a", b"one ", memoryview(b"two"))
    finally:
        os.umask(before)
    assert (tmp_path / "a").read_bytes() == b"one two"
    assert (tmp_path / "a").stat().st_mode & 0o777 == 0o640


def test_a_write_that_fails_leaves_what_was_there_and_nothing_else(tmp_path: Path) -> None:
    write_whole(tmp_path / "a", b"before")
    with pytest.raises(TypeError):
        write_whole(tmp_path / "a", b"half", "no bytes")  # type: ignore[arg-type]
    assert (tmp_path / "a").read_bytes() == b"before"
    assert [path.name for path in tmp_path.iterdir()] == ["a"]


def test_a_link_in_the_place_of_the_draft_is_not_followed(tmp_path: Path) -> None:
    (tmp_path / "other").write_text("theirs")
    (tmp_path / "a.partial").symlink_to(tmp_path / "other")
    write_whole(tmp_path / "a", b"mine")
    assert (tmp_path / "other").read_text() == "theirs"
    assert (tmp_path / "a").read_bytes() == b"mine"
