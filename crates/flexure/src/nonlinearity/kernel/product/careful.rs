//! The local fit from the points one by one, by orthogonalisation.

use super::sums::{Local, NO_EXTENT};
use super::{Degree, Product};
use std::ops::Range;

/// Points in reach, with their weights times the kernel.
struct Near<const D: usize> {
    x: Vec<[f64; D]>,
    y: Vec<f64>,
    k: Vec<f64>,
    /// What `k` has been divided by.
    largest: f64,
}

impl<const D: usize> Near<D> {
    fn new(product: &Product, at: &[f64; D], runs: &[Range<usize>], skip: Option<usize>) -> Option<Self> {
        let points = &product.points;
        let mut near = Near {
            x: Vec::new(),
            y: Vec::new(),
            k: Vec::new(),
            largest: 0.0,
        };
        for i in runs.iter().cloned().flatten().filter(|i| Some(*i) != skip) {
            let x: [f64; D] = std::array::from_fn(|j| points.x[j][i]);
            let delta: [f64; D] = std::array::from_fn(|j| x[j] - at[j]);
            let k = super::profile::weight(product.kernel, &delta, &product.h);
            // The weight first: it may be subnormal.
            let k = points.weight(i) * k;
            if k > 0.0 {
                near.x.push(x);
                near.y.push(points.y[i]);
                near.k.push(k);
                near.largest = near.largest.max(k);
            }
        }
        for k in &mut near.k {
            *k /= near.largest;
        }
        (!near.k.is_empty()).then_some(near)
    }

    fn mean_of(&self, values: impl Iterator<Item = f64>) -> f64 {
        let sum: f64 = self.k.iter().zip(values).map(|(k, v)| k * v).sum();
        sum / self.k.iter().sum::<f64>()
    }
}

/// The fit at `at` over the runs of points, without the point `skip`; nothing where none is in reach.
#[cold]
#[inline(never)]
pub fn fit<const D: usize>(
    product: &Product,
    degree: Degree,
    at: &[f64; D],
    runs: &[Range<usize>],
    skip: Option<usize>,
) -> Option<Local<D>> {
    let near = Near::new(product, at, runs, skip)?;
    let total: f64 = near.k.iter().sum();
    let mean = Local {
        value: near.mean_of(near.y.iter().copied()),
        leverage: 1.0 / (total * near.largest),
        slope: [0.0; D],
    };
    match degree {
        Degree::Constant => Some(mean),
        Degree::Linear => Some(plane(product, &near, at, mean).unwrap_or(mean)),
    }
}

/// The local plane; nothing where the points do not determine it.
fn plane<const D: usize>(product: &Product, near: &Near<D>, at: &[f64; D], mean: Local<D>) -> Option<Local<D>> {
    let total: f64 = near.k.iter().sum();
    let root: Vec<f64> = near.k.iter().map(|k| k.sqrt()).collect();
    let heaviest = (0..near.k.len()).max_by(|&i, &j| near.k[i].total_cmp(&near.k[j]))?;
    // Counted from a point of the data, so that the extent of a far and narrow group loses no digits.
    let anchor = near.x[heaviest];
    let narrow = |square: f64| !(square > NO_EXTENT * NO_EXTENT * total);
    let mut columns: Vec<Column> = Vec::with_capacity(D);
    let residual: Vec<f64> = near.y.iter().zip(&root).map(|(y, r)| (y - mean.value) * r).collect();
    for j in 0..D {
        let h = product.h[j];
        let u: Vec<f64> = near.x.iter().map(|x| (x[j] - anchor[j]) / h).collect();
        let centre = near.mean_of(u.iter().copied());
        let mut unit: Vec<f64> = u.iter().zip(&root).map(|(u, r)| (u - centre) * r).collect();
        if narrow(dot(&unit, &unit)) {
            continue;
        }
        let mut column = Column {
            j,
            // The query's own coordinate, and after this what is left of it.
            query: (at[j] - anchor[j]) / h - centre,
            share: Vec::with_capacity(D),
            size: 1.0,
            unit: Vec::new(),
        };
        // Twice, as once leaves rounding where little is left.
        for round in 0..2 {
            for (i, before) in columns.iter().enumerate() {
                let share = dot(&before.unit, &unit);
                unit.iter_mut().zip(&before.unit).for_each(|(v, b)| *v -= share * b);
                if round == 0 {
                    column.share.push(share);
                } else {
                    column.share[i] += share;
                }
            }
        }
        let square = dot(&unit, &unit);
        if narrow(square) {
            return None;
        }
        column.size = square.sqrt();
        unit.iter_mut().for_each(|v| *v /= column.size);
        column.unit = unit;
        let taken: f64 = columns
            .iter()
            .zip(&column.share)
            .map(|(c, share)| share * c.query)
            .sum();
        column.query = (column.query - taken) / column.size;
        columns.push(column);
    }
    let (mut value, mut leverage) = (mean.value, 0.0);
    let mut slope = [0.0; D];
    let along: Vec<f64> = columns.iter().map(|c| dot(&c.unit, &residual)).collect();
    for (column, b) in columns.iter().zip(&along) {
        value += column.query * b;
        leverage += column.query * column.query;
    }
    for i in (0..columns.len()).rev() {
        let later: f64 = columns[i + 1..].iter().map(|c| c.share[i] * slope[c.j]).sum();
        slope[columns[i].j] = (along[i] - later) / columns[i].size;
    }
    Some(Local {
        value,
        leverage: mean.leverage + leverage / near.largest,
        slope,
    })
}

/// A column of the points' coordinates, orthonormal to the constant and those before it.
struct Column {
    j: usize,
    unit: Vec<f64>,
    /// What those before it had of it.
    share: Vec<f64>,
    /// What was left.
    size: f64,
    /// The same combination of the query's coordinates.
    query: f64,
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
