"""HDF5 files in memory: built as bytes that are netCDF-4, and opened from bytes, checked.

HDF5 can crash the process when a disk fills up while it writes, or when it follows what a damaged
file says; so that it never touches a disk here: `compressor.durable` writes the bytes, and who
reads them compares their digest first. Only this module imports h5py.
"""

import contextlib
import hashlib
import math
from collections.abc import Collection, Iterator, Mapping
from typing import Any

import h5py
import numpy as np
from h5py import h5d, h5f, h5l, h5o, h5p, h5z

from compressor.durable import Folder, StoreError, system_error

Variables = Mapping[str, tuple[tuple[str, ...], np.ndarray, Mapping[str, Any]]]

TEXT = h5py.string_dtype()  # variable-length UTF-8
LAYOUTS = {h5d.COMPACT, h5d.CONTIGUOUS, h5d.CHUNKED}  # a virtual dataset lies in other files
FILTERS = {h5z.FILTER_DEFLATE, h5z.FILTER_SHUFFLE, h5z.FILTER_FLETCHER32}
GZIP_LEVEL = 4
MOST_EXPANSION = 1100  # deflate's limit is 1032: what claims to hold more is no honest file
BARE = "This is a netCDF dimension but not a netCDF variable."  # what netCDF calls such a scale
REMEDY = "run its study again, which replaces it"


class DamagedJob(StoreError):
    """A file of the store that is not what was written, or holds what none of ours does."""


def digest(data: bytes) -> str:
    """The checksum in the name of a stored file: 20 hexadecimal digits (BLAKE2b)."""
    return hashlib.blake2b(data, digest_size=10).hexdigest()


def image(
    variables: Variables, attributes: Mapping[str, Any], deflated: Collection[str] = ()
) -> bytes:
    """Variables, (dims, values, attributes) by name, as the bytes of a netCDF-4 file.

    A variable with the name of its one dimension is that dimension's coordinate. `deflated` ones
    are shuffled and compressed.
    """
    with h5py.File("image", "w", driver="core", backing_store=False, track_order=True) as file:
        for name, (dims, values, attrs) in variables.items():
            dtype = TEXT if values.dtype.kind in "OU" else values.dtype
            how = {"compression": GZIP_LEVEL, "shuffle": True} if name in deflated else {}
            stored = file.create_dataset(name, data=values.astype(dtype), dtype=dtype, **how)
            _set_attributes(stored, attrs)
            if dims == (name,):
                stored.make_scale(name)
        for name, (dims, values, _) in variables.items():
            for number, dim in enumerate(dims):
                if dim not in file:  # takes no space: nothing is written to it
                    bare = file.create_dataset(dim, (values.shape[number],), ">f4")
                    bare.make_scale(f"{BARE}{values.shape[number]:10}")
                if dim != name:
                    file[name].dims[number].attach_scale(file[dim])
        _set_attributes(file, attributes)
        file.flush()
        return file.id.get_file_image()


def _set_attributes(stored: Any, attributes: Mapping[str, Any]) -> None:
    for name, value in attributes.items():
        stored.attrs[name] = storable(value) if isinstance(value, str) else value


def storable(text: str) -> str:
    """Text as HDF5 can hold it: without NUL and lone surrogates."""
    return text.encode(errors="replace").decode().replace("\0", "\ufffd")


@contextlib.contextmanager
def opened(data: bytes, path: Folder, remedy: str = REMEDY) -> Iterator[h5py.File]:
    """The HDF5 file that `data` is, every part of it checked; `path` is named in errors.

    Raises DamagedJob for what is no HDF5 file or holds what ours never do: groups, links, data in
    other files, foreign filters, types other than numbers and text, more data than can be in it.
    What goes wrong while the caller reads is a DamagedJob, too.
    """
    try:
        access = h5p.create(h5p.FILE_ACCESS)
        access.set_fapl_core(backing_store=False)
        access.set_file_image(data)
        with h5py.File(h5f.open(b"image", h5f.ACC_RDONLY, access)) as file:
            for name in file:
                if problem := _objection(file, name, len(data)):
                    raise DamagedJob(path, f"is refused: {name} {problem}", remedy)
            yield file
    except (OSError, KeyError, ValueError, TypeError, AttributeError, RuntimeError) as error:
        if isinstance(error, OSError) and error.errno:
            raise system_error(path, error) from error
        problem = "is no finished job of compsim: cut short, damaged, or foreign"
        raise DamagedJob(path, problem, remedy) from error


def _objection(file: h5py.File, name: str, size: int) -> str:
    """What is wrong with an entry of a file of `size` bytes, or ""."""
    encoded = name.encode(errors="surrogateescape")
    if file.id.links.get_info(encoded).type != h5l.TYPE_HARD:
        return "is a link"
    entry = h5o.open(file.id, encoded)
    if not isinstance(entry, h5d.DatasetID):
        return "is no dataset"
    how = entry.get_create_plist()
    if how.get_layout() not in LAYOUTS or how.get_external_count():
        return "lies in another file"
    if {how.get_filter(number)[0] for number in range(how.get_nfilters())} - FILTERS:
        return "needs a foreign filter"
    dtype = entry.dtype
    if dtype.kind not in "fiuS" and not h5py.check_string_dtype(dtype):
        return f"holds {dtype}, neither numbers nor text"
    if math.prod(entry.shape) * dtype.itemsize > size * MOST_EXPANSION:
        return "claims more data than the file can hold"
    return ""


def text(file: h5py.File, name: str) -> str:
    """A text variable without dimensions."""
    return file[name].asstr()[()]


def attributes(stored: Any) -> dict[str, Any]:
    """The attributes that are no business of HDF5's or netCDF's: text and numbers."""
    found = {}
    for name in stored.attrs:
        kind = stored.attrs.get_id(name).dtype
        if kind.kind in "fiuS" or h5py.check_string_dtype(kind):
            found[name] = stored.attrs[name]
    return {n: v for n, v in found.items() if n not in ("CLASS", "NAME") and n[0] != "_"}


def variables(file: h5py.File) -> dict[str, tuple[tuple[str, ...], np.ndarray, dict[str, Any]]]:
    """All variables of a file, as `image` takes them."""
    found = {}
    for name, stored in file.items():
        is_text = h5py.check_string_dtype(stored.dtype) and stored.dtype.kind == "O"
        values = np.asarray(stored.asstr()[()] if is_text else stored[()])
        if is_text:
            values = values.astype(object)
        dims = (name,) if stored.is_scale else tuple(_scale(dim) for dim in stored.dims)
        found[name] = dims, values, attributes(stored)
    return found


def _scale(dim: Any) -> str:
    """The name of the coordinate of a dimension, which lies beside it."""
    return dim[0].name.removeprefix("/")
