"""Write a policy for a robot as ONNX or plain arrays, with the contract it is to be run by."""

from __future__ import annotations

from omegaconf import DictConfig

from tactile_cube.cli import command


@command("export")
def main(config: DictConfig) -> None:
    """Export the policy and say what was written."""
    from tactile_cube.api.deployment import run_export
    from tactile_cube.api.job import typed_job

    output, contract = run_export(typed_job(config))
    print(f"{output}\ncontract: {contract}")


if __name__ == "__main__":
    main()
