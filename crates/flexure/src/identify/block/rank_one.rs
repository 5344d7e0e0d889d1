//! The dominant parts of a matrix of products: coefficients of nonlinearities times coefficients of numerators (Bai 1998).

use super::limits::POWER_ITERATIONS;
use crate::vectors::{add, dot};

/// A column times a row.
pub(in crate::identify) struct Product {
    pub column: Vec<f64>,
    /// Its largest entry is 1.
    pub row: Vec<f64>,
}

/// Products of a column and a row, one after the other: each is nearest to the remainder of a row-major matrix after those before.
pub(in crate::identify) fn dominant_products(matrix: &[f64], columns: usize, count: usize) -> Option<Vec<Product>> {
    let mut rest = matrix.to_vec();
    let mut products = Vec::new();
    for _ in 0..count {
        let Product { column, row } = dominant(&rest, columns)?;
        for (entries, c) in rest.chunks_exact_mut(columns).zip(&column) {
            entries.iter_mut().zip(&row).for_each(|(e, r)| *e -= c * r);
        }
        products.push(Product { column, row });
    }
    Some(products)
}

/// The column and the row whose product is nearest to a row-major matrix.
fn dominant(matrix: &[f64], columns: usize) -> Option<Product> {
    let rows = || matrix.chunks_exact(columns);
    let size = |v: &[f64]| v.iter().map(|v| v * v).sum::<f64>();
    let largest = rows().max_by(|a, b| size(a).total_cmp(&size(b)))?;
    let mut row = largest.to_vec();
    let mut column = Vec::new();
    for _ in 0..POWER_ITERATIONS {
        let norm = size(&row).sqrt();
        if !(norm > 0.0 && norm.is_finite()) {
            return None;
        }
        row.iter_mut().for_each(|r| *r /= norm);
        column = rows().map(|m| dot(m, &row)).collect();
        row.fill(0.0);
        for (m, c) in rows().zip(&column) {
            add(&mut row, *c, m);
        }
    }
    let squares = size(&column);
    let scale = row.iter().fold(0.0_f64, |m, v| if v.abs() > m.abs() { *v } else { m });
    if !(squares > 0.0 && scale != 0.0 && scale.is_finite()) {
        return None;
    }
    column.iter_mut().for_each(|c| *c *= scale / squares);
    row.iter_mut().for_each(|r| *r /= scale);
    Some(Product { column, row })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_dominant_product_of_a_matrix_of_rank_one_is_the_matrix() {
        let (c, b) = ([0.3, -1.0, 2.0, 0.0], [0.5, -0.25, 0.1]);
        let matrix: Vec<f64> = c.iter().flat_map(|c| b.iter().map(move |b| c * b)).collect();
        let Product { column, row } = dominant(&matrix, 3).unwrap();
        assert!((row[0].abs() - 1.0).abs() < 1e-12, "{row:?}");
        for (i, c) in column.iter().enumerate() {
            for (j, b) in row.iter().enumerate() {
                assert!((c * b - matrix[3 * i + j]).abs() < 1e-12);
            }
        }
        assert!(dominant(&[0.0; 6], 3).is_none());
    }

    #[test]
    fn two_products_of_a_matrix_of_rank_two_are_the_matrix() {
        let entry = |i: usize, j: usize| (i as f64 - 1.5) * (j as f64 + 1.0) + (i * i) as f64 * [0.3, -1.0, 0.2][j];
        let matrix: Vec<f64> = (0..12).map(|k| entry(k / 3, k % 3)).collect();
        let products = dominant_products(&matrix, 3, 2).unwrap();
        for (k, want) in matrix.iter().enumerate() {
            let got: f64 = products.iter().map(|p| p.column[k / 3] * p.row[k % 3]).sum();
            assert!((got - want).abs() < 1e-9, "{k}: {got} {want}");
        }
    }
}
