"""The report of `compare`: how well the model follows, where it fails, how sure that is, what to do next."""

from tactile_cube.measurement.comparing.comparison import Comparison
from tactile_cube.measurement.units import common_unit, milli, short
from tactile_cube.visualization.comparison_sections import (
    band_section,
    error_section,
    method_section,
    overlay_section,
    recording_section,
    test_section,
    where_section,
)
from tactile_cube.visualization.comparison_summary import floor_source, outcome
from tactile_cube.visualization.report import Listing, Report, Section, Tile, Tone


def comparison_report(comparison: Comparison, command: str, model_path: str | None) -> Report:
    """The whole page.

    Args:
        comparison: what was found.
        command: the command line that made it.
        model_path: the model file, for the suggested next command; None for the owner's values.
    """
    good = comparison.at_the_floor
    return Report(
        title=f"Model and measurement: {comparison.recording.name}",
        answer=outcome(comparison),
        tone="good" if good else "warn",
        tiles=_tiles(comparison),
        sections=[
            recording_section(comparison.recording, comparison.model),
            error_section(comparison),
            where_section(comparison),
            overlay_section(comparison),
            *band_section(comparison),
            test_section(comparison),
            _next_section(comparison, model_path),
            method_section(),
        ],
        footer=f"Made by tactile_cube: {command}",
    )


def _tiles(comparison: Comparison) -> list[Tile]:
    worst = max(comparison.errors.joints, key=lambda j: comparison.errors.joints[j] / comparison.floor.joints[j])
    tone: Tone = "good" if comparison.at_the_floor else "warn"
    units = comparison.recording.units
    unit = common_unit(units.values())
    tiles = [
        Tile(milli(comparison.errors.overall, unit), "error, all joints (RMS)", tone),
        Tile(milli(comparison.floor.overall, unit), f"noise floor ({floor_source(comparison.floor)})"),
        Tile(f"{short(comparison.ratio)} x", "error / noise floor", tone),
        Tile(worst, f"worst joint: {milli(comparison.errors.joints[worst], units[worst])}"),
    ]
    if comparison.band is not None:
        tiles.append(
            Tile(f"{100 * comparison.band.inside:.0f} %", f"measured inside {comparison.band.simulations} simulations")
        )
    return tiles


def _next_section(comparison: Comparison, model_path: str | None) -> Section:
    """What to type next."""
    folder = comparison.recording.folder
    model = f" model={model_path}" if model_path else ""
    if comparison.at_the_floor:
        said = (
            "Nothing is missing at this noise. Check the same model on a recording of other motions, or train with it:"
        )
        command = f"python -m tactile_cube.train +experiment=adapt{model or ' model=MODEL.yaml'}"
    else:
        said = "Constants may be off, or an effect missing: diagnose refits the first, then searches for the second."
        command = f"python -m tactile_cube.diagnose recording={folder}{model}"
    return Section("What to do next", [said], [Listing([command], code=True)])
