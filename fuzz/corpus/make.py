#!/usr/bin/env python3
"""Makes the binary files of this corpus: a few bytes that declare more numbers than any memory has.

    python fuzz/corpus/make.py          # needs h5py, numpy and pyarrow
"""

import struct
import zlib
from pathlib import Path

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

HERE = Path(__file__).parent


def element(kind, data):
    """An element of a MAT file: its kind, its length, its bytes, filled to eight."""
    return struct.pack("<II", kind, len(data)) + data + bytes(-len(data) % 8)


def matrix(dimensions, declared, data):
    """A matrix of doubles called `u` with these dimensions, whose numbers are said to take `declared` bytes."""
    flags = element(6, struct.pack("<II", 6, 0))
    sizes = element(5, struct.pack(f"<{len(dimensions)}i", *dimensions))
    numbers = struct.pack("<II", 9, declared) + data
    parts = flags + sizes + element(1, b"u") + numbers
    return struct.pack("<II", 14, len(parts)) + parts


def varint(number):
    """A signed number as Thrift's compact protocol writes it."""
    number, out = number << 1, bytearray()
    while number > 0x7F:
        out.append(number & 0x7F | 0x80)
        number >>= 7
    return bytes(out) + bytes([number])


mat = b"MATLAB 5.0 MAT-file".ljust(116) + bytes(8) + struct.pack("<HH", 0x0100, 0x4D49)
eight = np.arange(8.0).tobytes()
(HERE / "mat/dimensions.mat").write_bytes(mat + matrix([2**31 - 1, 2**31 - 1], len(eight), eight))
(HERE / "mat/negative.mat").write_bytes(mat + matrix([-8, 1], len(eight), eight))
(HERE / "mat/declared.mat").write_bytes(mat + matrix([2**29 - 1, 1], 2**32 - 8, eight))
for name, inner in [
    ("compressed", matrix([2**29 - 1, 1], 2**32 - 8, bytes(1 << 20))),
    ("nested", element(15, zlib.compress(matrix([8, 1], len(eight), eight)))),
]:
    (HERE / f"mat/{name}.mat").write_bytes(mat + element(15, zlib.compress(inner, 9)))

rows = 100_000
path = HERE / "parquet/rows.parquet"
pq.write_table(pa.table({"u": np.zeros(rows), "y": np.zeros(rows)}), path, compression="zstd", store_schema=False)
file = path.read_bytes()
length = struct.unpack("<I", file[-8:-4])[0]
start, footer = file[: -8 - length], file[-8 - length : -8]
footer = footer.replace(varint(rows), varint(10**15))
path.write_bytes(start + footer + struct.pack("<I", len(footer)) + b"PAR1")
(HERE / "parquet/footer.parquet").write_bytes(b"PAR1" + struct.pack("<I", 2**32 - 1) + b"PAR1")

with h5py.File(HERE / "hdf5/fill.h5", "w") as file:
    file.create_dataset("u", (2**50,), "f8", chunks=(2**20,), compression="gzip")
with h5py.File(HERE / "hdf5/many.h5", "w") as file:
    file.create_dataset("u", (4, 2**40), "f4", chunks=(1, 2**10), fillvalue=1.0)
