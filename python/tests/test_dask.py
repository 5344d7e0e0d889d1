"""Fleets, long records and simulations on a cluster of real processes: the numbers of one machine. `test_workers.py` has what goes wrong there."""

import json

import numpy as np
import pytest
from scipy.signal import lfilter

import flexure

distributed = pytest.importorskip("distributed", reason="distributed is not installed: pip install flexure[dask]")
pytest.importorskip("pyarrow", reason="pyarrow is not installed: pip install flexure[dask]")
parquet = pytest.importorskip("pyarrow.parquet")

import flexure.dask  # noqa: E402

KEYS = [f"p{i:02d}" for i in range(12)]


def record(seed, broken=False):
    rng = np.random.default_rng(seed)
    u = rng.uniform(-2, 2, 800)
    w, y = np.clip(u, -1, 0.6), np.zeros(800)
    for i in range(2, 800):
        y[i] = 1.2 * y[i - 1] - 0.55 * y[i - 2] + 0.2 * w[i - 1] + 0.15 * w[i - 2]
    y += 0.01 * rng.standard_normal(800)
    if broken:
        y[300] = np.nan
    return {"u": u, "y": y}


def of_plant(record):
    return flexure.Hammerstein().fit(record, input="u", output="y")


@pytest.fixture(scope="module")
def plants():
    return {key: record(i, broken=key == "p05") for i, key in enumerate(KEYS)}


@pytest.fixture(scope="module")
def client():
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0") as cluster, distributed.Client(cluster) as client:
        yield client


def rows(path):
    return parquet.read_table(path).to_pylist()


def test_the_numbers_are_those_of_one_machine_and_a_broken_record_has_its_error(plants, client, tmp_path):
    table = flexure.dask.identify_fleet(plants, by="plant", model=of_plant, output=tmp_path / "r", client=client)
    found = rows(table)
    assert [row["plant"] for row in found] == KEYS
    assert found[5]["status"] == "failed" and "sample 300" in found[5]["error"] and found[5]["fit_percent"] is None
    for key in ("p00", "p07"):
        own = of_plant(plants[key])
        row = found[KEYS.index(key)]
        assert (row["fit_percent"], row["rms"]) == (own.verdict_.fit_percent, own.verdict_.rms)
        loaded = flexure.load(tmp_path / "r" / row["model"])
        np.testing.assert_array_equal(loaded.linear_.a, own.linear_.a)


def test_a_data_set_of_parquet_and_a_cluster_of_its_own(plants, tmp_path):
    import pyarrow

    for key in KEYS[:3]:
        folder = tmp_path / "data" / f"plant={key}"
        folder.mkdir(parents=True)
        parquet.write_table(pyarrow.table(plants[key]), folder / "part.parquet")
    table = flexure.dask.identify_fleet(tmp_path / "data", by="plant", model=of_plant, output=tmp_path / "r")
    assert [row["fit_percent"] for row in rows(table)] == [of_plant(plants[key]).verdict_.fit_percent for key in KEYS[:3]]


def test_what_cannot_be_is_refused_in_words(plants, client, tmp_path):
    run = flexure.dask.identify_fleet
    some = {"p00": plants["p00"]}
    run(some, by="plant", model=of_plant, output=tmp_path / "r", client=client)
    with pytest.raises(flexure.ParameterError, match="begun with other choices"):
        run(some, by="plant", model=of_plant, output=tmp_path / "r", client=client, name="another")
    with pytest.raises(flexure.ParameterError, match="no machine|empty"):
        run({}, by="plant", model=of_plant, output=tmp_path / "e", client=client)
    with pytest.raises(flexure.ParameterError, match="is no folder"):
        run(tmp_path / "nowhere", by="plant", model=of_plant, output=tmp_path / "e", client=client)
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "notes").write_text("mine")
    with pytest.raises(flexure.ParameterError, match="other files"):
        run(some, by="plant", model=of_plant, output=tmp_path / "mine", client=client)


