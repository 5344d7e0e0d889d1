//! Data in bins of equal width that lie side by side, empty ones among them.

use rayon::prelude::*;

use super::bin::{Bin, Products, nearest_whole};
use super::binned::{CHUNK, PARTS};
use super::sorted::mean;
use super::tangents::LANES;
use crate::wide::extent;

/// Bins of a section: scores are made for so many at a time.
pub const SECTION: usize = 256;
/// Most bins that a window may hold wholly to either side of its own.
pub const REACH: usize = 62;
/// Bins that a section is about: its own, one more on either side, and those in the windows of all these.
pub const SPAN: usize = (SECTION + 2).next_multiple_of(LANES) + 2 * (REACH + 1);
/// Room before the first bin: of a section so many come before its own.
const BEFORE: usize = REACH + 2;
/// Most bins for each that is not empty.
const MOST_PLACES: usize = 3;

/// The variance within the bins that data must have at least, as a share of that of evenly spread ones: rounded data
/// have so many values to a bin as 1/sqrt(1 - this).
const FILLED: f64 = 0.9;
/// Points more than bins with data, at least, that tell of the variance.
const ENOUGH: f64 = 100.0;

/// Bins side by side, empty ones among them.
#[derive(Debug)]
pub struct Lattice {
    /// The first bin's middle.
    first: f64,
    pub width: f64,
    pub len: usize,
    /// With room for the windows of the first bins and of the last.
    pub columns: Columns,
}

/// For each bin the count of its data, the means of x, less the bin's middle in bins' widths, and of y, and the
/// sums of products of the deviations from these. What is said of an empty bin does not matter.
#[derive(Debug)]
pub struct Columns {
    pub count: Vec<f64>,
    pub x: Vec<f64>,
    pub y: Vec<f64>,
    pub xx: Vec<f64>,
    pub xy: Vec<f64>,
    pub yy: Vec<f64>,
}

impl Columns {
    fn new(len: usize) -> Self {
        let column = || vec![0.0; len.next_multiple_of(SECTION) - SECTION + SPAN];
        Columns {
            count: column(),
            x: column(),
            y: column(),
            xx: column(),
            xy: column(),
            yy: column(),
        }
    }

    #[inline(always)]
    fn bin(&self, place: usize) -> Bin {
        let k = BEFORE + place;
        Bin {
            count: self.count[k],
            x: self.x[k],
            y: self.y[k],
            xx: self.xx[k],
            xy: self.xy[k],
            yy: self.yy[k],
        }
    }

    #[inline(always)]
    fn set(&mut self, place: usize, bin: Bin) {
        let k = BEFORE + place;
        (self.count[k], self.x[k], self.y[k]) = (bin.count, bin.x, bin.y);
        (self.xx[k], self.xy[k], self.yy[k]) = (bin.xx, bin.xy, bin.yy);
    }
}

impl Lattice {
    /// Brings points together that are in no order; nothing where there would be more bins, those of all parts taken
    /// together, than points, or where these do not fill them.
    pub fn new(x: &[f64], y: &[f64], width: f64) -> Option<Self> {
        let (low, high) = (x.par_chunks(CHUNK)).map(extent).reduce(
            || (f64::INFINITY, f64::NEG_INFINITY),
            |a, b| (a.0.min(b.0), a.1.max(b.1)),
        );
        let part = CHUNK.max(x.len().div_ceil(PARTS));
        let places = (high - low) / width;
        if !(places * (x.len().div_ceil(part) as f64) < x.len() as f64) {
            return None;
        }
        // Sums about the bins' middles and the mean, with the bins' width as the unit of x.
        let (len, mean, per_width) = (places as usize + 2, mean(y, None), 1.0 / width);
        let mut parts: Vec<Vec<Products>> = (x.par_chunks(part))
            .zip(y.par_chunks(part))
            .map(|(x, y)| {
                let mut bins = vec![Products::default(); len];
                for (x, y) in x.iter().zip(y) {
                    let (k, rest) = nearest_whole((x - low) * per_width);
                    // All are: rounding moves none by a whole bin.
                    if let Some(bin) = bins.get_mut(k) {
                        bin.add(rest, y - mean);
                    }
                }
                bins
            })
            .collect();
        let (sums, rest) = parts.split_first_mut()?;
        for part in rest {
            sums.iter_mut().zip(part).for_each(|(sum, part)| *sum = sum.plus(*part));
        }
        let mut columns = Columns::new(len);
        for (place, sums) in sums.iter().enumerate().filter(|(_, sums)| sums.count > 0.0) {
            columns.set(place, sums.about_mean([0.0, 0.0]));
        }
        let lattice = Lattice {
            first: low,
            width,
            len,
            columns,
        };
        lattice.is_filled().then_some(lattice)
    }

    /// Puts bins [first + k width, first + (k + 1) width), which are in order, side by side; nothing where too many would be
    /// empty, or where the data do not fill them.
    pub fn of_bins(bins: &[Bin], first: f64, width: f64) -> Option<Self> {
        let per_width = 1.0 / width;
        let places = (bins.last()?.x - first) * per_width;
        if !(places < (MOST_PLACES * bins.len()) as f64) {
            return None;
        }
        let len = places as usize + 1;
        let mut columns = Columns::new(len);
        for bin in bins {
            let x = (bin.x - first) * per_width;
            let place = (x as usize).min(len - 1);
            let bin = Bin {
                x: x - (place as f64 + 0.5),
                xx: bin.xx * per_width * per_width,
                xy: bin.xy * per_width,
                ..*bin
            };
            columns.set(place, columns.bin(place).plus(bin));
        }
        let lattice = Lattice {
            first: first + 0.5 * width,
            width,
            len,
            columns,
        };
        lattice.is_filled().then_some(lattice)
    }

