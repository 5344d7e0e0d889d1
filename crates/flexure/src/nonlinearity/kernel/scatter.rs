//! The estimate at few points from unsorted data, in one pass.
//!
//! The line is cut wherever a window begins or ends. Between two neighbouring cuts all points count
//! for the same windows, so that their moments, about the middle of the interval, are all that is needed
//! of them; a window then slides over intervals as it would over sorted points.

use rayon::prelude::*;

use super::piece::{self, Coefficients, Job, falling, rising, sums};
use super::sort::Places;
use super::sorted::{from_ordered, to_ordered};
use super::window::{Frame, Items, Moments, Slider};
use super::{Sorted, Sums};

/// Data are taken in at most this many parts, each of at least so many points: the parts do not depend on
/// the number of threads, nor does therefore the result.
const PARTS: usize = 16;
const PART: usize = 1 << 15;
/// Entries of the table that finds an interval, for each cut.
const TABLE: usize = 4;

/// Unsorted points.
pub struct Scatter<'a> {
    pub x: &'a [f64],
    pub y: &'a [f64],
    pub w: Option<&'a [f64]>,
    /// What the ordinates are counted from.
    pub mean: f64,
}

/// Visits the sums at each of the increasing points `at`.
pub struct AtFew<'a, F> {
    pub data: &'a Scatter<'a>,
    pub h: f64,
    pub at: &'a [f64],
    pub visit: F,
}

impl<F: FnMut(usize, Sums)> Job for AtFew<'_, F> {
    fn whole<const M: usize, const N: usize>(&mut self, coefficients: impl Coefficients<M>) {
        let cuts = Cuts::new(self.at, self.h, false);
        let line = Line::<N>::new(self.data, &cuts, self.h);
        let mut slider = Slider::new(&line, self.h);
        for (j, (&q, [lo, _, hi])) in self.at.iter().zip(&cuts.windows).enumerate() {
            (self.visit)(j, sums(&mut slider, (*lo, *hi), q, coefficients));
        }
    }

    fn halves<const N: usize>(&mut self) {
        let cuts = Cuts::new(self.at, self.h, true);
        let line = Line::<N>::new(self.data, &cuts, self.h);
        let (mut below, mut above) = (Slider::new(&line, self.h), Slider::new(&line, self.h));
        for (j, (&q, [lo, middle, hi])) in self.at.iter().zip(&cuts.windows).enumerate() {
            let left = sums(&mut below, (*lo, *middle), q, rising);
            let right = sums(&mut above, (*middle, *hi), q, falling);
            let both = if left.mass[0] > 0.0 { left + right } else { right };
            (self.visit)(j, both);
        }
    }
}

/// The cuts in order. Interval i is the half-open one that ends at cut i; one more follows the last.
struct Cuts {
    cuts: Vec<f64>,
    /// For every point the intervals lo..middle up to it and middle..hi beyond it.
    windows: Vec<[usize; 3]>,
    /// The entries, and the number of cuts in those before each.
    table: Places,
    before: Vec<u32>,
}

impl Cuts {
    fn new(at: &[f64], h: f64, halve: bool) -> Self {
        // The same comparisons as for sorted points, to the last bit.
        let begins: Vec<f64> = at.iter().map(|&q| first_float(q - h, |x| !(q - x > h))).collect();
        let ends: Vec<f64> = at.iter().map(|&q| first_float(q + h, |x| x - q > h)).collect();
        let (mut cuts, windows) = if halve {
            let middles: Vec<f64> = at.iter().map(|q| q.next_up()).collect();
            merged([&begins, &middles, &ends], |ranks| ranks)
        } else {
            merged([&begins, &ends], |[lo, hi]| [lo, lo, hi])
        };
        let table = Places::between(cuts[0], cuts[cuts.len() - 1], TABLE * cuts.len());
        let before = table.starts(cuts.iter().copied());
        // Cuts beyond all: the search below need not look where the list ends.
        cuts.extend([f64::INFINITY; 2]);
        Cuts {
            cuts,
            windows,
            table,
            before,
        }
    }

    /// The interval that holds the finite `x`: the number of cuts up to it.
    #[inline(always)]
    fn interval(&self, x: f64) -> usize {
        let entry = self.table.of(x);
        let first = self.before[entry] as usize;
        // Few entries have more than two, so that there is hardly ever anything to mispredict.
        let i = first + usize::from(self.cuts[first] <= x) + usize::from(self.cuts[first + 1] <= x);
        if i == first + 2 {
            let end = self.before[entry + 1] as usize;
            return i + self.cuts[i..end.max(i)].partition_point(|&cut| cut <= x);
        }
        i
    }