def test_workers_of_another_version_are_refused(plants, client, tmp_path):
    def change(version):
        import flexure._cluster

        flexure._cluster.version = lambda: version

    client.run(change, "0.0.1")
    try:
        with pytest.raises(flexure.FlexureError, match=r"workers have Flexure 0\.0\.1, but this is"):
            flexure.dask.identify_fleet({"p00": plants["p00"]}, by="plant", model=of_plant, output=tmp_path / "r", client=client)
    finally:
        client.restart()
    assert json.loads((tmp_path / "r" / "fleet.json").read_text())["by"] == "plant"


def correlated(n=60_000):
    rng = np.random.default_rng(3)
    x = np.cumsum(rng.normal(size=n)) % 4 - 2
    return x, np.sin(2 * x) + 0.1 * rng.normal(size=n)


def test_a_regression_over_partitions_is_that_of_one_machine(client):
    import dask.array
    import dask.dataframe
    import pandas

    x, y = correlated()
    at = np.linspace(-1.9, 1.9, 39)
    alone = flexure.StreamedKernelRegressor().fit(x, y)
    frame = dask.dataframe.from_pandas(pandas.DataFrame({"x": x, "y": y}), npartitions=11, sort=False)
    arrays = {"x": dask.array.from_array(x[:, None], chunks=(7000, 1)), "y": dask.array.from_array(y, chunks=7000)}
    for model in (
        flexure.dask.regress(frame, x="x", y="y", client=client),
        flexure.dask.regress(None, **arrays, client=client),
    ):
        assert (model.n_rows_, model.bin_width_, model.bandwidth_) == (60_000, alone.bin_width_, pytest.approx(alone.bandwidth_, rel=1e-10))
        (values, band), (own, own_band) = (m.predict(at, return_band=0.95) for m in (model, alone))
        np.testing.assert_allclose(values, own, rtol=1e-10, atol=1e-10)
        np.testing.assert_allclose(band.lower, own_band.lower, rtol=1e-8, atol=1e-10)
    again = flexure.dask.regress(frame, x="x", y="y", client=client)
    assert again.to_bytes() == flexure.dask.regress(frame, x="x", y="y", client=client).to_bytes()


def test_a_regression_names_the_row_that_is_wrong(client):
    import dask.array

    x, y = correlated(5000)
    y[3456] = np.inf
    parts = {"x": dask.array.from_array(x, chunks=500), "y": dask.array.from_array(y, chunks=500)}
    with pytest.raises(flexure.DataError, match="sample 3456"):
        flexure.dask.regress(None, **parts, client=client)
    with pytest.raises(flexure.ParameterError, match="rechunk"):
        flexure.dask.regress(None, x=parts["x"], y=parts["y"].rechunk(700), client=client)
    with pytest.raises(flexure.ParameterError, match="dask arrays"):
        flexure.dask.regress(None, x=x, y=y, client=client)


def long_record(n, seed=1):
    rng = np.random.default_rng(seed)
    u = rng.uniform(-2, 2, n)
    y = lfilter([0, 0.2, 0.15], [1, -1.2, 0.55], np.clip(u, -1, 0.6))
    return u, y + 0.02 * rng.standard_normal(n)


def in_chunks(arrays, chunks):
    import dask.array

    return [dask.array.from_array(values, chunks=chunks) for values in arrays]


def numbers(model):
    errors = [model.linear_.b_errors, model.linear_.a_errors]
    return np.concatenate([model.linear_.b, model.linear_.a, model.nonlinearity_.y, *errors])


