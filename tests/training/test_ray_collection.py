"""Workers of a Ray cluster: the bits of multi_sync, nobody else let in, nothing left behind."""

import socket
import subprocess
import sys
from pathlib import Path
from typing import Any

import psutil
import pytest
import torch

from tactile_cube.errors import InputError
from tactile_cube.training import ray_cluster
from tactile_cube.training.recovery import train_on
from tactile_cube.training.run import Run
from tests.training.test_loop import finish, weights
from tests.training.tiny_run import tiny_run

RAY: dict[str, Any] = {"kind": "ray", "processes": 2, "start_timeout": 200.0, "timeout": 60.0}
KILLED = """
import pathlib, sys
from tests.training.test_ray_collection import RAY
from tests.training.tiny_run import tiny_run
run = tiny_run(pathlib.Path(sys.argv[1]), collector=RAY)
print("built", flush=True)
run.train()
input()
"""


@pytest.fixture
def ray_installed() -> None:
    pytest.importorskip("ray", reason="needs Ray: pip install '.[ray]'")


def of_ray(parent: psutil.Process) -> list[psutil.Process]:
    """Processes of the cluster that a process has started."""
    return [process for process in parent.children(recursive=True) if "ray" in " ".join(process.cmdline())]


def ended(processes: list[psutil.Process]) -> bool:
    """Whether they end within seconds."""
    return not psutil.wait_procs(processes, timeout=20.0)[1]


@pytest.fixture(scope="module")
def reference(tmp_path_factory: pytest.TempPathFactory) -> torch.Tensor:
    return finish(tiny_run(tmp_path_factory.mktemp("reference"), collector=RAY | {"kind": "multi_sync"}))


@pytest.mark.usefixtures("ray_installed")
def test_ray_gives_the_weights_of_multi_sync_on_the_loopback_interface_and_leaves_nothing_behind(
    tmp_path: Path, reference: torch.Tensor
) -> None:
    run = tiny_run(tmp_path, collector=RAY)
    processes = of_ray(psutil.Process())
    listening = [
        connection.laddr.ip
        for process in [psutil.Process(), *processes]
        for connection in process.net_connections()
        if connection.status == psutil.CONN_LISTEN
    ]
    assert len(processes) > 2
    assert listening
    assert {address.removeprefix("::ffff:") for address in listening} == {"127.0.0.1"}
    assert torch.equal(finish(run), reference)
    assert run.learner.collection.cpu_seconds() > 0.0
    assert ended(processes)


@pytest.mark.usefixtures("ray_installed")
def test_a_killed_worker_of_ray_is_replaced(
    tmp_path: Path, reference: torch.Tensor, capsys: pytest.CaptureFixture[str]
) -> None:
    killed = []

    def build() -> Run:
        run = tiny_run(tmp_path, collector=RAY)
        iterate = run.learner.iterate

        def disturbed() -> None:
            if run.learner.iteration == 6 and not killed:
                killed.append(next(one for one in of_ray(psutil.Process()) if "RemoteCollector" in one.cmdline()[0]))
                killed[0].kill()
            iterate()

        run.learner.iterate = disturbed  # type: ignore[method-assign]
        return run

    run, reason = train_on(build)
    assert killed
    assert reason == "all 160 steps done"
    assert torch.equal(weights(run), reference)
    assert capsys.readouterr().out.count("going back to the last barrier with new workers") == 1


@pytest.mark.usefixtures("ray_installed")
def test_the_cluster_of_a_run_that_is_killed_ends_with_it(tmp_path: Path) -> None:
    command = [sys.executable, "-c", KILLED, str(tmp_path)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as main:
        assert main.stdout is not None
        assert main.stdout.readline() == "built\n"
        processes = of_ray(psutil.Process(main.pid))
        main.kill()
    assert len(processes) > 2
    assert ended(processes)


def test_without_ray_the_error_is_one_line_that_says_how_to_get_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "ray", None)
    with pytest.raises(InputError, match=r"^Ray is not installed; pip install 'tactile-cube\[ray\]'$"):
        tiny_run(tmp_path, collector=RAY)


@pytest.mark.parametrize("address", ["auto", "host:port", ":6379", "ray://host:10001"])
def test_an_address_that_is_none_is_refused(address: str) -> None:
    with pytest.raises(InputError, match=rf"^collector\.address={address}: give host:port"):
        ray_cluster.join(None, address)


def test_an_address_where_nothing_answers_is_refused_at_once() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
    with pytest.raises(InputError, match=rf"^collector\.address=127\.0\.0\.1:{port}: nothing answers there"):
        ray_cluster.join(None, f"127.0.0.1:{port}")
