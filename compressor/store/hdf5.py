"""HDF5 files in memory: built as bytes that are netCDF-4, and opened from bytes, checked.

HDF5 can crash the process when a disk fills up while it writes, or when it follows what a damaged
file says; so that it never touches a disk here: `compressor.store.files` writes the bytes, and who
reads them compares their digest first. A digest shows damage, not malice: what is opened is
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
from functools import lru_cache
from typing import Any, NamedTuple

import h5py
import numpy as np
from h5py import h5a, h5d, h5f, h5l, h5o, h5p, h5s, h5t, h5z

from compressor.store.files import Folder, StoreError, system_error

Arrays = Mapping[str, np.ndarray]
Variables = Mapping[str, tuple[tuple[str, ...], np.ndarray, Mapping[str, Any]]]

TEXT = h5py.string_dtype()  # variable-length UTF-8
OF_NETCDF = {"CLASS", "NAME", "DIMENSION_LIST", "REFERENCE_LIST"}  # attributes
LAYOUTS = {h5d.COMPACT, h5d.CONTIGUOUS, h5d.CHUNKED}  # a virtual dataset lies in other files
FILTERS = {h5z.FILTER_DEFLATE, h5z.FILTER_SHUFFLE, h5z.FILTER_FLETCHER32}
GZIP_LEVEL = 4
SCALAR = h5s.create(h5s.SCALAR)
MAX_TAG = 255  # attributes of a file that a byte tells apart
MAX_TEMPLATES = 16  # that are kept, one for each layout of late
MAX_FILLERS = 32  # that are kept; attributes of other lengths need one of their own
MAX_TEMPLATE_BYTES = 2_000_000  # of numbers in a file for which they are kept
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


class Entry(NamedTuple):
    """What a variable of a file is but for its numbers: what all files of one layout share."""

    name: str
    dims: tuple[str, ...]
    shape: tuple[int, ...]
    dtype: np.dtype
    texts: tuple[str, ...] | None  # a variable of texts has its values here
    attributes: tuple[tuple[str, Any], ...]
    deflated: bool


Kinds = tuple[tuple[str, np.dtype, tuple[int, ...]], ...]  # of attributes: name, type, shape


class ArrayPlace(NamedTuple):
    """Where values stand in a file: at which byte, and what they are."""

    offset: int
    dtype: np.dtype
    shape: tuple[int, ...]

    def of(self, data: bytearray) -> np.ndarray:
        """Return the values that stand there, to be written over."""
        values = np.frombuffer(data, self.dtype, math.prod(self.shape), self.offset)
        return values.reshape(self.shape)


class FileTemplate:
    """The bytes of a netCDF-4 file whose numbers and own attributes are still to be filled in.

    By h5py's high level a file costs some twenty times what its bytes do, and jobs of one layout
    differ in nothing but numbers: so a file is laid out once and filled in for each job. Numbers
    are written where HDF5 has put them; HDF5 writes the attributes of the file, and what it
    compresses.
    """

    def __init__(self, layout: tuple[Entry, ...]):
        with TURN, h5py.File(_new_file()) as file:
            # held by name: to open one again takes as long as to write it
            stored = {entry.name: _lay_out(file, entry) for entry in layout}
            for entry in layout:
                for number, dim in enumerate(entry.dims):
                    if dim not in stored:  # takes no space: nothing is written to it
                        stored[dim] = file.create_dataset(dim, (entry.shape[number],), ">f4")
                        stored[dim].make_scale(f"{BARE}{entry.shape[number]:10}")
                    if dim != entry.name:
                        stored[entry.name].dims[number].attach_scale(stored[dim])
            file.flush()
            self.data = bytearray(file.id.get_file_image())
            self.deflated = [entry.name for entry in layout if entry.deflated]
            self.places = {
                entry.name: ArrayPlace(stored[entry.name].id.get_offset(), entry.dtype, entry.shape)
                for entry in layout
                if not entry.deflated and entry.texts is None and 0 not in entry.shape
            }

    def fill(self, numbers: Arrays, attributes: Arrays) -> bytes:
        """Return the bytes of a file of this layout, which depend on nothing filled in before."""
        with TURN:
            for name, place in self.places.items():
                place.of(self.data)[...] = numbers[name]
            file = _open_image(self.data, h5f.ACC_RDWR)
            try:
                for name in self.deflated:
                    values = np.ascontiguousarray(numbers[name])
                    h5d.open(file, name.encode()).write(h5s.ALL, h5s.ALL, values)
                _write_attributes(file, attributes)
                h5f.flush(file)
                return file.get_file_image()
            finally:
                file.close()


class Stencil(NamedTuple):
    """A whole file, whose numbers and attributes are written over for each job, in its bytes."""

    data: bytearray
    numbers: dict[str, np.ndarray]
    attributes: dict[str, np.ndarray]

    def fill(self, numbers: Arrays, attributes: Arrays) -> bytes:
        """Return the bytes that its `FileTemplate` makes of the same, in a tenth of a ms."""
        with TURN:
            for name, place in self.numbers.items():
                place[...] = numbers[name]
            for name, place in self.attributes.items():
                place[...] = attributes[name]
            return bytes(self.data)


@lru_cache(maxsize=MAX_TEMPLATES)
def _template_of(layout: tuple[Entry, ...]) -> FileTemplate:
    return FileTemplate(layout)


class Filler:
    """What makes files of a layout with attributes of some kinds.

    The first one by its template, since it may stay the only one; others by a stencil, which takes
    three times as long to cut, where there can be one.
    """

    def __init__(self, template: FileTemplate, kinds: Kinds):
        self.template, self.kinds = template, kinds
        self.count = 0
        self.stencil: Stencil | None = None

    def fill(self, numbers: Arrays, attributes: Arrays) -> bytes:
        """Return the bytes of a file."""
        self.count += 1
        if self.count == 2:
            self.stencil = _cut_stencil(self.template, self.kinds)
        return (self.stencil or self.template).fill(numbers, attributes)


@lru_cache(maxsize=MAX_FILLERS)
def _filler_of(layout: tuple[Entry, ...], kinds: Kinds) -> Filler:
    return Filler(_template_of(layout), kinds)


def _cut_stencil(template: FileTemplate, kinds: Kinds) -> Stencil | None:
    """Return a stencil for files of a template with attributes of some kinds.

    Where HDF5 puts the values of attributes shows in a file whose attributes have each a byte of
    its own all over. None where the stencil does not make that very file: something depends on the
    values (what is compressed, a checksum), and HDF5 has to write each file.
    """
    if template.deflated or len(kinds) > MAX_TAG:
        return None
    zeros = {name: np.zeros(place.shape, place.dtype) for name, place in template.places.items()}
    blank = {name: _repeat_byte(0, dtype, shape) for name, dtype, shape in kinds}
    tagged = {kind[0]: _repeat_byte(tag, *kind[1:]) for tag, kind in enumerate(kinds, 1)}
    data, wanted = bytearray(template.fill(zeros, blank)), template.fill(zeros, tagged)
    found = np.frombuffer(wanted, np.uint8)
    differing = np.flatnonzero(found != np.frombuffer(data, np.uint8))[::-1]
    first = dict(zip(found[differing].tolist(), differing.tolist(), strict=True))  # of each tag
    attributes = {
        name: ArrayPlace(first.get(tag, 0), dtype, shape).of(data)
        for tag, (name, dtype, shape) in enumerate(kinds, 1)
    }
    numbers = {name: place.of(data) for name, place in template.places.items()}
    stencil = Stencil(data, numbers, attributes)
    return stencil if stencil.fill(zeros, tagged) == wanted else None


def _repeat_byte(byte: int, dtype: np.dtype, shape: tuple[int, ...]) -> np.ndarray:
    """Return values of a type whose bytes are all the same."""
    return np.full(dtype.itemsize * math.prod(shape), byte, np.uint8).view(dtype).reshape(shape)


def image(
    variables: Variables,
    attributes: Mapping[str, Any],
    deflated: Collection[str] = (),
    repeated: bool = False,
) -> bytes:
    """Return the variables, (dims, values, attributes) by name, as the bytes of a netCDF-4 file.

    A variable with the name of its one dimension is that dimension's coordinate. `deflated` ones
    are shuffled and compressed. repeated: other files of the same layout will follow, so that what
    they share is kept for them.
    """
    layout = tuple(
        Entry(
            name, dims, values.shape, values.dtype,
            tuple(values.ravel().tolist()) if values.dtype.kind in "OU" else None,
            tuple(attrs.items()), name in deflated,
        )
        for name, (dims, values, attrs) in variables.items()
    )  # fmt: skip
    numbers = {name: values for name, (_, values, _) in variables.items()}
    encoded = {name: _encode(value) for name, value in attributes.items()}
    filler: FileTemplate | Filler
    if repeated and sum(values.nbytes for values in numbers.values()) <= MAX_TEMPLATE_BYTES:
        kinds = tuple((name, value.dtype, value.shape) for name, value in encoded.items())
        filler = _filler_of(layout, kinds)
    else:
        filler = FileTemplate(layout)
    return filler.fill(numbers, encoded)


def _new_file() -> h5f.FileID:
    """Return a new HDF5 file in memory that knows the order of its variables.

    Headers newer than those of HDF5 1.6, as the order of attributes needs, have checksums: a
    `Stencil` could not write over them.
    """
    new, access = h5p.create(h5p.FILE_CREATE), h5p.create(h5p.FILE_ACCESS)
    new.set_link_creation_order(h5p.CRT_ORDER_TRACKED | h5p.CRT_ORDER_INDEXED)
    new.set_obj_track_times(False)  # the same values are the same bytes
    access.set_libver_bounds(h5f.LIBVER_EARLIEST, h5f.LIBVER_LATEST)
    access.set_fapl_core(backing_store=False)
    return h5f.create(uuid.uuid4().hex.encode(), h5f.ACC_TRUNC, new, access)


def _lay_out(file: h5py.File, entry: Entry) -> h5py.Dataset:
    """Return a new dataset with its attributes; numbers, unless compressed, have their place."""
    how: dict[str, Any] = {"dtype": entry.dtype}
    if entry.texts is not None:
        how = {"data": np.array(entry.texts, object).reshape(entry.shape), "dtype": TEXT}
    elif not entry.deflated:
        how["data"] = np.zeros(entry.shape, entry.dtype)
    if entry.deflated:
        how |= {"compression": GZIP_LEVEL, "shuffle": True}
    stored = file.create_dataset(entry.name, entry.shape, **how)
    _write_attributes(stored.id, {name: _encode(value) for name, value in entry.attributes})
    if entry.dims == (entry.name,):
        stored.make_scale(entry.name)
    return stored


def _encode(value: Any) -> np.ndarray:
    """Return the value of an attribute as it is stored."""
    if not isinstance(value, str):
        values = np.asarray(value)
        return np.char.encode(values, "utf-8") if values.dtype.kind == "U" else values
    # of a fixed length: HDF5 is not safe with hostile texts of any other
    encoded = storable(value).encode()[:MAX_TEXT].decode(errors="ignore").encode()
    return np.array(encoded, f"S{max(1, len(encoded))}")


def _write_attributes(stored: h5d.DatasetID | h5f.FileID, attributes: Arrays) -> None:
    for name, value in attributes.items():
        kind = _type_of(value.dtype)
        space = h5s.create_simple(value.shape) if value.ndim else SCALAR
        h5a.create(stored, name.encode(), kind, space).write(value, kind)


@lru_cache(maxsize=1000)  # HDF5 needs longer to make a type than to write a value of it
def _type_of(dtype: np.dtype) -> h5t.TypeID:
    """Return the type of attributes, UTF-8 of texts."""
    is_text = dtype.kind == "S"
    return h5t.py_create(
        h5py.string_dtype("utf-8", dtype.itemsize) if is_text else dtype, logical=True
    )


def storable(text: str) -> str:
    """Return the text as HDF5 can hold it: without NUL and lone surrogates."""
    return text.encode(errors="replace").decode().replace("\0", "\ufffd")


def _open_image(data: bytes | bytearray, access: int = h5f.ACC_RDONLY) -> h5f.FileID:
    """Return an HDF5 file in memory, opened from its bytes."""
    how = h5p.create(h5p.FILE_ACCESS)
    how.set_fapl_core(backing_store=False)
    how.set_file_image(data)
    return h5f.open(uuid.uuid4().hex.encode(), access, how)


@contextlib.contextmanager
def open_file(
    data: bytes, path: Folder, remedy: str = REMEDY, names: Collection[str] | None = None
) -> Iterator[h5py.File]:
    """Yield the HDF5 file that `data` is, every part of it checked; `path` is named in errors.

    names: of the parts that are read; the others are not checked. All without.

    Raises DamagedJob for what is no HDF5 file or holds what ours never do: groups, links, data in
    other files, foreign filters, types other than numbers and text, more data than can be in it.
    What goes wrong while the caller reads is a DamagedJob, too.
    """
    try:
        with TURN, h5py.File(_open_image(data)) as file:
            for name in file if names is None else names:
                if problem := _objection(file, name, data):
                    raise DamagedJob(path, f"is refused: {name} {problem}", remedy)
            yield file
    except FOREIGN as error:
        if isinstance(error, OSError) and error.errno:
            raise system_error(path, error) from error
        problem = "is no finished job of compsim: cut short, damaged, or foreign"
        raise DamagedJob(path, problem, remedy) from error


def _objection(file: h5py.File, name: str, data: bytes) -> str:
    """Return what is wrong with an entry of the file that `data` is, or "", as of none."""
    encoded = name.encode(errors="surrogateescape")
    if not file.id.links.exists(encoded):  # which follows no link
        return ""
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
