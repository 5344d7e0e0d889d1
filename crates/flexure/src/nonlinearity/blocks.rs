//! Sums over many points, block by block.
//!
//! The values of several functions at [`BLOCK`] points lie in [`Row`]s, one row for each function. Loops over a row have no dependence
//! between points, so the compiler vectorises them, and products of rows run in registers. Pieces of a fixed number of points are summed in
//! parallel and added in order: no sum depends on the number of threads.

use std::ops::Range;

use crate::parallel;
/// Points of a block.
pub(super) const BLOCK: usize = 64;
/// Points of one parallel piece, a multiple of [`BLOCK`].
const PIECE: usize = 4096;
/// Rows, and columns, of a tile of products that is held in registers.
const TILE: (usize, usize) = (4, 2);
/// Points that a register holds.
const LANES: usize = 2;

/// The values of one function at the points of a block.
pub(super) type Row = [f64; BLOCK];

/// `count` rows of zeros.
pub(super) fn rows(count: usize) -> Vec<Row> {
    vec![[0.0; BLOCK]; count]
}

/// The part of `values` in `range`, at most a block, followed by copies of its last value; zeros for weights
/// (`fill`).
pub(super) fn load(values: &[f64], range: &Range<usize>, fill: Option<f64>) -> Row {
    let part = &values[range.clone()];
    let mut row = [fill.unwrap_or(part[part.len() - 1]); BLOCK];
    row[..part.len()].copy_from_slice(part);
    row
}

/// The sums of `add` over all blocks of `n` points. Every piece starts with its own `scratch`.
pub(super) fn sum_over<S>(
    n: usize,
    size: usize,
    scratch: impl Fn() -> S + Sync,
    add: impl Fn(&mut S, Range<usize>, &mut [f64]) + Sync,
) -> Vec<f64> {
    let pieces: Vec<Vec<f64>> = parallel::map(n.div_ceil(PIECE), |piece| {
        let (mut total, mut scratch) = (vec![0.0; size], scratch());
        let end = n.min((piece + 1) * PIECE);
        for first in (piece * PIECE..end).step_by(BLOCK) {
            add(&mut scratch, first..end.min(first + BLOCK), &mut total);
        }
        total
    });
    let mut total = vec![0.0; size];
    for piece in pieces {
        for (t, p) in total.iter_mut().zip(piece) {
            *t += p;
        }
    }
    total
}

/// Adds the products of all pairs of rows, summed over the points with the weights `w`, to a packed lower triangle.
/// `weighted` is overwritten.
pub(super) fn add_products(rows: &[Row], w: &Row, weighted: &mut Vec<Row>, packed: &mut [f64]) {
    weighted.clear();
    weighted.extend(rows.iter().map(|row| std::array::from_fn(|p| w[p] * row[p])));
    let last = rows.len() - 1;
    for top in (0..=last).step_by(TILE.0) {
        // Beyond the last row, the last row is repeated: the loops keep their size, and these products are dropped.
        let left = std::array::from_fn(|i| &weighted[last.min(top + i)]);
        for first in (0..=last.min(top + TILE.0 - 1)).step_by(TILE.1) {
            let right = std::array::from_fn(|j| &rows[last.min(first + j)]);
            let products = tile(left, right);
            for (i, of_row) in products.iter().enumerate().take(last + 1 - top) {
                for (j, product) in of_row.iter().enumerate() {
                    let (row, column) = (top + i, first + j);
                    if column <= row {
                        packed[row * (row + 1) / 2 + column] += product;
                    }
                }
            }
        }
    }
}

/// All products of one of `left` and one of `right`, summed over the points.
fn tile(left: [&Row; TILE.0], right: [&Row; TILE.1]) -> [[f64; TILE.1]; TILE.0] {
    let mut sums = [[[0.0; LANES]; TILE.1]; TILE.0];
    for p in (0..BLOCK).step_by(LANES) {
        for i in 0..TILE.0 {
            for j in 0..TILE.1 {
                for lane in 0..LANES {
                    sums[i][j][lane] += left[i][p + lane] * right[j][p + lane];
                }
            }
        }
    }
    sums.map(|of_row| of_row.map(|s| s.iter().sum()))
}

/// The sum of the products of two rows.
pub(super) fn dot(a: &Row, b: &Row) -> f64 {
    let mut sums = [0.0; 4];
    for p in (0..BLOCK).step_by(sums.len()) {
        for (lane, sum) in sums.iter_mut().enumerate() {
            *sum += a[p + lane] * b[p + lane];
        }
    }
    sums.iter().sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_are_those_summed_one_by_one() {
        for (n, count) in [(1, 1), (63, 2), (64, 3), (65, 5), (9001, 7)] {
            let value = |k: usize, i: usize| ((k + 2) as f64 * (i as f64 + 0.3)).sin();
            let w: Vec<f64> = (0..n).map(|i| 0.5 + (i % 3) as f64).collect();
            let columns: Vec<Vec<f64>> = (0..count).map(|k| (0..n).map(|i| value(k, i)).collect()).collect();
            let size = count * (count + 1) / 2;
            let got = sum_over(n, size, Vec::new, |weighted, range, total| {
                let block: Vec<Row> = columns.iter().map(|c| load(c, &range, None)).collect();
                add_products(&block, &load(&w, &range, Some(0.0)), weighted, total);
            });
            for k in 0..count {
                for j in 0..=k {
                    let want: f64 = (0..n).map(|i| w[i] * value(k, i) * value(j, i)).sum();
                    let found = got[k * (k + 1) / 2 + j];
                    assert!((found - want).abs() < 1e-11 * n as f64, "{n} {k} {j}: {found} {want}");
                }
            }
        }
    }

    #[test]
    fn dots_are_sums_of_products() {
        let a: Row = std::array::from_fn(|p| p as f64);
        let b: Row = std::array::from_fn(|p| if p % 2 == 0 { 1.0 } else { -1.0 });
        assert_eq!(dot(&a, &b), -32.0);
    }
}
