//! Small dense matrices on the stack: a filter step takes microseconds, and allocates no memory.

/// A matrix of eight rows.
pub type Matrix8 = [[f64; 8]; 8];

/// The identity.
pub fn identity() -> Matrix8 {
    std::array::from_fn(|i| std::array::from_fn(|j| f64::from(u8::from(i == j))))
}

/// `a b`.
#[inline]
pub fn product(a: &Matrix8, b: &Matrix8) -> Matrix8 {
    let mut c = [[0.0; 8]; 8];
    for i in 0..8 {
        for k in 0..8 {
            let factor = a[i][k];
            for j in 0..8 {
                c[i][j] += factor * b[k][j];
            }
        }
    }
    c
}

/// `a b^T`.
#[inline]
pub fn product_transposed(a: &Matrix8, b: &Matrix8) -> Matrix8 {
    let mut transposed = [[0.0; 8]; 8];
    for i in 0..8 {
        for j in 0..8 {
            transposed[j][i] = b[i][j];
        }
    }
    product(a, &transposed)
}

/// The lower triangular L with `L L^T` the matrix; `None` unless it is positive definite.
pub fn cholesky(a: &Matrix8) -> Option<Matrix8> {
    let mut l = [[0.0; 8]; 8];
    for j in 0..8 {
        let d = a[j][j] - l[j][..j].iter().map(|v| v * v).sum::<f64>();
        if !(d > 0.0 && d.is_finite()) {
            return None;
        }
        l[j][j] = d.sqrt();
        for i in j + 1..8 {
            let s: f64 = (0..j).map(|k| l[i][k] * l[j][k]).sum();
            l[i][j] = (a[i][j] - s) / l[j][j];
        }
    }
    Some(l)
}

/// `e^T a^-1 e` for a positive definite matrix; NaN for another.
pub fn squared_distance(a: &Matrix8, e: &[f64; 8]) -> f64 {
    let Some(l) = cholesky(a) else {
        return f64::NAN;
    };
    let mut y = [0.0; 8];
    for i in 0..8 {
        let s: f64 = (0..i).map(|k| l[i][k] * y[k]).sum();
        y[i] = (e[i] - s) / l[i][i];
    }
    y.iter().map(|v| v * v).sum()
}
