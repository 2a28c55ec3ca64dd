"""HDF5 files in memory: built as bytes that are netCDF-4, and opened from bytes, checked.

HDF5 can crash the process when a disk fills up while it writes, or when it follows what a damaged
file says; so that it never touches a disk here: `compressor.store.files` writes the bytes, and who
reads them compares their digest first. A digest tells of damage, not of malice: what is opened is
also checked before HDF5 follows it. Only this module imports h5py.

HDF5 knows open files by their names, also those that are in memory: opening a name twice gives the
first file again. So every file here has a name of its own, and threads take turns.
"""

import contextlib
import hashlib
import math
import os
import threading
import uuid
from collections.abc import Collection, Iterator, Mapping
from typing import Any

import h5py
import numpy as np
from h5py import h5d, h5f, h5l, h5o, h5p, h5t, h5z

from compressor.store.files import Folder, StoreError, system_error

Variables = Mapping[str, tuple[tuple[str, ...], np.ndarray, Mapping[str, Any]]]

TEXT = h5py.string_dtype()  # variable-length UTF-8
OF_NETCDF = {"CLASS", "NAME", "DIMENSION_LIST", "REFERENCE_LIST"}  # attributes
LAYOUTS = {h5d.COMPACT, h5d.CONTIGUOUS, h5d.CHUNKED}  # a virtual dataset lies in other files
FILTERS = {h5z.FILTER_DEFLATE, h5z.FILTER_SHUFFLE, h5z.FILTER_FLETCHER32}
GZIP_LEVEL = 4
MAX_EXPANSION = 1100  # deflate's limit is 1032: what claims to hold more is no honest file
HEAP = b"GCOL\1\0\0\0"  # begins a global heap (version 1), where HDF5 keeps texts of any length
TEXT_PLACE = np.dtype([("length", "<u4"), ("heap", "<u8"), ("item", "<u4")])
MAX_TEXT = 60_000  # bytes in an attribute, which HDF5 limits to 64 KiB
BARE = "This is a netCDF dimension but not a netCDF variable."  # what netCDF calls such a scale
# what h5py, numpy and who reads raise on a file that is none of ours
FOREIGN = (OSError, LookupError, ValueError, TypeError, AttributeError, RuntimeError,
           ArithmeticError)  # fmt: skip
SEAL = b"compsim digest "
DIGITS = 20
REMEDY = "run its study again, which replaces it"
TURN = threading.RLock()  # one thread at a time; it may open a file while it has another open
if hasattr(os, "register_at_fork"):  # or a child that is forked meanwhile would wait for ever
    os.register_at_fork(
        before=TURN.acquire, after_in_parent=TURN.release, after_in_child=TURN.release
    )


class DamagedJob(StoreError):
    """A file of the store that is not what was written, or holds what none of ours does."""


