"""Write netCDF-4 in memory, and read it: each value and each name has a checksum of HDF5's.

Values up to `MAX_COMPACT` lie in the header of their variable, which HDF5 sums up; larger ones in
chunks with the Fletcher-32 filter. Texts are arrays of characters: of texts of any length HDF5 sums
up nothing. The bytes are written by `compressor.store.files`, since HDF5 may crash the process when
a disk fills up while it writes. Only this module imports h5py.
"""

import contextlib
import io
from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np

from compressor.program import PROGRAM
from compressor.store.files import StoreError, publish, system_error

if TYPE_CHECKING:
    import xarray as xr

# name -> names of its dimensions, values, attributes
Variables = Mapping[str, tuple[tuple[Any, ...], Any, Mapping[Any, Any]]]

MAX_COMPACT = 8192  # bytes of a variable that lie in its header
GZIP_LEVEL = 4
BARE = b"This is a netCDF dimension but not a netCDF variable."  # what netCDF calls such a scale
OF_NETCDF = {"CLASS", "NAME", "DIMENSION_LIST", "REFERENCE_LIST"}  # attributes; and those with _
# what h5py, numpy and who reads raise on a file that is damaged, or none of ours
FOREIGN = (OSError, LookupError, ValueError, TypeError, AttributeError, RuntimeError,
           ArithmeticError)  # fmt: skip
REMEDY = "delete it, and run its studies again"


class DamagedFile(StoreError):
    """A file of the store that is not what was written, or holds what none of ours does."""


def encode_netcdf(
    variables: Variables, attributes: Mapping[str, Any], compressed: Collection[str] = ()
) -> bytes:
    """Return variables as the bytes of a netCDF-4 file.

    A variable whose first dimension has its name is the coordinate of that dimension. compressed:
    names of variables to be deflated. Large arrays over `job` are in chunks of one job.
    """
    stored = {name: _as_stored(*parts) for name, parts in variables.items()}
    sizes: dict[str, int] = {}
    for dims, array, _ in stored.values():
        sizes |= dict(zip(dims, array.shape, strict=True))
    numbers = {dim: number for number, dim in enumerate(sizes)}
    image = io.BytesIO()
    with h5py.File(image, "w", libver="latest", track_order=True) as file:
        for dim, size in sizes.items():
            dims, array, _ = stored.get(dim, ((), np.zeros(0), {}))
            is_coordinate = dims[:1] == (dim,)
            values = array if is_coordinate else np.zeros(size, "i1")
            scale = _create(file, dim, values, dims, dim in compressed)
            scale.make_scale(dim if is_coordinate else f"{BARE.decode()}{size:10}")
            scale.attrs["_Netcdf4Dimid"] = np.int32(numbers[dim])
        for name, (dims, array, attrs) in stored.items():
            if name not in sizes:
                data = _create(file, name, array, dims, name in compressed)
                for axis, dim in enumerate(dims):
                    data.dims[axis].attach_scale(file[dim])
            if dims:
                attrs["_Netcdf4Coordinates"] = np.array([numbers[dim] for dim in dims], "i4")
            for key, value in attrs.items():
                _set_attribute(file[name], key, value)
        for key, value in attributes.items():
            _set_attribute(file, key, value)
    return image.getvalue()


def _as_stored(
    dims: tuple[Any, ...], values: Any, attributes: Mapping[Any, Any]
) -> tuple[tuple[str, ...], np.ndarray, dict[str, Any]]:
    """Return a variable as it is stored: truth as 0 and 1, texts with an axis of characters."""
    array = np.asarray(values)
    if array.dtype.kind == "b":
        array = array.astype("i1")
    if array.dtype.kind not in "OUS":
        return tuple(dims), array, {**attributes}
    if array.dtype.kind != "S":  # without lone surrogates
        array = np.char.encode(array.astype("U"), "utf-8", "replace")
    width = max(array.dtype.itemsize, 1)
    whole = np.ascontiguousarray(array, f"S{width}").reshape(array.shape)[..., np.newaxis]
    return (*dims, f"text{width}"), whole.view("S1"), {**attributes, "_Encoding": "utf-8"}


