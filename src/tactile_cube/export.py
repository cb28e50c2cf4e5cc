"""Write a policy for a robot, or an identified model for another simulator.

A policy becomes ONNX or plain arrays, with the contract it is to be run by. A model (model=model.yaml) becomes MJCF,
URDF or a parameter file of BAM, with a list of what that format cannot hold.
"""

from tactile_cube.api.job import Job
from tactile_cube.cli import command


@command("export")
def main(job: Job) -> None:
    """Export and say what was written."""
    if job.config.model is not None:
        from tactile_cube.api.model_export import run_model_export

        print(run_model_export(job).text)
        return
    from tactile_cube.api.deployment import run_export

    output, contract = run_export(job)
    print(f"{output}\ncontract: {contract}")


if __name__ == "__main__":
    main()
