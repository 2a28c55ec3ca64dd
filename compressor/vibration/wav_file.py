"""WAV files: the samples of each channel and the rate, or what is wrong with the file.

By the chunks of RIFF, RIFX and RF64 (EBU Tech 3306), since a record that is cut, or in parts, must
not be used by half.
"""

import struct
from collections.abc import Iterator

import numpy as np

PCM, FLOAT, EXTENSIBLE = 1, 3, 0xFFFE
UNKNOWN = 0xFFFFFFFF  # as a size: in `ds64`, or of a stream that went on to the file's end
INTEGERS = {1: "u1", 2: "i2", 4: "i4", 8: "i8"}  # by bytes a sample
FLOATS = {4: "f4", 8: "f8"}


class WavError(ValueError):
    """Bytes that are no WAV file of samples, in words."""


def read_wav(data: bytes) -> tuple[int, np.ndarray, bool]:
    """Return rate (Hz), samples (channels, n) and whether they are shares of the full scale.

    Whole numbers are such shares, -1 to 1. Raises WavError.
    """
    form = data[:4]
    if form not in (b"RIFF", b"RIFX", b"RF64") or data[8:12] != b"WAVE":
        raise WavError(f"it begins with {data[:12]!r}, not with RIFF, a size and WAVE")
    order = ">" if form == b"RIFX" else "<"
    chunks = list(_chunks(data, order))
    heads = [chunk for name, chunk in chunks if name == b"fmt "]
    parts = [chunk for name, chunk in chunks if name == b"data"]
    if not heads or len(heads[0]) < 16:
        raise WavError("its header, the chunk 'fmt ', is missing or cut")
    if len(parts) != 1:
        raise WavError(f"it has {len(parts)} chunks of data: write it again with one")
    kind, channels, rate, _, frame, _ = struct.unpack(order + "HHIIHH", heads[0][:16])
    if kind == EXTENSIBLE and len(heads[0]) >= 26:
        (kind,) = struct.unpack(order + "H", heads[0][24:26])
    if not channels or not rate:
        raise WavError(f"its header says {channels} channels and {rate} samples a second")
    size, rest = divmod(frame, channels)
    if not parts[0]:
        raise WavError("it has no samples")
    if rest or kind not in (PCM, FLOAT) or size not in ((*INTEGERS, 3), FLOATS)[kind == FLOAT]:
        what = {PCM: "whole numbers", FLOAT: "floats"}.get(kind, f"format {kind}")
        raise WavError(
            f"its samples are {what} of {frame} bytes for {channels} channels: whole numbers of 1 "
            "to 4 and 8 bytes and floats of 4 and 8 are read"
        )
    if len(parts[0]) % frame:
        raise WavError(f"its last sample is cut: {len(parts[0])} bytes, {frame} for each sample")
    if kind == FLOAT:
        return rate, _rows(np.frombuffer(parts[0], order + FLOATS[size]), channels), False
    if size == 3:  # as the upper bytes of four
        threes = np.frombuffer(parts[0], np.uint8).reshape(-1, 3)
        fours = np.zeros((len(threes), 4), np.uint8)
        fours[:, slice(0, 3) if order == ">" else slice(1, 4)] = threes
        values = fours.view(order + "i4")[:, 0]
    else:
        values = np.frombuffer(parts[0], order + INTEGERS[size])
    if size == 1:  # the one format without a sign
        return rate, _rows((values - 128.0) / 128.0, channels), True
    return rate, _rows(values / -float(np.iinfo(values.dtype).min), channels), True


def _rows(values: np.ndarray, channels: int) -> np.ndarray:
    return values.reshape(-1, channels).T


def _chunks(data: bytes, order: str) -> Iterator[tuple[bytes, bytes]]:
    """Yield names and contents of chunks. Raises WavError for one that is cut."""
    place, large = 12, 0  # large: the size of data that RF64 says in `ds64`
    (whole,) = struct.unpack(order + "I", data[4:8])
    is_stream = whole in (0, UNKNOWN) and data[:4] != b"RF64"  # a pipe, whose sizes came too late
    while place + 8 <= len(data):
        name, (size,) = data[place : place + 4], struct.unpack(order + "I", data[place + 4 :][:4])
        begin = place + 8
        left = len(data) - begin
        if name == b"data" and size == UNKNOWN and large:
            size = large
        elif name == b"data" and (size == UNKNOWN or (size == 0 and is_stream)):
            size = left
        if size > left and name in (b"data", b"fmt "):
            raise WavError(
                f"it is cut: its chunk {name.decode('latin-1')!r} has {size} bytes by its size, "
                f"and {left} are there"
            )
        chunk = data[begin : begin + size]
        if name == b"ds64" and size >= 16:
            (large,) = struct.unpack("<Q", chunk[8:16])
        yield name, chunk
        place = begin + size
        if size % 2 and data[place : place + 1] == b"\0":
            place += 1  # the padding of an odd chunk, which some programs leave out
