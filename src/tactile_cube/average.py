"""Average the weights of the last policies that a training run has kept."""

from tactile_cube.api.job import Job
from tactile_cube.cli import command


@command("average")
def main(job: Job) -> None:
    """Write the averaged policy and say of which it is made."""
    from pathlib import Path

    from tactile_cube.agent.averaging import averaged, kept_policies
    from tactile_cube.agent.policy_file import save_policy

    run = Path(job.config.run)
    actor, info = averaged(kept_policies(run, job.config.last))
    output = Path(job.config.output or run / "policy_averaged.safetensors")
    save_policy(output, actor, info)
    print(f"mean of the weights after {', '.join(map(str, info.averaged))} steps: {output}")
    print(f"see it turn: python -m tactile_cube.evaluate policy={output}")


if __name__ == "__main__":
    main()