    /// The middle of interval `i`; the ends of the first and the last are never looked at.
    fn middle(&self, i: usize) -> f64 {
        let low = self.cuts[i.saturating_sub(1)];
        let high = self.cuts[i.min(self.cuts.len() - 3)];
        low + 0.5 * (high - low)
    }
}

/// The different values of equally long increasing lists in order, and for the values of each place how many there are
/// up to each of them.
fn merged<const K: usize>(
    lists: [&[f64]; K],
    window: impl Fn([usize; K]) -> [usize; 3],
) -> (Vec<f64>, Vec<[usize; 3]>) {
    let len = lists[0].len();
    let mut values: Vec<f64> = Vec::with_capacity(K * len);
    let mut ranks = vec![[0; K]; len];
    let mut next = [0; K];
    for _ in 0..K * len {
        // Without a branch, which could not be predicted.
        let mut least = 0;
        for k in 1..K {
            let (a, b) = (next[least], next[k]);
            let lower = lists[k][b.min(len - 1)] < lists[least][a.min(len - 1)];
            least = if (a == len) | (lower & (b < len)) { k } else { least };
        }
        let value = lists[least][next[least]];
        if values.last() != Some(&value) {
            values.push(value);
        }
        ranks[next[least]][least] = values.len();
        next[least] += 1;
    }
    (values, ranks.into_iter().map(window).collect())
}

/// The lowest float for which `holds`, which is false below some float and true from there on.
fn first_float(guess: f64, holds: impl Fn(f64) -> bool) -> f64 {
    // Mostly the guess or one of its neighbours, of which there is no telling.
    let above = guess.next_up();
    if !holds(guess.next_down()) & holds(above) {
        return if holds(guess) { guess } else { above };
    }
    far_float(guess, holds)
}

/// The same for any guess.
#[cold]
#[inline(never)]
fn far_float(guess: f64, holds: impl Fn(f64) -> bool) -> f64 {
    let (least, most) = (to_ordered(f64::NEG_INFINITY), to_ordered(f64::INFINITY));
    let guess = to_ordered(guess);
    let holds = |key: u64| holds(from_ordered(key));
    // Keys false <= below < above <= true.
    let (mut below, mut above, mut step) = (guess, guess, 1);
    while above < most && !holds(above) {
        below = above;
        above = above.saturating_add(step).min(most);
        step *= 2;
    }
    while below > least && holds(below) {
        above = below;
        below = below.saturating_sub(step).max(least);
        step *= 2;
    }
    while above - below > 1 {
        let middle = below + (above - below) / 2;
        if holds(middle) {
            above = middle;
        } else {
            below = middle;
        }
    }
    from_ordered(above)
}

/// The moments of an interval about its middle; for three of either kind in one line of the cache.
#[derive(Clone, Copy)]
#[repr(align(64))]
struct Cell<const N: usize> {
    middle: f64,
    moments: Moments<N>,
}

/// All intervals, from below the first cut to above the last.
struct Line<const N: usize> {
    per_h: f64,
    cells: Vec<Cell<N>>,
}

impl<const N: usize> Line<N> {
    fn new(data: &Scatter, cuts: &Cuts, h: f64) -> Self {
        let per_h = 1.0 / h;
        let empty = || -> Vec<Cell<N>> {
            (0..cuts.cuts.len() - 1)
                .map(|i| Cell {
                    middle: cuts.middle(i),
                    moments: Moments::ZERO,
                })
                .collect()
        };
        let part = PART.max(data.x.len().div_ceil(PARTS));
        let mut parts: Vec<Vec<Cell<N>>> = (0..data.x.len().div_ceil(part))
            .into_par_iter()
            .map(|k| {
                let mut cells = empty();
                let end = data.x.len().min((k + 1) * part);
                data.collect(k * part..end, cuts, per_h, &mut cells);
                cells
            })
            .collect();
        let mut cells = parts.swap_remove(0);
        // The last has taken the first one's place: still one fixed order.
        for other in &parts {
            for (cell, other) in cells.iter_mut().zip(other) {
                cell.moments = cell.moments.plus(&other.moments);
            }
        }
        Line { per_h, cells }
    }
}

