import re
from pathlib import Path

from tactile_cube.visualization.charts import svg, time_chart
from tactile_cube.visualization.report import Figure, Report, Section, Table, write_report

LEGIBLE = 11.0  # [px] of a phone's screen, whose page is as wide as it says; smaller text is not read but guessed


def test_on_a_phone_figures_stay_legible_and_what_is_wider_scrolls_alone(tmp_path: Path) -> None:
    drawing = svg(time_chart("angle [rad]"))
    table = Table(("joint", "error"), [("q1", "1.0")])
    write_report(Report("r", "a", "good", [Section("s", blocks=[Figure(drawing, "c"), table])], "f"), tmp_path / "r")
    text = (tmp_path / "r").read_text()
    assert '<meta name="viewport" content="width=device-width' in text
    narrow = text[text.index("@media (max-width") :]
    shown = float(re.findall(r"svg \{ width: (\d+)px; max-width: none", narrow)[0])
    width, size = (float(re.findall(pattern, drawing)[0]) for pattern in (r'viewBox="0 0 (\d+)', r"font-size: (\d+)px"))
    assert size * shown / width > LEGIBLE
    assert ".wide { overflow-x: auto;" in text
    for element in ("<svg", "<table"):
        assert re.findall(rf"(<[^<]*>)\s*{element}", text) == ['<div class="wide" tabindex="0">']
