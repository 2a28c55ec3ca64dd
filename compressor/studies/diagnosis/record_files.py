"""A data set on disk: windows as netCDF-4, features as Parquet, and a card that describes it.

Parquet needs pyarrow, which `pip install 'compsim[dataset]'` brings; without it the same features
are in the netCDF file alone.
"""

import io
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from compressor.program import PROGRAM, Progress
from compressor.store import Folder, publish, writable_folder, write_dataset
from compressor.studies.diagnosis.data_card import data_card
from compressor.studies.diagnosis.data_set import (
    LABELS,
    WORDS,
    DataSetError,
    DataSetOptions,
    make_data_set,
)

if TYPE_CHECKING:
    import xarray as xr

WINDOWS, FEATURES_FILE, CARD = "windows.nc", "features.parquet", "README.md"
NO_PARQUET = (
    f"{FEATURES_FILE} is left out: pyarrow is not installed; get it by pip install "
    "'compsim[dataset]' and run the same command again"
)


@dataclass(frozen=True)
class Written:
    """The files that were written, by name with their bytes, and what was left out and why."""

    files: dict[str, int]
    remark: str


def build_data_set(
    results: Folder, study: str, folder: Folder, options: DataSetOptions, progress: Progress
) -> tuple["xr.Dataset", Written]:
    """Make the data set of a stored study in a folder, that is made where it is missing.

    Raises StoreError and DataSetError, before records are read where that can be known.
    """
    refuse_foreign(folder)
    writable_folder(folder, make=False)
    dataset = make_data_set(results, study, options, progress)
    return dataset, write_data_set(folder, dataset)


def write_data_set(folder: Folder, dataset: "xr.Dataset") -> Written:
    """Write a data set (`make_data_set`) into a folder; files of an earlier one are replaced.

    Each file is whole or absent. Raises StoreError where the disk refuses,
    DataSetError as `refuse_foreign` does.
    """
    refuse_foreign(folder)
    place = Path(folder)
    write_dataset(place / WINDOWS, dataset)
    table = parquet(columns(dataset))
    if table is None:
        (place / FEATURES_FILE).unlink(missing_ok=True)  # of an earlier data set
    else:
        publish(place / FEATURES_FILE, table)
    publish(place / CARD, data_card(dataset, table is not None).encode(errors="replace"))
    names = [WINDOWS, *([FEATURES_FILE] if table is not None else []), CARD]
    files = {name: (place / name).stat().st_size for name in names}
    return Written(files, NO_PARQUET if table is None else "")


def refuse_foreign(folder: Folder) -> None:
    """Raise DataSetError where a folder has a README.md that is no data set's card."""
    place = Path(folder)
    if (place / CARD).exists() and not (place / WINDOWS).exists():
        text = f"{place} has a {CARD} of something else, which the card would replace"
        raise DataSetError(f"{text}: choose another folder, such as {place / 'faults'}")


def columns(dataset: "xr.Dataset") -> dict[str, np.ndarray]:
    """Return a data set as columns, with a row for each window and noise level.

    Labels come first.
    """
    levels = dataset.sizes["noise"]
    found: dict[str, np.ndarray] = {
        name: np.repeat(dataset[name].values, levels)
        for name in ("window", "split", *WORDS, *LABELS, "first_pulse")
    }
    found["noise"] = np.tile(dataset["noise"].values, dataset.sizes["window"])
    flat = dataset["features"].values.reshape(-1, dataset.sizes["feature"])
    return found | dict(zip(dataset["feature"].values.tolist(), flat.T, strict=True))


def parquet(table: dict[str, np.ndarray]) -> bytes | None:
    """Return a table by column as the bytes of a Parquet file.

    None where pyarrow is not installed.
    """
    try:
        import pyarrow
        from pyarrow import parquet as format_
    except ImportError:
        return None
    file = io.BytesIO()
    columns: Any = pyarrow.table(table).replace_schema_metadata({"program": PROGRAM})
    format_.write_table(columns, file)
    return file.getvalue()