def _create(file: Any, name: str, array: np.ndarray, dims: tuple[str, ...], gzip: bool) -> Any:
    """Return a new variable of a file, whose values have a checksum."""
    if array.nbytes <= MAX_COMPACT:
        how = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
        how.set_layout(h5py.h5d.COMPACT)
        return file.create_dataset(name, data=array, dcpl=how, track_times=False)
    by_job = dims[:1] == ("job",) and array[0].nbytes > MAX_COMPACT
    chunks = (1, *array.shape[1:]) if by_job else array.shape
    more: dict[str, Any] = {"compression": GZIP_LEVEL, "shuffle": True} if gzip else {}
    return file.create_dataset(
        name, data=array, chunks=chunks, fletcher32=True, track_times=False, **more
    )


def _set_attribute(place: Any, name: str, value: Any) -> None:
    """Set an attribute; a text is of a fixed length, so that it lies in the header."""
    if isinstance(value, str):
        encoded = value.encode(errors="replace").replace(b"\0", b"?") or b"\0"
        place.attrs.create(name, np.bytes_(encoded), dtype=h5py.string_dtype("utf-8", len(encoded)))
    else:
        array = np.asarray(value)
        place.attrs[name] = np.char.encode(array, "utf-8") if array.dtype.kind == "U" else array


@contextlib.contextmanager
def open_netcdf(path: Path, remedy: str = REMEDY) -> Iterator[Any]:
    """Yield an open h5py.File. What goes wrong in the block is a DamagedFile.

    Raises FileNotFoundError, and StoreError where the system refuses to read.
    """
    try:
        with h5py.File(path, "r") as file:
            yield file
    except FileNotFoundError:
        raise
    except FOREIGN as error:
        if isinstance(error, OSError) and error.errno and not isinstance(error, StoreError):
            raise system_error(path, error) from error
        raise DamagedFile(path, "is damaged, or no file of compsim's", remedy) from error


def read_bytes(data: Any) -> np.ndarray:
    """Return the texts of a variable as bytes."""
    values = np.ascontiguousarray(data[()])
    return values.view(f"S{values.shape[-1]}")[..., 0]


def read_attributes(place: Any) -> dict[str, Any]:
    """Return the attributes of a variable or a file, but for those of netCDF itself."""
    wanted = [name for name in place.attrs if name[0] != "_" and name not in OF_NETCDF]
    found = {name: place.attrs[name] for name in wanted}
    return {n: v.decode() if isinstance(v, bytes) else v for n, v in found.items()}


def dimensions_of(data: Any, names: Sequence[str]) -> list[str]:
    """Return the names of the dimensions of a variable.

    names: all of its file, of which dimensions are the first, in the order of their numbers. Its
    DIMENSION_LIST has them, too, but no checksum: HDF5 may take for ever over a damaged one.
    """
    return [names[at] for at in data.attrs.get("_Netcdf4Coordinates", ())]


def write_dataset(path: Path, dataset: "xr.Dataset") -> Path:
    """Write a Dataset as netCDF-4, whole or not at all; return its path.

    Its attribute `program` says what wrote it. Raises StoreError where the disk refuses.
    """
    variables = {str(n): (one.dims, one.values, one.attrs) for n, one in dataset.variables.items()}
    attributes = {str(name): value for name, value in dataset.attrs.items()}
    publish(path, encode_netcdf(variables, attributes | {"program": PROGRAM}))
    return path


def read_dataset(path: Path, remedy: str = REMEDY) -> "xr.Dataset":
    """Return what `write_dataset` wrote. Raises DamagedFile, and FileNotFoundError.

    remedy: the end of the error's text.
    """
    import xarray as xr

    found = {}
    with open_netcdf(path, remedy) as file:
        names = [*file]
        for name in names:
            data, dims = file[name], dimensions_of(file[name], names)
            if data.attrs.get("NAME", b"").startswith(BARE):
                continue
            if "_Encoding" in data.attrs:  # texts, with an axis of characters
                values = np.char.decode(read_bytes(data), "utf-8")
                dims = dims[:-1]
            else:
                values = data[()]
            found[name] = dims, values, read_attributes(data)
        return xr.Dataset(found, attrs=read_attributes(file))


def check_file(path: Path, names: Sequence[str] = ()) -> None:
    """Read the values of a file, all or those of some names. Raises DamagedFile."""
    with open_netcdf(path) as file:
        for name in names or file:
            file[name][()]
        read_attributes(file)
