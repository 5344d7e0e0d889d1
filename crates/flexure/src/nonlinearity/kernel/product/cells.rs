//! Points in cells: those of a box are a few contiguous runs.
//!
//! Space is cut into equal cells, and the points are ordered by their cells' coordinates, the first
//! coordinate first. Only cells that hold points are kept, as a tree with one level a dimension: at each level
//! the distinct coordinates of the cells that agree in the dimensions before it. So neither far outliers nor
//! clusters nor many dimensions cost memory or time for empty cells, and the cells of a box that differ in the
//! last dimension alone are one run of points.

use std::ops::Range;

/// The dense way to order the points is taken with up to this many cells a point.
const DENSE: f64 = 2.0;
/// Cells are half a window's half width where they then hold this many points on average, else twice as wide.
const OCCUPANCY: f64 = 2.0;
/// Dimensions in which such small cells pay.
const FINE_DIMENSIONS: usize = 3;
/// Cells are so many times as narrow along the last dimension, where they make no further runs.
const SLICES: i64 = 4;

/// The cells that hold points, and the points' order by them.
#[derive(Debug, Clone, PartialEq)]
pub struct Cells {
    origin: Vec<f64>,
    /// Cells a unit of x.
    rate: Vec<f64>,
    /// Half widths of a window.
    reach: Vec<f64>,
    levels: Vec<Level>,
}

/// The cells' coordinates along one dimension, for each choice of those before it.
#[derive(Debug, Clone, PartialEq, Default)]
struct Level {
    /// Increasing among the children of one entry of the level before.
    coordinate: Vec<i64>,
    /// Entry e has the children `first[e]..first[e + 1]`: entries of the next level, or points.
    first: Vec<u32>,
}

impl Cells {
    /// Cells for windows of the half widths `reach`, the columns' ranges, and the points' indices
    /// in order of their cells.
    pub fn new(x: &[&[f64]], reach: &[f64]) -> (Cells, Vec<(f64, f64)>, Vec<u32>) {
        let n = x[0].len();
        let ends: Vec<(f64, f64)> = x.iter().map(|column| range(column)).collect();
        let last = x.len() - 1;
        // Half by half, as the range itself need not be finite.
        let cells_along = |j: usize, width: f64| ((0.5 * ends[j].1 - 0.5 * ends[j].0) / (0.5 * width)).floor() + 1.0;
        let cells = |widths: &[f64]| -> f64 { (0..=last).map(|j| cells_along(j, widths[j])).product() };
        let widths = |share: f64| -> Vec<f64> { reach.iter().map(|r| share * r).collect() };
        let fine = x.len() <= FINE_DIMENSIONS && cells(&widths(0.5)) * OCCUPANCY <= n as f64;
        let mut widths = widths(if fine { 0.5 } else { 1.0 });
        widths[last] /= SLICES as f64;
        let dense = cells(&widths) <= DENSE * n as f64 + 64.0;
        let mut cells = Cells {
            origin: ends.iter().map(|e| e.0).collect(),
            rate: widths.iter().map(|width| 1.0 / width).collect(),
            reach: reach.to_vec(),
            levels: vec![Level::default(); x.len()],
        };
        let order = if dense {
            cells.order_densely(x, &ends)
        } else {
            cells.order_sparsely(x)
        };
        for level in 0..x.len() {
            let end = cells.levels.get(level + 1).map_or(n, |next| next.coordinate.len());
            cells.levels[level].first.push(end as u32);
        }
        (cells, ends, order)
    }

    /// The coordinate of `x` along dimension `j`: never less for a greater x.
    #[inline(always)]
    fn coordinate(&self, j: usize, x: f64) -> i64 {
        ((x - self.origin[j]) * self.rate[j]).floor() as i64
    }

    /// By counting: every cell that could be has a number.
    fn order_densely(&mut self, x: &[&[f64]], ends: &[(f64, f64)]) -> Vec<u32> {
        let n = x[0].len();
        let spans: Vec<usize> = (0..x.len())
            .map(|j| self.coordinate(j, ends[j].1) as usize + 1)
            .collect();
        let mut keys = vec![0_u32; n];
        for (j, column) in x.iter().enumerate() {
            let (origin, rate, span) = (self.origin[j], self.rate[j], spans[j] as u32);
            for (key, x) in keys.iter_mut().zip(*column) {
                *key = *key * span + ((x - origin) * rate) as u32;
            }
        }
        let cells: usize = spans.iter().product();
        let mut starts = vec![0_u32; cells + 1];
        for &key in &keys {
            starts[key as usize + 1] += 1;
        }
        for cell in 0..cells {
            starts[cell + 1] += starts[cell];
        }
        let mut coordinates = vec![0; x.len()];
        for cell in (0..cells).filter(|&cell| starts[cell] < starts[cell + 1]) {
            let mut rest = cell;
            for j in (0..x.len()).rev() {
                coordinates[j] = (rest % spans[j]) as i64;
                rest /= spans[j];
            }
            self.push(&coordinates, starts[cell] as usize);
        }
        let mut order = vec![0; n];
        for (i, &key) in keys.iter().enumerate() {
            let start = &mut starts[key as usize];
            order[*start as usize] = i as u32;
            *start += 1;
        }
        order
    }

