"""Write a policy for a robot as ONNX or plain arrays, with the contract it is to be run by."""

from tactile_cube.api.job import Job
from tactile_cube.cli import command


@command("export")
def main(job: Job) -> None:
    """Export the policy and say what was written."""
    from tactile_cube.api.deployment import run_export

    output, contract = run_export(job)
    print(f"{output}\ncontract: {contract}")


if __name__ == "__main__":
    main()
