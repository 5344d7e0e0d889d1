//! Cauchy x, clusters, ties and an offset against sums made directly.

use super::*;

/// Heavy tails, a cluster, ties; ordinates at 1e6.
fn rough(n: usize) -> (Vec<f64>, Vec<f64>) {
    let mut rng: rand_pcg::Pcg64 = rand::SeedableRng::seed_from_u64(11);
    let mut draw = |low: f64, high: f64| rand::RngExt::random_range(&mut rng, low..high);
    let x: Vec<f64> = (0..n)
        .map(|i| match i % 4 {
            0 => 2.0 + 1e-7 * draw(-1.0, 1.0),
            1 => draw(-3.0, 3.0).round() / 4.0,
            2 => (std::f64::consts::PI * draw(-0.5, 0.5)).tan(),
            _ => draw(-1.0, 1.0),
        })
        .collect();
    let y = x.iter().map(|x| 1e6 + x.sin() + draw(-0.5, 0.5)).collect();
    (x, y)
}

#[test]
fn rough_data_are_summed_as_directly() {
    let (x, y) = rough(400);
    let at: Vec<f64> = x.iter().step_by(7).map(|x| x + 1e-3).chain([-20.0, 5.0]).collect();
    let about = |v: Vec<f64>| v.iter().map(|v| v - 1e6).collect::<Vec<f64>>();
    let outside = Outside::Nearest;
    let bounded = |(low, high): (f64, f64), v: f64| v.clamp(low, high);
    let range = x
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(*x), h.max(*x)));

    // Means over cells, and over the nearest: as exact as ordinates at 1e6 are.
    let haar = HaarRegression {
        levels: Choice::Fixed(6),
        outside,
    }
    .fit(&[&x], &y, None)
    .unwrap();
    let want: Vec<f64> = at
        .iter()
        .map(|q| dyadic_mean(&x, &y, range, bounded(range, *q)))
        .collect();
    close("haar", &about(haar.predict(&[&at]).unwrap()), &want, 1e-9);
    let neighbours = NearestNeighbours {
        neighbours: Choice::Fixed(9),
        outside,
    }
    .fit(&[&x], &y, None)
    .unwrap();
    let want: Vec<f64> = at
        .iter()
        .map(|q| nearest_mean(&x, &y, bounded(range, *q), 9.0))
        .collect();
    close("neighbours", &about(neighbours.predict(&[&at]).unwrap()), &want, 1e-9);

    // Least squares on the same functions, by a QR decomposition of columns of one size. For a few far points and many near ones, both lose
    // as many digits as the condition number has. For the cluster and the ties they lose none.
    for (reach, tolerance) in [(f64::INFINITY, 1e-7), (2.5, 1e-9)] {
        let kept: Vec<usize> = (0..x.len()).filter(|&i| x[i].abs() < reach).collect();
        let of = |v: &[f64]| kept.iter().map(|&i| v[i]).collect::<Vec<f64>>();
        let (x, y) = (of(&x), of(&y));
        let range = x
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(*x), h.max(*x)));
        let at: Vec<f64> = at.iter().map(|q| bounded(range, *q)).collect();
        for (name, fit) in FIXED
            .iter()
            .filter(|f| ["fourier", "cosine", "legendre", "polynomial"].contains(&f.0))
        {
            let got = fit(&[&x], &y, None, outside).unwrap().predict(&[&at]).unwrap();
            let want = projected(&x, &y, range, &at, |u| on_unit(name, u));
            close(name, &about(got), &want, tolerance);
        }
    }
}

/// The mean minus 1e6, over the smallest of the cells 1/64, 1/32, ... of the range around `q` that has data.
fn dyadic_mean(x: &[f64], y: &[f64], (low, high): (f64, f64), q: f64) -> f64 {
    for level in (0..=6).rev() {
        let cells = f64::from(1 << level);
        let cell = |x: f64| ((x - low) / (high - low) * cells).floor().min(cells - 1.0);
        let inside: Vec<f64> = (0..x.len())
            .filter(|&i| cell(x[i]) == cell(q))
            .map(|i| y[i] - 1e6)
            .collect();
        if !inside.is_empty() {
            return inside.iter().sum::<f64>() / inside.len() as f64;
        }
    }
    f64::NAN
}

/// The mean minus 1e6, over the `k` nearest. All points at the same distance count, with equal shares.
fn nearest_mean(x: &[f64], y: &[f64], q: f64, k: f64) -> f64 {
    let mut all: Vec<(f64, f64)> = x.iter().zip(y).map(|(x, y)| ((x - q).abs(), y - 1e6)).collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut weight, mut sum) = (0.0, 0.0);
    for group in all.chunk_by(|a, b| a.0 == b.0) {
        let share = ((k - weight) / group.len() as f64).clamp(0.0, 1.0);
        sum += share * group.iter().map(|g| g.1).sum::<f64>();
        weight += share * group.len() as f64;
    }
    sum / k
}

/// The functions of [`FIXED`], on [-1, 1].
fn on_unit(name: &str, u: f64) -> Vec<f64> {
    let pi = std::f64::consts::PI;
    match name {
        "fourier" => vec![
            1.0,
            (pi * u).cos(),
            (pi * u).sin(),
            (2.0 * pi * u).cos(),
            (2.0 * pi * u).sin(),
        ],
        "cosine" => (0..5).map(|k| (0.5 * pi * f64::from(k) * (u + 1.0)).cos()).collect(),
        // Legendre's and powers have the same span.
        "legendre" => (0..5).map(|k| u.powi(k)).collect(),
        _ => (0..7).map(|k| u.powi(k)).collect(),
    }
}

/// The least-squares fit to y minus 1e6, at `at`.
fn projected(x: &[f64], y: &[f64], (low, high): (f64, f64), at: &[f64], f: impl Fn(f64) -> Vec<f64>) -> Vec<f64> {
    let unit = |x: f64| (2.0 * x - low - high) / (high - low);
    let count = f(0.0).len();
    let rows: Vec<f64> = x.iter().flat_map(|x| f(unit(*x))).collect();
    let size = |j: usize| rows.iter().skip(j).step_by(count).map(|v| v * v).sum::<f64>().sqrt();
    let sizes: Vec<f64> = (0..count).map(size).collect();
    let scaled: Vec<f64> = rows.iter().enumerate().map(|(i, v)| v / sizes[i % count]).collect();
    let about: Vec<f64> = y.iter().map(|y| y - 1e6).collect();
    let c = crate::linalg::least_squares(&scaled, count, &about).unwrap();
    let value = |q: &f64| {
        f(unit(*q))
            .iter()
            .zip(&c)
            .zip(&sizes)
            .map(|((f, c), s)| f * c / s)
            .sum()
    };
    at.iter().map(value).collect()
}
