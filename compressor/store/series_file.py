"""Files with the time series of one job: netCDF-4 that xarray, h5py and ncdump read.

    <folder>/jobs/<key>-<digest>.h5    everything of one job, the numbers of its row included

The digest of the file's bytes is in its name and in the job's row, and compared whenever the file
is read. A job that is run again gets a new name, so that its old result stays whole until the new
row is on disk. A new file waits under a temporary name, `.<key>-<digest>.h5.tmp`, until the
`Writer` has stored its row: a file with its name belongs to a row, and what a run that was killed
leaves has no name, unless its row was stored. Readers know both names.
"""

import errno
import re
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from compressor.cases import Output
from compressor.metrics import NUMBERS
from compressor.outcome import DatasetParts, SeriesFile
from compressor.store import hdf5
from compressor.store.files import HEX20, KEY, StoreError, final_path, publish, system_error
from compressor.store.hdf5 import REMEDY, DamagedJob, digest, open_file, seal, unseal

if TYPE_CHECKING:
    import xarray as xr

NAME = re.compile(rf"\.?({HEX20})-({HEX20})\.h5(?:\.tmp)?")
ABSCISSAE = ("time", "crank_angle")  # stay double: their steps are what matters


def series_path(place: Path, key: str, checksum: str) -> Path:
    """Return the path of a job's time series; `place` is the folder that holds `jobs`."""
    if not KEY.fullmatch(key):
        raise StoreError(place, f"{key!r} is no job's key", "a key is 20 hexadecimal digits")
    return place / "jobs" / f"{key}-{checksum}.h5"


def write_series(place: Path, dataset: "DatasetParts | xr.Dataset", output: Output) -> SeriesFile:
    """Write the file of a job's Dataset, or of its parts; a `Writer` gives it its name.

    place: the folder that holds `jobs`. Raises StoreError where the disk refuses.
    """
    file, data = series_file(dataset, output)
    store_series(place, dataset.attrs["key"], file, data)
    return file


def series_file(dataset: "DatasetParts | xr.Dataset", output: Output) -> tuple[SeriesFile, bytes]:
    """Return the file that a job's Dataset makes, and its bytes."""
    data, times = series_image(dataset, output), dataset.variables["time"].values
    return SeriesFile(times.size, float(times[-1]), output.precision, digest(data)), data


def store_series(place: Path, key: str, file: SeriesFile, data: bytes) -> None:
    """Write the bytes of a job's file; a `Writer` gives it its name.

    Raises StoreError for what is no key, and where the disk refuses.
    """
    publish(series_path(place, key, file.digest), data, pending=True)


def series_image(dataset: "DatasetParts | xr.Dataset", output: Output) -> bytes:
    """Return a job's Dataset as the bytes of its file."""
    series = {str(name) for name, item in dataset.variables.items() if "time" in item.dims}
    rounded = series - {*ABSCISSAE} if output.precision == "single" else set()
    return image_of(dataset, rounded, series if output.compress else (), repeated=True)


def write_dataset(path: Path, dataset: "xr.Dataset") -> Path:
    """Write a Dataset that is no job as netCDF-4 with the digest of its bytes; return its path.

    Raises StoreError where the disk refuses.
    """
    publish(path, seal(image_of(dataset)))
    return path


def read_dataset(path: Path, remedy: str = REMEDY) -> "xr.Dataset":
    """Return what `write_dataset` wrote. Raises DamagedJob for a foreign or damaged file.

    Raises OSError where the file cannot be read. remedy: the end of the error's text.
    """
    import xarray as xr

    data = unseal(path.read_bytes(), path, remedy)
    with open_file(data, path, remedy) as file:
        return xr.Dataset(hdf5.variables(file, data), attrs=hdf5.attributes(file))


def image_of(
    dataset: "DatasetParts | xr.Dataset",
    rounded: Collection[str] = (),
    deflated: Collection[str] = (),
    repeated: bool = False,
) -> bytes:
    """Return a Dataset as the bytes of a file; `rounded` variables in single precision.

    deflated, repeated: as of `hdf5.image`.
    """
    variables = {
        str(name): (
            tuple(map(str, item.dims)),
            item.values.astype("f4") if name in rounded else item.values,
            item.attrs,
        )
        for name, item in dataset.variables.items()
    }
    attributes = {str(name): value for name, value in dataset.attrs.items()}
    return hdf5.image(variables, attributes, deflated, repeated)


def intact(path: Path) -> bool:
    """Return whether a file is there, and its bytes, as far as the disk gives them, as written.

    Raises StoreError where it may not be read.
    """
    named = NAME.fullmatch(path.name)
    try:
        return named is not None and digest(_read_file(path)) == named[2]
    except OSError as error:
        if error.errno in (errno.ENOENT, errno.EIO):
            return False
        raise system_error(path, error) from error


def _read_file(path: Path) -> bytes:
    """Return the bytes of a job's file, which may get its name at this moment."""
    try:
        return path.read_bytes()
    except FileNotFoundError:
        return final_path(path).read_bytes()


def read_bytes(path: Path) -> bytes:
    """Return the bytes of a job's file, compared with their digest. Raises DamagedJob."""
    named = NAME.fullmatch(path.name)
    try:
        data = _read_file(path)
    except FileNotFoundError as error:
        raise StoreError(path, "is not there any more", "run its study again") from error
    except OSError as error:
        raise system_error(path, error) from error
    if named is None or digest(data) != named[2]:
        raise DamagedJob(path, "is damaged: its bytes are not those that were written", REMEDY)
    return data


def read_series(path: Path) -> "xr.Dataset":
    """Return a job's Dataset, from a file. Raises DamagedJob."""
    import xarray as xr

    data = read_bytes(path)
    with open_file(data, path) as file:
        attributes = hdf5.attributes(file)
        if attributes["key"] != final_path(path).name[:20]:
            raise ValueError
        dataset = xr.Dataset(hdf5.variables(file, data), attrs=attributes)
        for name, metric in NUMBERS.items():
            found = dataset.variables.get(name)  # a Dataset looks for similar names
            if found is not None and (found.dims, found.dtype.kind) != (metric.dims, "f"):
                raise ValueError
        if not {"status", "reason", "time"} <= set(dataset.variables):
            raise ValueError
        return dataset


def read_values(path: Path, names: Sequence[str]) -> dict[str, np.ndarray]:
    """Return some variables of a job's file by name, without those that it does not have."""
    data = read_bytes(path)
    with open_file(data, path, names=names) as file:
        return {name: hdf5.read_variable(file[name], data) for name in names if name in file}
