"""Files that the usual tools write, read by the program."""

from __future__ import annotations

import csv
import json
import subprocess

import numpy as np
import pandas as pd
import polars as pl
import pytest

import flexure

STEP = 0.01
SAMPLES = 400


def columns():
    rng = np.random.default_rng(1)
    u = rng.uniform(-2, 2, SAMPLES)
    y = np.convolve(np.clip(u, -1, 1), 0.5 * 0.6 ** np.arange(20))[:SAMPLES]
    return {"t": STEP * np.arange(SAMPLES), "u": u, "y": y}


def frame():
    return pd.DataFrame(columns())


def pandas_with_its_index(path):
    frame().to_csv(path)


def pandas_without_its_index(path):
    frame().to_csv(path, index=False)


def pandas_with_time_as_index(path):
    table = frame()
    table.index = pd.date_range("2024-05-01 10:00", periods=SAMPLES, freq="10ms")
    table.index.name = "time"
    table.drop(columns="t").to_csv(path)


def pandas_with_a_zone(path):
    table = frame()
    table["t"] = pd.date_range("2024-05-01 10:00", periods=SAMPLES, freq="10ms", tz="Europe/Berlin")
    table.to_csv(path, index=False)


def pandas_for_a_german_spreadsheet(path):
    frame().rename(columns={"t": "Time [s]"}).to_csv(path, index=False, sep=";", decimal=",", encoding="utf-8-sig", lineterminator="\r\n")


def pandas_with_text_and_missing_samples(path):
    table = frame()
    table["state"] = "run"
    table["temperature"] = np.where(np.arange(SAMPLES) % 7, 20.5, np.nan)
    table.to_csv(path, index=False, na_rep="NA")


def polars(path):
    pl.DataFrame(columns()).write_csv(path)


def polars_with_time_stamps(path):
    start = pl.datetime(2024, 5, 1, 10, time_unit="us")
    table = pl.DataFrame(columns()).with_columns(t=start + pl.duration(microseconds=pl.int_range(SAMPLES) * 10_000))
    table.write_csv(path)


def numpy_with_a_header(path):
    np.savetxt(path, np.column_stack(list(columns().values())), delimiter=",", header="t,u,y", comments="")


def numpy_between_tabs(path):
    np.savetxt(path, np.column_stack(list(columns().values())), delimiter="\t", header="t\tu\ty", comments="")


def csv_with_every_field_quoted(path):
    with open(path, "w", newline="") as file:
        writer = csv.writer(file, quoting=csv.QUOTE_ALL)
        writer.writerow(columns())
        writer.writerows(zip(*columns().values(), strict=True))


def csv_with_units_in_a_row(path):
    with open(path, "w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(columns())
        writer.writerow(["s", "V", "rad/s"])
        writer.writerows(zip(*columns().values(), strict=True))


def parquet_of_polars(path):
    pl.DataFrame(columns()).write_parquet(path)


FILES = [
    pandas_with_its_index,
    pandas_without_its_index,
    pandas_with_time_as_index,
    pandas_with_a_zone,
    pandas_for_a_german_spreadsheet,
    pandas_with_text_and_missing_samples,
    polars,
    polars_with_time_stamps,
    numpy_with_a_header,
    numpy_between_tabs,
    csv_with_every_field_quoted,
    csv_with_units_in_a_row,
    parquet_of_polars,
]


def identified(program, path, *options):
    command = [program, "identify", str(path), "--input", "u", "--output", "y", "--json", *options]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.fixture(scope="module")
def expected(program, tmp_path_factory):
    path = tmp_path_factory.mktemp("files") / "plain.csv"
    pandas_without_its_index(path)
    return json.loads(identified(program, path).stdout)


@pytest.mark.parametrize("write", FILES, ids=lambda write: write.__name__)
def test_a_file_of_this_tool_gives_the_model(write, program, expected, tmp_path):
    path = tmp_path / f"log.{'parquet' if 'parquet' in write.__name__ else 'csv'}"
    write(path)
    done = identified(program, path)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["sample_time"] == pytest.approx(STEP, rel=1e-9)
    assert found["fit_percent"] == pytest.approx(expected["fit_percent"], abs=1e-6)


def test_numpy_without_a_header(program, expected, tmp_path):
    path = tmp_path / "log.txt"
    np.savetxt(path, np.column_stack(list(columns().values())))
    command = [program, "identify", str(path), "--input", "c1", "--output", "c2", "--time", "c0", "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert "the columns are called c0, c1, c2" in done.stderr
    assert json.loads(done.stdout)["fit_percent"] == pytest.approx(expected["fit_percent"], abs=1e-6)


def test_the_standard_input(program, expected):
    text = frame().to_csv(index=False)
    command = [program, "identify", "-", "--input", "u", "--output", "y", "--json"]
    done = subprocess.run(command, input=text, capture_output=True, text=True, check=True)
    assert json.loads(done.stdout)["fit_percent"] == pytest.approx(expected["fit_percent"], abs=1e-6)


def test_texts_for_missing_samples_are_named(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("t,u,y\n0,1,2\n0.01,2,Bad\n0.02,3,OVER\n")
    assert list(flexure.read(path)) == ["t", "u"]
    for texts in (["Bad", "OVER"], ("Bad", "OVER")):
        np.testing.assert_array_equal(flexure.read(path, missing_text=texts)["y"], [2, np.nan, np.nan])
    path.write_text("t,u\n0,1\n0.01,-9999\n")
    np.testing.assert_array_equal(flexure.read(path, missing_text="-9999")["u"], [1, np.nan])
