//! Sorts points by their abscissas, in about the time of a few copies where these are spread evenly.
//!
//! The abscissa's place between two quantiles of a sample names the bucket. Parts of the data are put in
//! buckets independently; a bucket is then brought together from all parts, and ordered in the cache in the same
//! manner. Where many points share a bucket, as with clusters, ties or far outliers, a comparison sort does
//! the rest. The result does not depend on the parts nor on the order of the points.

use std::cmp::Ordering;

use rayon::prelude::*;

use super::bin::nearest_whole;

/// Data are put in buckets in at most so many parts, each of at least so many points.
const PARTS: usize = 16;
const PART: usize = 1 << 16;
/// Most buckets, and the points of each where these are fewer.
const BUCKETS: usize = 2048;
const BUCKET: usize = 256;
/// Points of which the range is found, and how many times as many there are at least.
const SAMPLE: usize = 1000;
const PER_SAMPLE: usize = 8;
/// More points than this with one place are sorted by comparison.
const CROWD: usize = 24;

/// The columns' points in order of the first column, then the second and so on. All are finite and equally long.
pub fn sorted<const C: usize>(columns: [&[f64]; C]) -> [Vec<f64>; C] {
    let n = columns[0].len();
    if n == 0 {
        return columns.map(|_| Vec::new());
    }
    let places = Places::of_bulk(columns[0], (n / BUCKET).clamp(1, BUCKETS));
    let size = PART.max(n.div_ceil(PARTS));
    let mut scattered = vec![[0.0; C]; n];
    let starts: Vec<Vec<u32>> = scattered
        .par_chunks_mut(size)
        .enumerate()
        .map(|(k, part)| {
            let range = k * size..k * size + part.len();
            let columns = columns.map(|column| &column[range.clone()]);
            let mut next = places.starts(columns[0].iter().copied());
            let starts = next.clone();
            for (i, &x) in columns[0].iter().enumerate() {
                let next = &mut next[places.of(x)];
                part[*next as usize] = columns.map(|column| column[i]);
                *next += 1;
            }
            starts
        })
        .collect();

    let mut result: [Vec<f64>; C] = std::array::from_fn(|_| vec![0.0; n]);
    let mut rest = result.each_mut().map(|column| &mut column[..]);
    let buckets: Vec<_> = (0..places.count)
        .map(|b| {
            let len: u32 = starts.iter().map(|s| s[b + 1] - s[b]).sum();
            // There are as many points as places in the result.
            let to = rest
                .each_mut()
                .map(|r| r.split_off_mut(..len as usize).unwrap_or_default());
            (b, to)
        })
        .collect();
    buckets.into_par_iter().with_min_len(8).for_each_init(
        <[Vec<[f64; C]>; 2]>::default,
        |[points, scratch], (b, to)| {
            points.clear();
            for (part, s) in scattered.chunks(size).zip(&starts) {
                points.extend_from_slice(&part[s[b] as usize..s[b + 1] as usize]);
            }
            order(points, scratch);
            for (i, point) in points.iter().enumerate() {
                for c in 0..C {
                    to[c][i] = point[c];
                }
            }
        },
    );
    result
}

/// A place in 0..count for every abscissa, which never falls as x increases, whatever is rounded and wherever x is.
pub struct Places {
    lowest: f64,
    scale: f64,
    count: usize,
    /// The last place.
    last: f64,
}

impl Places {
    /// Places of equal width for most of the points; those at the ends go on for ever.
    fn of_bulk(x: &[f64], count: usize) -> Self {
        let mut sample: Vec<f64> = x
            .iter()
            .step_by(x.len().div_ceil(SAMPLE).max(PER_SAMPLE))
            .copied()
            .collect();
        sample.sort_unstable_by(f64::total_cmp);
        let tail = sample.len() / 50;
        let (low, high) = (sample[tail], sample[sample.len() - 1 - tail]);
        let margin = (high - low) / 24.0;
        Self::between(low - margin, high + margin, count)
    }

    /// Places of equal width between two abscissas; the first and the last go on for ever.
    pub fn between(lowest: f64, highest: f64, count: usize) -> Self {
        let scale = count as f64 / (highest - lowest);
        Places {
            lowest,
            scale: if scale.is_finite() { scale } else { 0.0 },
            count,
            last: (count - 1) as f64,
        }
    }

    #[inline(always)]
    pub fn of(&self, x: f64) -> usize {
        let place = (x - self.lowest) * self.scale;
        // What is not a number goes to the first.
        let place = if place > 0.0 { place } else { 0.0 };
        nearest_whole(if place < self.last { place } else { self.last }).0
    }

    /// Where each place starts in a list of the points in order of place, and the list's end.
    pub fn starts(&self, x: impl Iterator<Item = f64>) -> Vec<u32> {
        let mut starts = vec![0; self.count + 1];
        for x in x {
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

/// Sorts `points`; what `scratch` holds does not matter.
fn order<const C: usize>(points: &mut Vec<[f64; C]>, scratch: &mut Vec<[f64; C]>) {
    if points.len() > CROWD {
        // No need for the care that `f64::min` takes of NaN.
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for x in points.iter().map(|point| point[0]) {
            (low, high) = (if x < low { x } else { low }, if x > high { x } else { high });
        }
        let places = Places::between(low, high, points.len());
        let starts = places.starts(points.iter().map(|p| p[0]));
        let mut next = starts.clone();
        scratch.resize(points.len(), [0.0; C]);
        for point in &*points {
            let next = &mut next[places.of(point[0])];
            scratch[*next as usize] = *point;
            *next += 1;
        }
        for ends in starts.windows(2).filter(|ends| (ends[1] - ends[0]) as usize > CROWD) {
            scratch[ends[0] as usize..ends[1] as usize].sort_unstable_by(compare);
        }
        std::mem::swap(points, scratch);
    }
    insertion_sort(points);
}

/// Fast where points are close to where they belong.
fn insertion_sort<const C: usize>(points: &mut [[f64; C]]) {
    for i in 1..points.len() {
        let point = points[i];
        let mut j = i;
        while j > 0 && compare(&point, &points[j - 1]) == Ordering::Less {
            points[j] = points[j - 1];
            j -= 1;
        }
        points[j] = point;
    }
}

/// By the first column, then the second and so on.
#[inline(always)]
fn compare<const C: usize>(a: &[f64; C], b: &[f64; C]) -> Ordering {
    if a[0] < b[0] {
        Ordering::Less
    } else if a[0] > b[0] {
        Ordering::Greater
    } else {
        let columns = a[1..].iter().zip(&b[1..]);
        columns.fold(Ordering::Equal, |so_far, (a, b)| so_far.then(a.total_cmp(b)))
    }
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

    proptest! {
        #[test]
        fn any_finite_numbers_are_sorted(x in prop::collection::vec(prop::num::f64::NORMAL | prop::num::f64::ZERO, 1..600)) {
            check(&x);
        }
    }
}