    /// By comparison of the cells' coordinates.
    fn order_sparsely(&mut self, x: &[&[f64]]) -> Vec<u32> {
        let (n, d) = (x[0].len(), x.len());
        let mut keys = vec![0_i64; n * d];
        for (j, column) in x.iter().enumerate() {
            for (i, &x) in column.iter().enumerate() {
                keys[i * d + j] = self.coordinate(j, x);
            }
        }
        let key = |i: u32| &keys[i as usize * d..][..d];
        let mut order: Vec<u32> = (0..n as u32).collect();
        order.sort_unstable_by(|&i, &k| key(i).cmp(key(k)).then(i.cmp(&k)));
        let mut start = 0;
        for cell in order.chunk_by(|&i, &k| key(i) == key(k)) {
            self.push(key(cell[0]), start);
            start += cell.len();
        }
        order
    }

    /// Adds the next cell in order, whose first point is `start`.
    fn push(&mut self, coordinates: &[i64], start: usize) {
        let d = coordinates.len();
        let mut new = false;
        for (j, &coordinate) in coordinates.iter().enumerate() {
            // Below a new entry everything is new.
            if new || self.levels[j].coordinate.last() != Some(&coordinate) {
                new = true;
                let child = self.levels.get(j + 1).map_or(start, |next| next.coordinate.len());
                self.levels[j].coordinate.push(coordinate);
                self.levels[j].first.push(if j + 1 == d { start } else { child } as u32);
            }
        }
    }

    /// The points in turn, by groups whose windows have much in common: those of a cell as wide along the last
    /// dimension as along the others.
    pub fn groups(&self) -> Vec<Range<usize>> {
        let Some((last, before)) = self.levels.split_last() else {
            return Vec::new();
        };
        let parents = before.last().map_or(&[][..], |level| &level.first);
        let mut groups = Vec::new();
        for children in parents.windows(2) {
            let mut entry = children[0] as usize;
            let siblings = &last.coordinate[entry..children[1] as usize];
            for group in siblings.chunk_by(|a, b| a.div_euclid(SLICES) == b.div_euclid(SLICES)) {
                let end = entry + group.len();
                groups.push(last.first[entry] as usize..last.first[end] as usize);
                entry = end;
            }
        }
        groups
    }

    /// The runs of points that hold all of the box from `low` to `high` and `share` of a window's half width more
    /// on every side.
    pub fn runs(&self, low: &[f64], high: &[f64], share: f64, runs: &mut Vec<Range<usize>>) {
        runs.clear();
        let ends = |j: usize| {
            // A little more: the caller's comparisons are rounded in another order.
            let room = share * self.reach[j] * (1.0 + 1e-12) + 1e-15 * low[j].abs().max(high[j].abs());
            (self.coordinate(j, low[j] - room), self.coordinate(j, high[j] + room))
        };
        self.descend(0, 0..self.levels[0].coordinate.len(), &ends, runs);
    }

    fn descend(
        &self,
        j: usize,
        entries: Range<usize>,
        ends: &impl Fn(usize) -> (i64, i64),
        runs: &mut Vec<Range<usize>>,
    ) {
        let level = &self.levels[j];
        let (low, high) = ends(j);
        let coordinates = &level.coordinate[entries.clone()];
        let from = entries.start + before(coordinates, low);
        let to = entries.start + before(coordinates, high.saturating_add(1));
        if from >= to {
            return;
        }
        if j + 1 == self.levels.len() {
            let run = level.first[from] as usize..level.first[to] as usize;
            match runs.last_mut() {
                Some(last) if last.end == run.start => last.end = run.end,
                _ => runs.push(run),
            }
            return;
        }
        for entry in from..to {
            let children = level.first[entry] as usize..level.first[entry + 1] as usize;
            self.descend(j + 1, children, ends, runs);
        }
    }
}

/// How many of the distinct increasing `coordinates` come before `limit`.
#[inline(always)]
fn before(coordinates: &[i64], limit: i64) -> usize {
    let Some(&first) = coordinates.first() else { return 0 };
    if limit <= first {
        return 0;
    }
    // Where no cell is empty.
    let guess = limit.saturating_sub(first) as usize;
    if coordinates.get(guess) == Some(&limit) {
        return guess;
    }
    coordinates[..coordinates.len().min(guess)].partition_point(|&c| c < limit)
}

fn range(column: &[f64]) -> (f64, f64) {
    // Four at a time, so that it is vectorised.
    let (chunks, rest) = column.as_chunks::<4>();
    let (mut low, mut high) = ([f64::INFINITY; 4], [f64::NEG_INFINITY; 4]);
    for chunk in chunks {
        for l in 0..4 {
            low[l] = if chunk[l] < low[l] { chunk[l] } else { low[l] };
            high[l] = if chunk[l] > high[l] { chunk[l] } else { high[l] };
        }
    }
    (
        low.iter().chain(rest).copied().fold(f64::INFINITY, f64::min),
        high.iter().chain(rest).copied().fold(f64::NEG_INFINITY, f64::max),
    )
}
