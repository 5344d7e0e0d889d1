use super::*;

/// Of columns that are rounded to a step, many values lie on the bins' edges.
#[test]
fn rounded_abscissas_have_one_bin_each_at_most() {
    for (values, step, per_bandwidth) in [
        (3001, 0.001, 30.0),
        (1001, 0.01, 12.0),
        (1001, 0.01, 30.0),
        (361, 1.0, 30.0),
        (101, 0.1, 12.0),
    ] {
        let distinct: Vec<f64> = (0..values).map(|k| f64::from(k) * step).collect();
        let x: Vec<f64> = distinct.iter().flat_map(|&x| [x; 20]).collect();
        let data = Sorted::new(&x, &x);
        let extent = f64::from(values - 1) * step;
        let pyramid = Pyramid::new(&data, 1e-4 * extent, extent, per_bandwidth);
        for bins in pyramid.levels.iter().map(OneWidth::bins) {
            // One more where the points' chunks meet.
            assert!(bins.data.len() <= distinct.len() + x.len() / CHUNK);
            let points: f64 = (0..bins.data.len()).map(|b| bins.data.weight(b)).sum();
            assert_eq!(points, x.len() as f64);
        }
    }
}
