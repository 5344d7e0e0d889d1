//! The local fit from the points one by one, by orthogonalisation. It keeps its digits where the normal equations of the
//! local plane would lose theirs.

use std::ops::Range;

use super::sums::Local;
use super::{Degree, Product};
use crate::vectors::dot;

/// If the standard deviation of the points in reach is below this share of the bandwidth in some direction, the points have
/// no extent in it.
const NO_EXTENT: f64 = 1e-8;

/// Points in reach, with their weights times the kernel.
struct Near<const D: usize> {
    x: Vec<[f64; D]>,
    y: Vec<f64>,
    /// As shares of the largest.
    k: Vec<f64>,
    largest: f64,
}

impl<const D: usize> Near<D> {
    /// The points of the runs in reach of `at`, without the point `skip`; `None` if there are none.
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
            // The weight is included before the comparison, as the product may underflow.
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

/// The fit at `at` over the runs of points, without the point `skip`; `None` if no point is in reach.
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

/// A coordinate of the points, made orthonormal to the constant and to the columns before it.
struct Column {
    /// The coordinate's dimension.
    j: usize,
    unit: Vec<f64>,
    /// The shares of the columns before it in the coordinate.
    share: Vec<f64>,
    /// The length of the rest of the column.
    size: f64,
    /// The same combination of the query's coordinates.
    query: f64,
}

/// The local plane; `None` where the points do not determine it.
fn plane<const D: usize>(product: &Product, near: &Near<D>, at: &[f64; D], mean: Local<D>) -> Option<Local<D>> {
    let root: Vec<f64> = near.k.iter().map(|k| k.sqrt()).collect();
    let columns = orthonormal(product, near, at, &root)?;
    let residual: Vec<f64> = near.y.iter().zip(&root).map(|(y, r)| (y - mean.value) * r).collect();
    let along: Vec<f64> = columns.iter().map(|c| dot(&c.unit, &residual)).collect();
    let (mut value, mut leverage) = (mean.value, 0.0);
    for (column, b) in columns.iter().zip(&along) {
        value += column.query * b;
        leverage += column.query * column.query;
    }
    // Back substitution.
    let mut slope = [0.0; D];
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

/// The columns by the method of Gram and Schmidt, without columns of no extent. `None` if a column depends linearly on those before it.
/// `root` holds the square roots of the weights.
fn orthonormal<const D: usize>(product: &Product, near: &Near<D>, at: &[f64; D], root: &[f64]) -> Option<Vec<Column>> {
    let total: f64 = near.k.iter().sum();
    let narrow = |square: f64| !(square > NO_EXTENT * NO_EXTENT * total);
    let heaviest = (0..near.k.len()).max_by(|&i, &j| near.k[i].total_cmp(&near.k[j]))?;
    // Coordinates are relative to a point of the data, so that the extent of a far and narrow group loses no digits.
    let anchor = near.x[heaviest];
    let mut columns: Vec<Column> = Vec::with_capacity(D);
    for j in 0..D {
        let h = product.h[j];
        let u: Vec<f64> = near.x.iter().map(|x| (x[j] - anchor[j]) / h).collect();
        let centre = near.mean_of(u.iter().copied());
        let mut unit: Vec<f64> = u.iter().zip(root).map(|(u, r)| (u - centre) * r).collect();
        if narrow(dot(&unit, &unit)) {
            continue;
        }
        let share = orthogonalise(&mut unit, &columns);
        let square = dot(&unit, &unit);
        if narrow(square) {
            return None;
        }
        let size = square.sqrt();
        unit.iter_mut().for_each(|v| *v /= size);
        let taken: f64 = columns.iter().zip(&share).map(|(c, share)| share * c.query).sum();
        let query = ((at[j] - anchor[j]) / h - centre - taken) / size;
        columns.push(Column {
            j,
            unit,
            share,
            size,
            query,
        });
    }
    Some(columns)
}

/// Subtracts the parts along the columns from a vector. Returns these parts.
fn orthogonalise(vector: &mut [f64], columns: &[Column]) -> Vec<f64> {
    let mut share = vec![0.0; columns.len()];
    // The second round removes the rounding error of the first. It matters if little remains of the vector.
    for _ in 0..2 {
        for (column, total) in columns.iter().zip(&mut share) {
            let share = dot(&column.unit, vector);
            vector.iter_mut().zip(&column.unit).for_each(|(v, b)| *v -= share * b);
            *total += share;
        }
    }
    share
}
