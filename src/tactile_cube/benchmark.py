"""Measure the speed of everything on this machine, beside other people's programs on the same work."""

from __future__ import annotations

from omegaconf import DictConfig

from tactile_cube.cli import command


@command("benchmark")
def main(config: DictConfig) -> None:
    """Run the sections one by one; print each as it is done; write benchmark.json, .md and .png after each."""
    import os

    os.environ.setdefault("OMP_NUM_THREADS", "1")  # one core against one core

    import json
    import shlex
    import sys
    from pathlib import Path

    from hydra.core.hydra_config import HydraConfig

    from tactile_cube.agent.policy_file import current_commit
    from tactile_cube.benchmarking.machine import busy, machine
    from tactile_cube.benchmarking.picture import write_picture
    from tactile_cube.benchmarking.sections import check_sections, measure
    from tactile_cube.benchmarking.settings import RunSettings
    from tactile_cube.benchmarking.table import table

    settings = RunSettings(sections=tuple(config.sections), rounds=config.rounds, peers=config.peers)
    check_sections(settings.sections)
    folder = Path(HydraConfig.get().runtime.output_dir)
    facts = machine() | {
        "commit": current_commit(),
        "command": shlex.join(["python", "-m", "tactile_cube.benchmark", *sys.argv[1:]]),
    }
    head = "\n".join(f"{key}: {value}" for key, value in facts.items())
    warning = (
        "other programs are running: compare ratios and processor times, not times on the clock\n" if busy() else ""
    )
    print(f"{head}\n{warning}", flush=True)
    done, page = [], f"# Benchmark\n\n{head.replace(chr(10), '  ' + chr(10))}\n\n{warning}"
    for name in settings.sections:
        print(f"measuring {name} ...", flush=True)
        done.append(measure(name, settings.rounds, settings.peers))
        text = table(done[-1])
        print(f"{text}\n", flush=True)
        page += f"\n{text}\n"
        (folder / "benchmark.md").write_text(page, encoding="utf-8")
        found = {"machine": facts, "sections": [section.plain() for section in done]}
        (folder / "benchmark.json").write_text(json.dumps(found, indent=1), encoding="utf-8")
        write_picture(done, folder / "benchmark.png")
    print(f"results: {folder / 'benchmark.json'}\npicture: {folder / 'benchmark.png'}")


if __name__ == "__main__":
    main()