impl Scatter<'_> {
    /// The points within `h` of any of the increasing points `at`, and the data's mean.
    pub fn near(&self, at: &[f64], h: f64) -> Sorted {
        let near = |x: f64| {
            let next = at.partition_point(|&q| x - q > h);
            at.get(next).is_some_and(|&q| !(q - x > h))
        };
        let kept: Vec<usize> = (0..self.x.len()).filter(|&i| near(self.x[i])).collect();
        let of = |v: &[f64]| -> Vec<f64> { kept.iter().map(|&i| v[i]).collect() };
        match self.w {
            None => Sorted::new(&of(self.x), &of(self.y)),
            Some(w) => Sorted::weighted(&of(self.x), &of(self.y), &of(w)),
        }
    }

    fn collect<const N: usize>(&self, range: std::ops::Range<usize>, cuts: &Cuts, per_h: f64, cells: &mut [Cell<N>]) {
        let points = self.x[range.clone()].iter().zip(&self.y[range.clone()]);
        match self.w {
            None => points.for_each(|(&x, &y)| add(cells, cuts, per_h, x, [1.0, y - self.mean])),
            Some(w) => points
                .zip(&w[range])
                .filter(|(_, w)| **w > 0.0)
                .for_each(|((&x, &y), &w)| add(cells, cuts, per_h, x, [w, w * (y - self.mean)])),
        }
    }
}

/// Adds a point of weight `w` and weighted ordinate `wy` to its cell.
#[inline(always)]
fn add<const N: usize>(cells: &mut [Cell<N>], cuts: &Cuts, per_h: f64, x: f64, [w, wy]: [f64; 2]) {
    let cell = &mut cells[cuts.interval(x)];
    cell.moments.push((x - cell.middle) * per_h, w, wy);
}

impl<const N: usize> Items<N> for Line<N> {
    fn len(&self) -> usize {
        self.cells.len()
    }

    fn anchor(&self, i: usize) -> f64 {
        self.cells[i].middle
    }

    fn add(&self, i: usize, frame: Frame, sum: &mut Moments<N>) {
        let cell = &self.cells[i];
        if cell.moments.0[0][0] > 0.0 {
            let d = (cell.middle - frame.anchor) * self.per_h;
            *sum = sum.plus(&cell.moments.shifted(d));
        }
    }
}

/// Visits the sums at the increasing points `at`, `h` wide, for a kernel of bounded support.
pub fn for_each(
    data: &Scatter,
    (kernel, degree): (super::Kernel, super::Degree),
    h: f64,
    at: &[f64],
    visit: impl FnMut(usize, Sums),
) {
    piece::perform(&mut AtFew { data, h, at, visit }, kernel, degree);
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// The same by sorting and counting.
    fn sorted_and_counted(lists: [&[f64]; 3]) -> (Vec<f64>, Vec<[usize; 3]>) {
        let mut values = lists.concat();
        values.sort_by(f64::total_cmp);
        values.dedup();
        let rank = |value: f64| values.partition_point(|v| *v <= value);
        let ranks = (0..lists[0].len()).map(|i| lists.map(|list| rank(list[i]))).collect();
        (values, ranks)
    }

    fn check(mut lists: [Vec<f64>; 3]) {
        lists.iter_mut().for_each(|list| list.sort_by(f64::total_cmp));
        let [a, b, c] = lists.each_ref().map(Vec::as_slice);
        assert_eq!(merged([a, b, c], |ranks| ranks), sorted_and_counted([a, b, c]));
        assert_eq!(merged([a, c], |[lo, hi]| [lo, lo, hi]), sorted_and_counted([a, a, c]));
    }

    #[test]
    fn lists_with_ties_and_infinite_ends_are_merged() {
        check([vec![1.0], vec![1.0], vec![1.0]]);
        check([
            vec![0.0, 1.0, 1.0],
            vec![1.0, 2.0, 2.0],
            vec![2.0, f64::INFINITY, f64::INFINITY],
        ]);
        check([vec![5.0, 6.0], vec![3.0, 4.0], vec![1.0, 2.0]]);
    }

    proptest! {
        #[test]
        fn any_lists_are_merged(values in prop::collection::vec(prop::array::uniform3(0..40_u8), 1..60)) {
            check(std::array::from_fn(|k| values.iter().map(|v| f64::from(v[k])).collect()));
        }

        #[test]
        fn the_first_float_is_found_from_any_guess(limit in prop::num::f64::NORMAL, steps in -3000_i64..3000) {
            let holds = |x: f64| x >= limit;
            let guess = from_ordered(to_ordered(limit).saturating_add_signed(steps));
            prop_assume!(guess.is_finite());
            prop_assert_eq!(first_float(guess, holds), limit);
            prop_assert_eq!(first_float(0.0, holds), limit);
        }
    }
}
