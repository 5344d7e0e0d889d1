//! `--stream`: sums of the parts of a record in place of its rows.

use super::*;

/// Two row groups, the last of them short: y = sin(2 x) with noise of 0.2.
fn long() -> Folder {
    let mut rng = rng();
    let rows = (1 << 20) + 5000;
    let x: Vec<f64> = (0..rows).map(|_| rng.random_range(-2.0..2.0)).collect();
    let y = x.iter().map(|x| (2.0 * x).sin() + 0.2 * normal(&mut rng)).collect();
    let folder = Folder::new();
    write_record(
        folder.path("r.parquet"),
        &Record::new([("x [m]", x), ("y [N]", y)]).unwrap(),
    )
    .unwrap();
    folder
}

#[test]
fn parts_have_the_result_of_the_rows() {
    let folder = long();
    let told = folder.done("regress r.parquet --x x --y y --stream -o curve.csv");
    assert!(told.contains("rows                1,053,576"), "{told}");
    let header = std::fs::read_to_string(folder.path("curve.csv")).unwrap();
    assert!(
        header.starts_with("\"x [m]\",\"y [N]\",\"lower [N]\",\"upper [N]\"\n"),
        "{header:.60}"
    );
    // Memory for one part at a time, and one thread: the same bytes.
    let mut alone = folder.command("regress");
    alone.args("r.parquet --x x --y y --stream -o alone.csv --memory 128MiB".split(' '));
    assert!(alone.env("RAYON_NUM_THREADS", "1").output().unwrap().status.success());
    let bytes = |name: &str| std::fs::read(folder.path(name)).unwrap();
    assert!(bytes("curve.csv") == bytes("alone.csv"));
    // The truth is found, within the band nearly everywhere.
    let curve = read_record(folder.path("curve.csv")).unwrap().record;
    let column = |name: &str| curve.column(name).unwrap();
    let truth: Vec<f64> = column("x").iter().map(|x| (2.0 * x).sin()).collect();
    let inside = |i: &usize| column("lower")[*i] <= truth[*i] && truth[*i] <= column("upper")[*i];
    assert!((0..truth.len()).filter(inside).count() > 260);
    // The estimate by all rows, with the same bandwidth and at the same places.
    let json = folder.json("regress r.parquet --x x --y y --stream");
    let bandwidth = json["value"][0].as_f64().unwrap();
    assert!(
        (json["prediction_rms"].as_f64().unwrap() - 0.2).abs() < 1e-3,
        "{json:.200}"
    );
    folder.done(&format!(
        "regress r.parquet --x x --y y --estimator local-linear --bandwidth {bandwidth} --at curve.csv --band-method none -o rows.csv"
    ));
    let rows = read_record(folder.path("rows.csv")).unwrap().record;
    let apart = column("y")
        .iter()
        .zip(rows.column("y").unwrap())
        .map(|(a, b)| (a - b).abs());
    let most = apart.fold(0.0, f64::max);
    assert!(most < 1e-5, "{most}");
}

#[test]
fn what_is_read_in_parts_is_refused_in_words() {
    let folder = wave(300);
    let stream = "regress r.parquet --x x --y y --stream";
    folder.misused(
        "regress r.csv --x x --y y --stream",
        "--stream reads Parquet files; flexure prepare RECORD -o RECORD.parquet makes one of what fits into memory",
    );
    folder.done("prepare r.csv -o r.parquet");
    folder.failed(
        "regress r.parquet --x x --y z --stream",
        "r.parquet: no column 'z'; the columns are: x, y, mixed, w",
    );
    folder.misused(
        &format!("{stream} --estimator spline"),
        "--stream is for the estimators kernel and local-linear, not for spline",
    );
    folder.misused(
        &format!("{stream} --memory 1MiB"),
        "--memory: --stream takes 128MiB or more",
    );
    folder.misused(
        &format!("{stream} --time x"),
        "--stream reads Parquet files as they are; leave out --time",
    );
    folder.failed(
        "regress r.parquet --x x --y y --memory 1KiB",
        "r.parquet: a column that is unpacked takes more memory than the limit of 1 KiB; --memory SIZE (such as 8GiB) allows more, and \
         --stream reads it in parts",
    );
    // 300 rows are one block.
    let told = folder
        .command("regress")
        .args(["r.parquet", "--x", "x", "--y", "y", "--stream"])
        .output()
        .unwrap();
    assert!(
        String::from_utf8_lossy(&told.stderr).contains("cross-validation by blocks of rows"),
        "{told:?}"
    );
    folder.done(&format!("{stream} --bandwidth 0.3"));
    // A row without a number is named.
    folder.write("gap.csv", format!("x,y\n{}1,\n", "1,2\n".repeat(7)));
    folder.done("prepare gap.csv -o gap.parquet");
    folder.failed(
        "regress gap.parquet --x x --y y --stream",
        "gap.parquet: column 'y' is NaN or missing at sample 7; remove or repair that sample",
    );
}
