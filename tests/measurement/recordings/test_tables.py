"""Files of trials that the reader's library does not survive."""

from pathlib import Path

import polars
import pytest

from tactile_cube.errors import InputError
from tactile_cube.measurement.recordings.tables import read_table


@pytest.mark.parametrize(("file", "reader"), [("trial.parquet", "scan_parquet"), ("trial.csv", "read_csv")])
def test_a_reader_that_panics_means_a_damaged_file(
    file: str, reader: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def panic(*_: object, **__: object) -> None:
        raise polars.exceptions.PanicException("Thrift out of range\nsecond line")

    frame = polars.DataFrame({"time": [0.0]})
    frame.write_parquet(tmp_path / file) if file.endswith("parquet") else frame.write_csv(tmp_path / file)
    monkeypatch.setattr(polars, reader, panic)
    with pytest.raises(InputError, match=rf"{file}: not a .*Thrift out of range$"):
        read_table(tmp_path / file)