def test_a_system_of_shards_is_that_of_the_whole_record(client):
    u, y = long_record(120_000)
    whole, cut = (
        flexure.dask.identify(*in_chunks((u, y), chunks), dt=0.01, excerpt=20_000, client=client)
        for chunks in (120_000, (500, 20_000, 3_001, 40_000, 56_499))
    )
    np.testing.assert_allclose(numbers(cut), numbers(whole), rtol=1e-10, atol=1e-10)
    # What is held back and what is uncounted at the start of the record.
    assert whole.samples_ == cut.samples_ and 114_000 < whole.samples_ < 115_000
    own = flexure.Hammerstein(fresh=0.05).fit(u, y, dt=0.01)
    assert (whole.order_, whole.delay_, whole.verdict_.holds) == (own.order_, own.delay_, True)
    for name in ("a", "b"):
        value, other = getattr(whole.linear_, name), getattr(own.linear_, name)
        error = getattr(own.linear_, f"{name}_errors")
        assert np.all(abs(value - other) <= 0.3 * error + 1e-12)
        np.testing.assert_allclose(getattr(whole.linear_, f"{name}_errors"), error, rtol=0.05, atol=1e-12)
    # The free run over the end, once its start is forgotten.
    np.testing.assert_allclose(whole.predicted_[100:], whole.simulate(u[-20_000:])[100:], atol=1e-12)


def test_sums_that_are_damaged_or_of_another_version_are_refused_in_words():
    from flexure._core import Sharded, merged_sums, shard_sums

    u, y = long_record(5000)
    point = Sharded([(u, y)], flexure.Hammerstein(fresh=0.05)._options()).point()
    sums = shard_sums(point, u, y, 0, 0, len(u))
    assert merged_sums([sums]) == sums
    for part, reason in ((sums[:4] + b"\x02" + sums[5:], "another version"), (sums[:-9] + b"!" + sums[-8:], "damaged"), (b"{}", "begin otherwise")):
        with pytest.raises(flexure.DataError, match=reason):
            merged_sums([sums, part])


def test_several_records_in_shards_are_experiments_of_one_system(client):
    records = [long_record(30_000, seed) for seed in (2, 3)]
    of_u, of_y = zip(*(in_chunks(record, 9000) for record in records), strict=True)
    found = flexure.dask.identify(list(of_u), list(of_y), excerpt=10_000, client=client)
    own = flexure.Hammerstein(fresh=0.05).fit(*(list(parts) for parts in zip(*records, strict=True)))
    np.testing.assert_allclose(found.linear_.a, own.linear_.a, atol=0.5 * own.linear_.a_errors.max())
    # Both records begin with samples that do not count.
    assert found.samples_ < 57_499 - 60


def test_what_shards_cannot_be_is_refused_in_words(client):
    u, y = long_record(20_000)
    run = flexure.dask.identify
    of_u, of_y = in_chunks((u, y), 4000)
    with pytest.raises(flexure.ParameterError, match="dask arrays"):
        run(u, y, client=client)
    with pytest.raises(flexure.ParameterError, match="must be alike"):
        run(of_u, of_y.rechunk(5000), client=client)
    with pytest.raises(flexure.ParameterError, match="the system remembers .* rechunk"):
        run(*in_chunks((u, y), 20), excerpt=10_000, client=client)
    with pytest.raises(flexure.ParameterError, match="form is 'dead-zone'"):
        run(of_u, of_y, model=flexure.Hammerstein(form="dead-zone"), client=client)
    with pytest.raises(flexure.ParameterError, match="must be 'refined'"):
        run(of_u, of_y, model=flexure.Hammerstein(method="plain"), excerpt=10_000, client=client)
    y[3456] = np.inf
    with pytest.raises(flexure.DataError, match="sample 3456"):
        run(*in_chunks((u, y), 4000), excerpt=10_000, client=client)


def test_simulations_have_the_noise_of_their_places(client):
    arm = flexure.Arm.preset("motor-log").with_(duration=0.5)
    torques = np.random.default_rng(4).normal(size=(5, round(arm.duration / arm.dt) + 1, 2))
    own = arm.simulate_batch(torques)
    on_cluster = flexure.dask.simulate_batch(arm, torques, client=client)
    assert len(on_cluster) == 5 and flexure.dask.simulate_batch(arm, [], client=client) == []
    for a, b in zip(own, on_cluster, strict=True):
        assert a.keys() == b.keys() and all(np.array_equal(a[name], b[name]) for name in a)
