"""Writes the Parquet fixtures of crates/flexure-io/tests/data with PyArrow.

Usage: python scripts/reference/parquet_fixtures.py
"""

import datetime
import math
import pathlib

import pyarrow as pa
import pyarrow.parquet as pq

OUT = pathlib.Path(__file__).resolve().parents[2] / "crates/flexure-io/tests/data"
N = 6
table = pa.table(
    {
        "t": pa.array([k / 8 for k in range(N)], pa.float64()),
        "u": pa.array([None if k == 2 else math.sin(k) * 1e-3 for k in range(N)], pa.float64()),
        "single": pa.array([k / 4 for k in range(N)], pa.float32()),
        "counts": pa.array([None if k == 5 else k - 3 for k in range(N)], pa.int16()),
        "unsigned": pa.array([2**32 - 1 - k for k in range(N)], pa.uint32()),
        "wide": pa.array([2**53 - k for k in range(N)], pa.int64()),
        "too_wide": pa.array([2**63 + k for k in range(N)], pa.uint64()),
        "on": pa.array([k % 2 == 0 for k in range(N)], pa.bool_()),
        "label": pa.array(["a"] * N, pa.string()),
        "when": pa.array([datetime.datetime(2026, 1, 1)] * N, pa.timestamp("us")),
        "pair": pa.array([[1.0, 2.0]] * N, pa.list_(pa.float64())),
    }
)
for codec in ["none", "snappy", "zstd", "gzip"]:
    # Two row groups, the last one short.
    pq.write_table(table, OUT / f"signals_{codec}.parquet", compression=codec, row_group_size=4)
pq.write_table(table.slice(0, 0), OUT / "no_rows.parquet")
pq.write_table(table.select(["label"]), OUT / "no_numbers.parquet")
