"""Write netCDF-4 in memory, and read it: each value and each name has a checksum of HDF5's.

Values up to `MAX_COMPACT` lie in the header of their variable, which HDF5 sums up; larger ones in
chunks with the Fletcher-32 filter. Texts are arrays of characters: of texts of any length HDF5 sums
up nothing. The bytes are written by `compressor.store.files`, since HDF5 may crash the process when
a disk fills up while it writes. Only this package imports h5py.
"""

import contextlib
import uuid
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np

from compressor.store.files import StoreError, publish, system_error

if TYPE_CHECKING:
    import xarray as xr

# name -> names of its dimensions, values, attributes
Variables = Mapping[str, tuple[tuple[str, ...], Any, Mapping[str, Any]]]

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
    arrays: dict[str, np.ndarray] = {}
    dims: dict[str, tuple[str, ...]] = {}
    for name, (names, values, _) in variables.items():
        arrays[name], is_text = _as_stored(values)
        dims[name] = (*names, f"text{arrays[name].shape[-1]}") if is_text else tuple(names)
    sizes = {
        dim: size
        for name, array in arrays.items()
        for dim, size in zip(dims[name], array.shape, strict=True)
    }
    # HDF5 knows open files by their names, also those in memory
    with h5py.File(uuid.uuid4().hex, "w", driver="core", backing_store=False, libver="latest",
                   track_order=True) as file:  # fmt: skip
        made = {}
        for number, (dim, size) in enumerate(sizes.items()):
            is_coordinate = dims.get(dim, ())[:1] == (dim,)
            array = arrays[dim] if is_coordinate else np.zeros(size, "i1")
            made[dim] = _create(file, dim, array, dims.get(dim, ()), dim in compressed)
            made[dim].make_scale(dim if is_coordinate else f"{BARE.decode()}{size:10}")
            made[dim].attrs["_Netcdf4Dimid"] = np.int32(number)
        ids = {dim: number for number, dim in enumerate(sizes)}
        for name, array in arrays.items():
            if name not in made:
                made[name] = _create(file, name, array, dims[name], name in compressed)
                for number, dim in enumerate(dims[name]):
                    made[name].dims[number].attach_scale(made[dim])
            if array.ndim:
                numbers = np.array([ids[dim] for dim in dims[name]], "i4")
                made[name].attrs["_Netcdf4Coordinates"] = numbers
            if dims[name][-1:] == (f"text{array.shape[-1] if array.ndim else 0}",):
                _set_attribute(made[name], "_Encoding", "utf-8")
            for key, value in variables[name][2].items():
                _set_attribute(made[name], key, value)
        for key, value in attributes.items():
            _set_attribute(file, key, value)
        file.flush()
        return file.id.get_file_image()


def _as_stored(values: Any) -> tuple[np.ndarray, bool]:
    """Return values as they are stored, and whether they are texts, with an axis of characters."""
    array = np.asarray(values)
    if array.dtype.kind == "b":
        return array.astype("i1"), False
    if array.dtype.kind not in "OUS":
        return array, False
    if array.dtype.kind != "S":  # without lone surrogates
        array = np.char.encode(array.astype("U"), "utf-8", "replace")
    width = max(array.dtype.itemsize, 1)
    whole = np.ascontiguousarray(array, f"S{width}").reshape(array.shape)
    return whole[..., np.newaxis].view("S1"), True


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


def read_values(data: Any) -> np.ndarray:
    """Return the values of a variable, texts as str."""
    if "_Encoding" in data.attrs:
        return np.char.decode(read_bytes(data), "utf-8")
    return np.asarray(data[()])


def read_attributes(place: Any) -> dict[str, Any]:
    """Return the attributes of a variable or a file, but for those of netCDF itself."""
    wanted = [name for name in place.attrs if name not in OF_NETCDF and not name.startswith("_")]
    found = {name: place.attrs[name] for name in wanted}
    return {n: v.decode() if isinstance(v, bytes) else v for n, v in found.items()}


def dimensions_of(data: Any) -> list[str]:
    """Return the names of the dimensions of a variable.

    Its DIMENSION_LIST has them, too, but no checksum: HDF5 may take for ever over a damaged one.
    """
    names = [*data.file]  # dimensions first, in the order of their numbers
    return [names[at] for at in data.attrs.get("_Netcdf4Coordinates", ())]


def read_variable(file: Any, name: str) -> tuple[tuple[str, ...], np.ndarray, dict[str, Any]]:
    """Return names of dimensions, values and attributes of a variable."""
    data = file[name]
    dims = dimensions_of(data)
    if "_Encoding" in data.attrs:
        del dims[-1]
    return tuple(dims), read_values(data), read_attributes(data)


def names_of(file: Any) -> list[str]:
    """Return the names of the variables of a file, in the order of writing."""
    return [name for name in file if not file[name].attrs.get("NAME", b"").startswith(BARE)]


def write_dataset(path: Path, dataset: "xr.Dataset") -> Path:
    """Write a Dataset as netCDF-4, whole or not at all; return its path.

    Raises StoreError where the disk refuses.
    """
    publish(path, encode_dataset(dataset))
    return path


def encode_dataset(dataset: "xr.Dataset") -> bytes:
    """Return a Dataset as the bytes of a netCDF-4 file."""
    variables = {
        str(name): (tuple(map(str, item.dims)), item.values, item.attrs)
        for name, item in dataset.variables.items()
    }
    return encode_netcdf(variables, {str(name): value for name, value in dataset.attrs.items()})


def read_dataset(path: Path, remedy: str = REMEDY) -> "xr.Dataset":
    """Return what `write_dataset` wrote. Raises DamagedFile, and FileNotFoundError.

    remedy: the end of the error's text.
    """
    import xarray as xr

    with open_netcdf(path, remedy) as file:
        found = {name: read_variable(file, name) for name in names_of(file)}
        return xr.Dataset(found, attrs=read_attributes(file))


def check_file(path: Path, remedy: str = REMEDY) -> None:
    """Read each value of a file. Raises DamagedFile where its checksum is wrong."""
    with open_netcdf(path, remedy) as file:
        for name in file:
            file[name][()]
        read_attributes(file)
