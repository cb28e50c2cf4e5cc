"""Write a policy for a robot as ONNX or plain arrays, with the contract it is to be run by."""

from __future__ import annotations

from omegaconf import DictConfig

from tactile_cube.cli import command


@command("export")
def main(config: DictConfig) -> None:
    """Export the policy and say what was written."""
    from pathlib import Path

    from tactile_cube.deployment.export import FORMATS, export_policy
    from tactile_cube.deployment.network import read_network
    from tactile_cube.errors import InputError
    from tactile_cube.evaluation.policy_path import policy_path

    source = policy_path(config.policy)
    if config.output is None and config.format not in FORMATS:
        raise InputError(f"format={config.format}: choose {' or '.join(FORMATS)}")
    output = Path(config.output or f"{source.stem}.{config.format}")
    contract = export_policy(read_network(source), output)
    print(f"{source} -> {output}\ncontract: {contract}")


if __name__ == "__main__":
    main()