def digest(data: bytes) -> str:
    """Return the checksum of a stored file: 20 hexadecimal digits (BLAKE2b)."""
    return hashlib.blake2b(data, digest_size=DIGITS // 2).hexdigest()


def seal(data: bytes) -> bytes:
    """Return a file's bytes with their digest behind them, which HDF5 does not look at."""
    return data + SEAL + digest(data).encode()


def unseal(data: bytes, path: Folder, remedy: str = REMEDY) -> bytes:
    """Return what `seal` was given; files of former versions have no seal. Raises DamagedJob."""
    at = data.rfind(SEAL, -len(SEAL) - DIGITS)
    if at < 0:
        return data
    if data[at:] != SEAL + digest(data[:at]).encode():
        raise DamagedJob(path, "is damaged: its bytes are not those that were written", remedy)
    return data[:at]


def image(
    variables: Variables, attributes: Mapping[str, Any], deflated: Collection[str] = ()
) -> bytes:
    """Return the variables, (dims, values, attributes) by name, as the bytes of a netCDF-4 file.

    A variable with the name of its one dimension is that dimension's coordinate. `deflated` ones
    are shuffled and compressed.
    """
    new = {"mode": "w", "driver": "core", "backing_store": False, "track_order": True}
    with TURN, h5py.File(uuid.uuid4().hex, **new) as file:
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
        if isinstance(value, str):  # of a fixed length: HDF5 is not safe with hostile other ones
            encoded = storable(value).encode()[:MAX_TEXT].decode(errors="ignore").encode()
            kind = h5py.string_dtype("utf-8", max(1, len(encoded)))
            stored.attrs.create(name, encoded, dtype=kind)
        else:
            stored.attrs[name] = value


def storable(text: str) -> str:
    """Return the text as HDF5 can hold it: without NUL and lone surrogates."""
    return text.encode(errors="replace").decode().replace("\0", "\ufffd")


def _image(data: bytes) -> h5py.File:
    """Return an HDF5 file in memory, opened from its bytes."""
    access = h5p.create(h5p.FILE_ACCESS)
    access.set_fapl_core(backing_store=False)
    access.set_file_image(data)
    return h5py.File(h5f.open(uuid.uuid4().hex.encode(), h5f.ACC_RDONLY, access))


@contextlib.contextmanager
def open_file(data: bytes, path: Folder, remedy: str = REMEDY) -> Iterator[h5py.File]:
    """Yield the HDF5 file that `data` is, every part of it checked; `path` is named in errors.

    Raises DamagedJob for what is no HDF5 file or holds what ours never do: groups, links, data in
    other files, foreign filters, types other than numbers and text, more data than can be in it.
    What goes wrong while the caller reads is a DamagedJob, too.
    """
    try:
        with TURN, _image(data) as file:
            for name in file:
                if problem := _objection(file, name, data):
                    raise DamagedJob(path, f"is refused: {name} {problem}", remedy)
            yield file
    except FOREIGN as error:
        if isinstance(error, OSError) and error.errno:
            raise system_error(path, error) from error
        problem = "is no finished job of compsim: cut short, damaged, or foreign"
        raise DamagedJob(path, problem, remedy) from error


def _objection(file: h5py.File, name: str, data: bytes) -> str:
    """Return what is wrong with an entry of the file that `data` is, or ""."""
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
    if math.prod(entry.shape) * dtype.itemsize > len(data) * MAX_EXPANSION:
        return "claims more data than the file can hold"
    return ""


def attributes(stored: Any) -> dict[str, Any]:
    """Return the attributes that are no business of HDF5's or netCDF's: text and numbers."""
    names = (n for n in stored.attrs if n not in OF_NETCDF and not n.startswith("_"))
    return {name: _attribute(stored, name) for name in names}


def _attribute(stored: Any, name: str) -> Any:
    """Return an attribute. Raises ValueError where HDF5 could read more than its type says."""
    found = stored.attrs.get_id(name)
    dtype = found.dtype
    plain = dtype.kind in "fiuS"
    if name == "REFERENCE_LIST":  # a reference and a number
        plain = bool(dtype.names) and h5py.check_ref_dtype(dtype[0]) and dtype[1].kind in "iu"
    size = math.prod(found.shape) * dtype.itemsize
    if not plain or size > stored.file.id.get_filesize():
        raise ValueError(f"{name}: {dtype}")
    value = stored.attrs[name]
    return value.decode() if isinstance(value, bytes) else value


def variables(
    file: h5py.File, data: bytes
) -> dict[str, tuple[tuple[str, ...], np.ndarray, dict[str, Any]]]:
    """Return all variables of the file that `data` is, as `image` takes them."""
    found, dims = {}, _dimensions(file)
    for name, stored in file.items():
        if "NAME" in stored.attrs and str(_attribute(stored, "NAME")).startswith(BARE):
            continue
        found[name] = dims[name], read_variable(stored, data), attributes(stored)
    return found


def read_variable(stored: h5py.Dataset, data: bytes) -> np.ndarray:
    """Return the numbers or texts (object) of a dataset. Raises one of FOREIGN where it has none.

    Texts of any length are taken from the bytes of the file, `data`: HDF5 would follow what a
    hostile file says of their places, and crash or never end.
    """
    kind = stored.id.get_type()  # quicker than `dtype`
    if not (isinstance(kind, h5t.TypeStringID) and kind.is_variable_str()):
        return np.asarray(stored[()])
    count = math.prod(stored.shape)
    places = np.frombuffer(data, TEXT_PLACE, count, stored.id.get_offset()).tolist()
    heaps = {at: _heap_items(data, at) for at in {heap for length, heap, _ in places if length}}
    texts = [heaps[heap][item][:length].decode() if length else "" for length, heap, item in places]
    return np.array(texts, object).reshape(stored.shape)


def _heap_items(data: bytes, heap: int) -> dict[int, bytes]:
    """Return the texts of a global heap, which begins at an offset of a file, by number."""
    if data[heap : heap + len(HEAP)] != HEAP:
        raise ValueError("no heap")
    size = int.from_bytes(data[heap + 8 : heap + 16], "little")
    found: dict[int, bytes] = {}
    at, end = heap + 16, min(heap + size, len(data))
    while at < end:  # number (0: the free rest), length, the text up to a multiple of 8
        number = int.from_bytes(data[at : at + 2], "little")
        length = int.from_bytes(data[at + 8 : at + 16], "little")
        found[number] = data[at + 16 : at + 16 + length]
        at += 16 + (length + 7) // 8 * 8
    return found


def _dimensions(file: h5py.File) -> dict[str, tuple[str, ...]]:
    """Return the names of each variable's dimensions, by the coordinates that refer to it."""
    found = {name: [""] * stored.ndim for name, stored in file.items()}
    for name, stored in file.items():
        if "CLASS" in stored.attrs and _attribute(stored, "CLASS") == "DIMENSION_SCALE":
            found[name] = [name]
        if "REFERENCE_LIST" not in stored.attrs:
            continue
        for variable, number in _attribute(stored, "REFERENCE_LIST"):
            found[file[variable].name.removeprefix("/")][number] = name
    if any("" in names for names in found.values()):
        raise ValueError("a dimension has no name")
    return {name: tuple(names) for name, names in found.items()}
