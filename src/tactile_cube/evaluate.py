"""Try a policy, judge every episode, film the best one."""

from __future__ import annotations

from omegaconf import DictConfig

from tactile_cube.cli import verb


@verb("evaluate")
def main(config: DictConfig) -> None:
    """Run the episodes of a protocol, print and write the verdicts, film the best episode."""
    import shlex
    import sys
    import time
    from pathlib import Path

    import hydra.utils
    import torch
    from hydra.core.hydra_config import HydraConfig

    from tactile_cube.evaluation.environment import environment
    from tactile_cube.evaluation.evaluation import Evaluation
    from tactile_cube.evaluation.policy_source import find_policy
    from tactile_cube.evaluation.results_file import Run, write_results
    from tactile_cube.evaluation.summary import HEADER, row, sentence
    from tactile_cube.visualization.curves import write_robustness_map
    from tactile_cube.visualization.showcase import showcase

    torch.set_num_threads(1)
    folder = Path(HydraConfig.get().runtime.output_dir)
    source = find_policy(config.policy)
    protocol = hydra.utils.instantiate(config.protocol)
    settings = environment(config, source)
    evaluation = Evaluation(settings, source.policy, protocol, config.seed)
    task = settings.task
    print(f"policy {source.label}, protocol {protocol.name}, seed {config.seed}, task {task.name}: ", end="")
    print(f"T_s {task.filter_time:g} s, {100 * task.gravity_scale:.0f} % of the weight\n{HEADER}")
    begin = time.process_time()
    variants = evaluation.run(lambda name, result: print(row(result, name), flush=True))
    command = shlex.join(["python", "-m", "tactile_cube.evaluate", *sys.argv[1:]])
    run = Run(protocol, source, task, config.seed, command, (time.process_time() - begin) / 3600)
    write_results(folder / "results.json", run, variants)
    print(*(sentence(variant.variant.name, variant.summary) for variant in variants), sep="\n")
    print(f"results: {folder / 'results.json'}")
    if any(variant.variant.axis for variant in variants):
        write_robustness_map(variants, protocol.nominal_values, folder / "robustness.png")
        print(f"robustness map: {folder / 'robustness.png'}")
    if config.film:
        showcase(evaluation, variants, folder)


if __name__ == "__main__":
    main()
