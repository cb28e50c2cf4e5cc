"""List the physical effects that a model can have, or explain one: law, parameters, what it looks like in data."""

from tactile_cube.api.job import Job
from tactile_cube.cli import command


@command("effects")
def main(job: Job) -> None:
    """Print the catalogue, or the effect that `name` names."""
    from tactile_cube.api.effects import effects, effects_table

    found = effects(job.config.name)
    print(effects_table(found) if job.config.name is None else found[0].text)


if __name__ == "__main__":
    main()