    /// Whether the data are spread over their bins, as those of a rounded column are not: then it matters where in a
    /// bin a window ends. Evenly spread, they have a variance of 1/12.
    fn is_filled(&self) -> bool {
        let more: f64 = self.columns.count.iter().map(|count| (count - 1.0).max(0.0)).sum();
        let spread: f64 = self.columns.xx.iter().sum();
        more >= ENOUGH && spread > FILLED * more / 12.0
    }

    /// The same data in bins twice as wide.
    pub fn coarser(&self) -> Self {
        let len = self.len.div_ceil(2);
        let half = |place: usize, shift: f64| {
            let bin = self.columns.bin(place);
            Bin {
                x: 0.5 * (bin.x + shift),
                xx: 0.25 * bin.xx,
                xy: 0.5 * bin.xy,
                ..bin
            }
        };
        let mut columns = Columns::new(len);
        for place in 0..len {
            // The middle is where the two meet.
            columns.set(place, half(2 * place, -0.5).plus(half(2 * place + 1, 0.5)));
        }
        Lattice {
            first: self.first + 0.5 * self.width,
            width: 2.0 * self.width,
            len,
            columns,
        }
    }

    /// Those that are not empty.
    pub fn bins(&self) -> impl Iterator<Item = Bin> {
        let places = (0..self.len).map(|place| (place, self.columns.bin(place)));
        places.filter(|(_, bin)| bin.count > 0.0).map(|(place, bin)| Bin {
            x: self.first + (place as f64 + bin.x) * self.width,
            xx: bin.xx * self.width * self.width,
            xy: bin.xy * self.width,
            ..bin
        })
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::super::bin::gather;
    use super::*;

    fn points(n: usize) -> [Vec<f64>; 2] {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(11);
        let x: Vec<f64> = (0..n).map(|_| 1e3 + rng.random_range(-2.0..2.0)).collect();
        let y = x
            .iter()
            .map(|x| (3.0 * x).sin() + rng.random_range(-0.5..0.5))
            .collect();
        [x, y]
    }

    /// Beside what the points of every bin themselves say.
    fn check(lattice: &Lattice, x: &[f64], y: &[f64]) {
        let mean = mean(y, None);
        let mut points = vec![Vec::new(); lattice.len];
        for (x, y) in x.iter().zip(y) {
            points[((x - lattice.first) / lattice.width).round() as usize].push([*x, *y - mean]);
        }
        let mut bins = lattice.bins();
        for points in points.iter().filter(|points| !points.is_empty()) {
            let bin = bins.next().unwrap();
            let count = points.len() as f64;
            let [x, y] = [0, 1].map(|c| points.iter().map(|p| p[c]).sum::<f64>() / count);
            let product =
                |a: usize, b: usize| -> f64 { points.iter().map(|p| (p[a] - [x, y][a]) * (p[b] - [x, y][b])).sum() };
            assert_eq!(bin.count, count);
            let close = |a: f64, b: f64, scale: f64| assert!((a - b).abs() <= 1e-9 * scale, "{a} {b}");
            close(bin.x, x, lattice.width);
            close(bin.y, y, 1.0);
            close(bin.xx, product(0, 0), count * lattice.width.powi(2));
            close(bin.xy, product(0, 1), count * lattice.width);
            close(bin.yy, product(1, 1), count);
        }
        assert!(bins.next().is_none());
    }

    #[test]
    fn bins_are_those_of_their_points_at_every_width() {
        let [x, y] = points(3000);
        let mut lattice = Lattice::new(&x, &y, 2e-3).unwrap();
        loop {
            check(&lattice, &x, &y);
            if lattice.len == 1 {
                break;
            }
            lattice = lattice.coarser();
        }
    }

    #[test]
    fn bins_in_order_are_put_side_by_side() {
        let [mut x, y] = points(3000);
        x.sort_by(f64::total_cmp);
        let mean = mean(&y, None);
        let items = |range: std::ops::Range<usize>| {
            range.map(|i| Bin {
                count: 1.0,
                x: x[i],
                y: y[i] - mean,
                xx: 0.0,
                xy: 0.0,
                yy: 0.0,
            })
        };
        // Two of them hold parts of one bin.
        let mut bins = gather(items(0..1001), x[0], 2e-3);
        bins.extend(gather(items(1001..3000), x[0], 2e-3));
        check(&Lattice::of_bins(&bins, x[0], 2e-3).unwrap(), &x, &y);
        // Points that are far from one another.
        assert!(Lattice::of_bins(&bins[..2], x[0] - 1.0, 1e-3).is_none());
    }

    #[test]
    fn bins_that_would_take_more_room_than_the_points_are_not_made() {
        let [mut x, y] = points(3000);
        assert!(Lattice::new(&x, &y, 1e-3).is_none());
        x[5] = 1e9;
        assert!(Lattice::new(&x, &y, 2e-3).is_none());
    }
}
