//! Sorting of points by their abscissas.
//!
//! A counting pass puts the points into buckets of equal width along the axis, then each bucket is sorted by comparison.
//! From 10,000 to 1,000,000 points this takes 40 to 50 % of the time of a standard sort of all points. The first and the
//! last bucket extend to infinity. The result does not depend on the order of the points.

use std::cmp::Ordering;

use rayon::prelude::*;

/// Mean number of points in a bucket, and the most buckets.
const BUCKET: usize = 32;
const MOST_BUCKETS: usize = 1 << 14;
/// The bulk of the points is found from a sample of about so many, but of no more than every eighth point.
const SAMPLE: usize = 1000;
const PER_SAMPLE: usize = 8;

/// The points of these columns in order of the first column, then of the second and so on. The columns are finite and of
/// one length.
pub fn sorted<const C: usize>(columns: [&[f64]; C]) -> [Vec<f64>; C] {
    let n = columns[0].len();
    if n == 0 {
        return columns.map(|_| Vec::new());
    }
    let buckets = Buckets::of_bulk(columns[0], (n / BUCKET).clamp(1, MOST_BUCKETS));
    let mut next = buckets.starts(columns[0]);
    let mut points = vec![[0.0; C]; n];
    for (i, &x) in columns[0].iter().enumerate() {
        let next = &mut next[buckets.of(x)];
        points[*next as usize] = columns.map(|column| column[i]);
        *next += 1;
    }
    points
        .par_chunk_by_mut(|a, b| buckets.of(a[0]) == buckets.of(b[0]))
        .for_each(|bucket| bucket.sort_unstable_by(compare));
    std::array::from_fn(|c| points.iter().map(|point| point[c]).collect())
}

/// The finite values of `at` in increasing order, and their indices in `at`.
pub fn increasing(at: &[f64]) -> (Vec<usize>, Vec<f64>) {
    let indices = (0..at.len()).filter(|&i| at[i].is_finite());
    let (values, indices): (Vec<f64>, Vec<f64>) = indices.map(|i| (at[i], i as f64)).unzip();
    let [values, indices] = sorted([&values, &indices]);
    (indices.into_iter().map(|i| i as usize).collect(), values)
}

/// Buckets of equal width. The index of the bucket never falls as x increases, whatever is rounded.
struct Buckets {
    lowest: f64,
    per_width: f64,
    last: usize,
}

impl Buckets {
    /// Buckets over the bulk of the points, without the outer fiftieths of a sample.
    fn of_bulk(x: &[f64], count: usize) -> Self {
        let step = x.len().div_ceil(SAMPLE).max(PER_SAMPLE);
        let mut sample: Vec<f64> = x.iter().step_by(step).copied().collect();
        sample.sort_unstable_by(f64::total_cmp);
        let tail = sample.len() / 50;
        let (low, high) = (sample[tail], sample[sample.len() - 1 - tail]);
        let margin = (high - low) / 24.0;
        let lowest = low - margin;
        let per_width = count as f64 / (high + margin - lowest);
        Buckets {
            lowest,
            per_width: if per_width.is_finite() { per_width } else { 0.0 },
            last: count - 1,
        }
    }

    #[inline(always)]
    fn of(&self, x: f64) -> usize {
        // The conversion takes what is negative or not a number to zero.
        (((x - self.lowest) * self.per_width) as usize).min(self.last)
    }

    /// Where each bucket starts in a list of the points in order of their buckets.
    fn starts(&self, x: &[f64]) -> Vec<u32> {
        let mut starts = vec![0; self.last + 2];
        for &x in x {
            starts[self.of(x) + 1] += 1;
        }
        let mut end = 0;
        for start in &mut starts {
            end += *start;
            *start = end;
        }
        starts
    }
}

/// By the first column, then the second and so on.
#[inline(always)]
fn compare<const C: usize>(a: &[f64; C], b: &[f64; C]) -> Ordering {
    let columns = a[1..].iter().zip(&b[1..]);
    let by_first = a[0].partial_cmp(&b[0]).unwrap_or(Ordering::Equal);
    by_first.then_with(|| columns.fold(Ordering::Equal, |so_far, (a, b)| so_far.then(a.total_cmp(b))))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use rand::{RngExt, SeedableRng};

    use super::*;

    fn check(x: &[f64]) {
        let y: Vec<f64> = (0..x.len()).map(|i| (i * 37 % 101) as f64).collect();
        let mut want: Vec<[f64; 2]> = x.iter().zip(&y).map(|(&x, &y)| [x, y]).collect();
        want.sort_by(|a, b| a.partial_cmp(b).unwrap());
        let [got_x, got_y] = sorted([x, &y]);
        let got: Vec<[f64; 2]> = got_x.into_iter().zip(got_y).map(|(x, y)| [x, y]).collect();
        assert!(got == want);
    }

    #[test]
    fn all_sorts_of_data_are_sorted() {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(1);
        for n in [1, 2, 3, 30, 1000, 5000, 300_000] {
            let mut draw = |f: &dyn Fn(f64) -> f64| check(&(0..n).map(|_| f(rng.random())).collect::<Vec<f64>>());
            draw(&|u| 4.0 * u - 2.0);
            draw(&|u| 1e6 + u);
            draw(&|u| (std::f64::consts::PI * (u - 0.5)).tan());
            draw(&|u| (100.0 * u - 50.0).exp() * (u - 0.3).signum());
            draw(&|u| (12.0 * u).floor());
            draw(&|u| (4.0 * u).floor() + 1e-9 * u);
            draw(&|u| {
                if u < 0.01 {
                    1e308 * (u - 0.005).signum()
                } else {
                    u * 1e-300
                }
            });
            draw(&|u| if u < 0.5 { -0.0 } else { 0.0 });
            draw(&|_| 3.0);
        }
    }

    #[test]
    fn finite_values_are_put_in_order_with_their_indices() {
        let at = [3.0, f64::NAN, -1.0, f64::INFINITY, 2.0];
        assert_eq!(increasing(&at), (vec![2, 4, 0], vec![-1.0, 2.0, 3.0]));
        assert_eq!(increasing(&[f64::NAN]), (vec![], vec![]));
    }

    proptest! {
        #[test]
        fn any_finite_numbers_are_sorted(x in prop::collection::vec(prop::num::f64::NORMAL | prop::num::f64::ZERO, 1..600)) {
            check(&x);
        }
    }
}
