"""Writes the HDF5 fixtures of crates/flexure-io/tests/data/hdf5 with h5py, and what h5py reads of them as hdf5.json.

Usage: python scripts/reference/hdf5_fixtures.py    (h5py 3.16)

`v73.mat` has the layout of MATLAB's `-v7.3`: a block of 512 bytes before the signature, columns as rows, classes as attributes.
"""

import json
import pathlib
import struct

import h5py
import numpy as np

OUT = pathlib.Path(__file__).resolve().parents[2] / "crates/flexure-io/tests/data/hdf5"
N = 50
k = np.arange(N)
SIGNALS = {
    "t": k / 8.0,
    "u": np.sin(k) * 1e-3,
    "counts": (k - 3).astype(np.int16),
    "single": (k / 7).astype(np.float32),
    "on": k % 2 == 0,
    "wide": k.astype(np.int64) - 2**53 + N,
    "byte": k.astype(np.uint8),
}
TOO_WIDE = k.astype(np.uint64) + np.uint64(2**63)


def bits(values):
    return [struct.pack(">d", float(v)).hex() for v in np.ravel(values)]


def h5(name, libver="earliest", big=False, **options):
    with h5py.File(OUT / name, "w", libver=libver) as file:
        for key, values in SIGNALS.items():
            kind = values.dtype.newbyteorder(">") if big and values.dtype.itemsize > 1 else values.dtype
            made = file.create_dataset(key, data=values.astype(kind), **options)
            if key == "u":
                made.attrs["units"] = "N m"
        group = file.create_group("axis")
        group.create_dataset("q", data=np.cos(k), **options)
        deeper = group.create_group("slow")
        deeper.create_dataset("x", data=np.arange(5.0))
        if name == "groups.h5":
            return
        del group["slow"]
        file["gain"] = 35.15
        file["label"] = "motor"
        file["pair"] = np.zeros((N, 2))
        file["phasor"] = k + 1j * k
        file["nothing"] = np.zeros(0)
        file["too_wide"] = TOO_WIDE


def mat(name):
    with h5py.File(OUT / name, "w", userblock_size=512) as file:
        for key, values in SIGNALS.items():
            classes = {"bool": "logical", "float64": "double", "float32": "single"}
            stored = values.astype(np.uint8) if values.dtype == bool else values
            made = file.create_dataset(key, data=stored.reshape(1, -1), chunks=(1, 20), compression="gzip", shuffle=True)
            made.attrs["MATLAB_class"] = np.bytes_(classes.get(values.dtype.name, values.dtype.name))
        made = file.create_dataset("gain", data=np.array([[35.15]]))
        made.attrs["MATLAB_class"] = np.bytes_("double")
        made = file.create_dataset("label", data=np.frombuffer("motor".encode("utf-16le"), np.uint16).reshape(-1, 1))
        made.attrs["MATLAB_class"] = np.bytes_("char")
        made = file.create_dataset("nothing", data=np.array([0, 0], dtype=np.uint64))
        made.attrs["MATLAB_class"] = np.bytes_("double")
        made.attrs["MATLAB_empty"] = np.uint8(1)
        inner = file.create_group("#refs#").create_dataset("a", data=np.arange(3.0))
        cells = file.create_dataset("cells", data=np.array([[inner.ref]], dtype=h5py.ref_dtype))
        cells.attrs["MATLAB_class"] = np.bytes_("cell")
        axis = file.create_group("axis")
        axis.attrs["MATLAB_class"] = np.bytes_("struct")
        axis.create_dataset("q", data=np.cos(k).reshape(1, -1)).attrs["MATLAB_class"] = np.bytes_("double")
    head = b"MATLAB 7.3 MAT-file, fixture".ljust(124) + b"\x00\x02IM"
    with open(OUT / name, "r+b") as file:
        file.write(head)


def made(file, name, kind, values, filters=None):
    """A vector of a type that h5py does not choose by itself."""
    create = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    if filters:
        create.set_chunk((len(values),))
        filters(create)
    space = h5py.h5s.create_simple((len(values),))
    dataset = h5py.h5d.create(file.id, name.encode(), kind, space, create)
    dataset.write(h5py.h5s.ALL, h5py.h5s.ALL, np.ascontiguousarray(values))


def layouts(name):
    """Numbers that do not fill their bytes as those of processors do."""
    with h5py.File(OUT / name, "w") as file:
        file["u"] = SIGNALS["u"]
        file["half"] = (k / 3).astype(np.float16)
        file["none"] = h5py.Empty("f8")
        shifted = h5py.h5t.STD_I16LE.copy()
        shifted.set_precision(12)
        shifted.set_offset(4)
        made(file, "shifted", shifted, (k - 30).astype(np.int16))
        packed = h5py.h5t.STD_I32LE.copy()
        packed.set_precision(17)
        packed.set_offset(3)
        made(file, "packed", packed, (k - 3000).astype(np.int32), lambda create: create.set_filter(h5py.h5z.FILTER_NBIT))
        wide = h5py.h5t.IEEE_F32LE.copy()
        wide.set_fields(31, 20, 11, 0, 20)
        wide.set_ebias(1023)
        made(file, "other_float", wide, np.sin(k))


def user_block(name):
    with h5py.File(OUT / name, "w", userblock_size=2048) as file:
        file["u"] = SIGNALS["u"]
        file.create_group("slow")["x"] = np.arange(5.0)
    with open(OUT / name, "r+b") as file:
        file.write(b"notes of the user\n")


def main():
    OUT.mkdir(exist_ok=True, parents=True)
    layouts("layouts.h5")
    user_block("block.h5")
    h5("plain.h5")
    h5("latest.h5", libver="latest", chunks=(7,), compression="gzip", shuffle=True, fletcher32=True)
    h5("big.h5", big=True)
    h5("chunks.h5", chunks=(16,), compression="gzip")
    h5("groups.h5")
    mat("v73.mat")
    whole = (OUT / "chunks.h5").read_bytes()
    (OUT / "truncated.h5").write_bytes(whole[: len(whole) * 2 // 3])
    with h5py.File(OUT / "nothing.h5", "w") as file:
        file["label"] = "motor"
    with h5py.File(OUT / "plain.h5") as file:
        read = {key: bits(file[key][()]) for key in [*SIGNALS, "axis/q"]}
    (OUT / "hdf5.json").write_text(json.dumps(read, indent=0) + "\n")
    for name in ("latest.h5", "big.h5", "chunks.h5", "v73.mat"):
        with h5py.File(OUT / name) as file:
            assert all(bits(file[key][()]) == values for key, values in read.items()), name


if __name__ == "__main__":
    main()
