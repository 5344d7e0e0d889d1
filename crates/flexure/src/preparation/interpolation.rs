//! The cubic spline through points, with not-a-knot ends.
//!
//! Between neighbours at distance h_i the spline is the cubic with the second derivatives M_i at its ends, and
//! $$ h_{i-1} M_{i-1} + 2 (h_{i-1} + h_i) M_i + h_i M_{i+1} = 6 (d_i - d_{i-1}), \quad d_i = (y_{i+1} - y_i) / h_i. $$
//! Not-a-knot: the first two cubics are one, and so are the last two (de Boor 1978, chapter IV). Through three points it is a parabola,
//! through two a line. The error is of order h^4.

/// A spline through points.
pub(super) struct Spline<'a> {
    x: &'a [f64],
    y: &'a [f64],
    /// The second derivatives at the points.
    bends: Vec<f64>,
}

impl<'a> Spline<'a> {
    /// The spline through at least one point, with strictly increasing `x`.
    pub(super) fn new(x: &'a [f64], y: &'a [f64]) -> Self {
        Spline {
            x,
            y,
            bends: bends(x, y),
        }
    }

    /// The value at `at`. Beyond the first and the last point it is the value of that point.
    pub(super) fn value(&self, at: f64) -> f64 {
        let (x, y) = (self.x, self.y);
        let last = x.len() - 1;
        let right = x.partition_point(|&x| x <= at);
        if right == 0 {
            return y[0];
        }
        if right > last {
            return y[last];
        }
        let left = right - 1;
        let h = x[right] - x[left];
        let (a, b) = ((x[right] - at) / h, (at - x[left]) / h);
        let bend = (a * a * a - a) * self.bends[left] + (b * b * b - b) * self.bends[right];
        a * y[left] + b * y[right] + bend * h * h / 6.0
    }
}

/// The second derivatives at the points.
fn bends(x: &[f64], y: &[f64]) -> Vec<f64> {
    let n = x.len();
    if n < 3 {
        return vec![0.0; n];
    }
    let h: Vec<f64> = x.windows(2).map(|x| x[1] - x[0]).collect();
    let slope: Vec<f64> = (0..n - 1).map(|i| (y[i + 1] - y[i]) / h[i]).collect();
    let right = |i: usize| 6.0 * (slope[i] - slope[i - 1]);
    if n == 3 {
        return vec![right(1) / (3.0 * (h[0] + h[1])); n];
    }
    // Rows 1 to n - 2: the entries before, on and after the diagonal, and the right-hand side. The end conditions
    // M_0 = M_1 - (h_0/h_1) (M_2 - M_1), and likewise at the other end, are put into the first and the last row.
    let mut rows: Vec<[f64; 4]> = (1..n - 1)
        .map(|i| [h[i - 1], 2.0 * (h[i - 1] + h[i]), h[i], right(i)])
        .collect();
    let end = |own: f64, next: f64| [own + own * own / next, -own * own / next];
    let [diagonal, beside] = end(h[0], h[1]);
    rows[0][1] += diagonal;
    rows[0][2] += beside;
    let [diagonal, beside] = end(h[n - 2], h[n - 3]);
    rows[n - 3][1] += diagonal;
    rows[n - 3][0] += beside;
    // Thomas' algorithm; the diagonal dominates.
    for i in 1..rows.len() {
        let share = rows[i][0] / rows[i - 1][1];
        rows[i][1] -= share * rows[i - 1][2];
        rows[i][3] -= share * rows[i - 1][3];
    }
    let mut bends = vec![0.0; n];
    for i in (1..n - 1).rev() {
        let [_, diagonal, behind, right] = rows[i - 1];
        let next = if i == n - 2 { 0.0 } else { bends[i + 1] };
        bends[i] = (right - behind * next) / diagonal;
    }
    bends[0] = bends[1] - h[0] / h[1] * (bends[2] - bends[1]);
    bends[n - 1] = bends[n - 2] + h[n - 2] / h[n - 3] * (bends[n - 2] - bends[n - 3]);
    bends
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The spline through a cubic is the cubic itself, so interpolation is of order 4.
    #[test]
    fn cubics_are_reproduced_from_uneven_points() {
        let cubic = |x: f64| 1.0 - 2.0 * x + 0.5 * x * x - 0.25 * x * x * x;
        for n in [4, 5, 6, 40] {
            let x: Vec<f64> = (0..n)
                .map(|i| 0.3 * (f64::from(i) + 0.4 * f64::from(i * i).sin()))
                .collect();
            let y: Vec<f64> = x.iter().map(|&x| cubic(x)).collect();
            let spline = Spline::new(&x, &y);
            let scale = y.iter().fold(1.0_f64, |m, y| m.max(y.abs()));
            for i in 0..=100 {
                let at = x[0] + (x[x.len() - 1] - x[0]) * f64::from(i) / 100.0;
                assert!((spline.value(at) - cubic(at)).abs() < 1e-11 * scale, "{n} points, {at}");
            }
        }
    }

    #[test]
    fn few_points() {
        assert_eq!(Spline::new(&[2.0], &[5.0]).value(2.0), 5.0);
        assert_eq!(Spline::new(&[0.0, 2.0], &[1.0, 5.0]).value(0.5), 2.0);
        let parabola = Spline::new(&[0.0, 1.0, 3.0], &[0.0, 1.0, 9.0]);
        assert!((parabola.value(2.5) - 6.25).abs() < 1e-14);
    }

    #[test]
    fn points_are_met_exactly() {
        let x: Vec<f64> = (0..50).map(|i| 0.1 * f64::from(i)).collect();
        let y: Vec<f64> = x.iter().map(|x| (7.0 * x).sin()).collect();
        let spline = Spline::new(&x, &y);
        for (&x, &y) in x.iter().zip(&y) {
            assert_eq!(spline.value(x), y);
        }
    }
}
