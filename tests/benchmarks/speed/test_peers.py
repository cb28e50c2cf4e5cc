"""Peers that are not there are named with the way to get them."""

import sys

import pytest

from benchmarks.speed.peers import find_peer


def test_a_missing_peer_is_noted_with_the_command_that_installs_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mujoco", None)
    missing: list[str] = []
    assert find_peer("mujoco", missing) is None
    assert missing == ["mujoco: not installed (pip install mujoco)"]
