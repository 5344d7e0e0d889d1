//! The windows x_i - h <= x_j <= x_i + h of all sorted points, by one walk through the pairs (i, j).
//!
//! ```text
//!  j        ┌──      Where x_j - x_i <= h the walk goes up to the next j, else to the right to the next i.
//!  |     ┌──┘        Where it leaves i, j is the end of the window of i.
//!  |  ┌──┘           Where it leaves j, i is the start of the window of j.
//!  +──┴───── i       It has at most 2 n steps.
//! ```
//!
//! A step has no branch that could be mispredicted, but it must wait for the step before. So a tile of steps is cut into several pieces,
//! which are walked side by side. Bisection along the diagonals i + j = const finds their starts. This takes a third of the time of two
//! searches for every point.

use std::ops::Range;

/// Steps of a tile, a power of two.
const TILE: usize = 4096;
/// Pieces that are walked side by side.
const PIECES: usize = 6;

/// Sorted abscissas, followed by infinities.
pub struct Abscissas<'a> {
    x: &'a [f64],
    /// The last points and the infinities after them.
    tail: Vec<f64>,
    tail_start: usize,
}

impl<'a> Abscissas<'a> {
    pub fn new(x: &'a [f64]) -> Self {
        let tail_start = x.len().saturating_sub(TILE);
        let mut tail = x[tail_start..].to_vec();
        tail.resize(x.len() - tail_start + TILE, f64::INFINITY);
        Abscissas { x, tail, tail_start }
    }

    /// A tile of abscissas, from `start` on.
    fn tile(&self, start: usize) -> &[f64; TILE] {
        let beyond = &[f64::INFINITY; TILE];
        let inside = self.x.get(start..).and_then(|x| x.first_chunk());
        let tail = || self.tail.get(start - self.tail_start..).and_then(|x| x.first_chunk());
        inside.or_else(tail).unwrap_or(beyond)
    }
}

/// The windows of a range of points, found tile by tile.
pub struct WindowBounds<'a> {
    abscissas: &'a Abscissas<'a>,
    h: f64,
    range: Range<usize>,
    /// The first point whose window has not been returned yet.
    next: usize,
    /// The next step is from here.
    i: usize,
    j: usize,
    /// The walk ends here. All further points of the range have windows with this end.
    last: (usize, usize),
    scratch: &'a mut Scratch,
}

/// Memory for windows, which may be used again.
pub struct Scratch {
    /// The starts of all windows of the range, as far as they are known.
    starts: Vec<u32>,
    /// The ends of the windows that the last tile has found.
    ends: Box<[u32; TILE]>,
    /// For each j of a tile, the i at which the walk left it; for each i, the j at which the walk left it. Both count from the start of the
    /// tile.
    i_of_j: Box<[u16; TILE]>,
    j_of_i: Box<[u16; TILE]>,
}

impl Default for Scratch {
    fn default() -> Self {
        Scratch {
            starts: Vec::new(),
            ends: Box::new([0; TILE]),
            i_of_j: Box::new([0; TILE]),
            j_of_i: Box::new([0; TILE]),
        }
    }
}

/// Consecutive points, and the starts and ends of their windows.
pub struct PointWindows<'a> {
    pub points: Range<usize>,
    pub starts: &'a [u32],
    pub ends: &'a [u32],
}

impl<'a> WindowBounds<'a> {
    /// The windows of the points `range`, which must not be empty.
    pub fn new(abscissas: &'a Abscissas<'a>, h: f64, range: Range<usize>, scratch: &'a mut Scratch) -> Self {
        let x = abscissas.x;
        let start = |i: usize| x[..=i].partition_point(|&v| x[i] - v > h);
        let end = |i: usize| i + x[i..].partition_point(|&v| v - x[i] <= h);
        let (i, last) = (start(range.start), end(range.end - 1));
        let j = end(i);
        // All points up to j are in the first window and have its start.
        scratch.starts.resize(range.len(), 0);
        scratch.starts[..j.min(range.end) - range.start].fill(i as u32);
        WindowBounds {
            abscissas,
            h,
            next: range.start,
            range,
            i,
            j,
            last: (start(last - 1), last),
            scratch,
        }
    }

    /// The windows of the next points.
    pub fn next(&mut self) -> Option<PointWindows<'_>> {
        let first = self.next;
        while self.i <= first && (self.i, self.j) != self.last {
            self.walk_tile();
        }
        self.next = if self.i > first {
            self.i
        } else {
            // The walk is over. The remaining points have windows with its end.
            let next = self.range.end.min(first + TILE);
            self.scratch.ends[..next - first].fill(self.j as u32);
            next
        };
        let points = first..self.next;
        let starts = &self.scratch.starts[first - self.range.start..][..points.len()];
        let ends = &self.scratch.ends[..points.len()];
        (!points.is_empty()).then_some(PointWindows { points, starts, ends })
    }

    /// Walks TILE steps, or all remaining steps if there are fewer.
    fn walk_tile(&mut self) {
        let (i, j) = (self.i, self.j);
        let steps = TILE.min(self.last.0 - i + (self.last.1 - j));
        let up = self.walk(steps);
        let right = steps - up;
        let Scratch {
            starts,
            ends,
            i_of_j,
            j_of_i,
        } = &mut *self.scratch;
        let known = starts.len().min(j - self.range.start);
        for (start, &at) in starts[known..].iter_mut().zip(&i_of_j[..up]) {
            *start = i as u32 + u32::from(at);
        }
        // The windows of points before the range are not needed.
        let before = right.min(self.next.saturating_sub(i));
        for (end, &at) in ends.iter_mut().zip(&j_of_i[before..right]) {
            *end = j as u32 + u32::from(at);
        }
        (self.i, self.j) = (i + right, j + up);
    }

    /// Walks this many steps, at most TILE. Returns how many went up, to the next j. The others went to the right, to the next i.
    #[inline(never)]
    fn walk(&mut self, steps: usize) -> usize {
        let (xi, xj, h) = (self.abscissas.tile(self.i), self.abscissas.tile(self.j), self.h);
        let (j_of_i, i_of_j) = (&mut *self.scratch.j_of_i, &mut *self.scratch.i_of_j);
        // The remainders let the compiler know that the indices are in range.
        let goes_up = |i: usize, j: usize| xj[j % TILE] - xi[i % TILE] <= h;
        let diagonals: [usize; PIECES] = std::array::from_fn(|piece| piece * steps / PIECES);
        let first_js = on_diagonals(diagonals, goes_up);
        let mut js = first_js;
        // Pieces may overlap by a step, which is the same in both.
        for step in 0..steps.div_ceil(PIECES) {
            for (j, diagonal) in js.iter_mut().zip(diagonals) {
                let i = diagonal + step - *j;
                // Both entries are overwritten until the walk has left i or j.
                i_of_j[*j % TILE] = i as u16;
                j_of_i[i % TILE] = *j as u16;
                *j += usize::from(goes_up(i, *j));
            }
        }
        // The first cell of a piece may have been written last by the piece before it. So the end of that row and of that column is
        // searched again.
        for piece in (1..PIECES).rev() {
            let end = diagonals.get(piece + 1).map_or(steps, |&diagonal| diagonal);
            let j = first_js[piece];
            let i = diagonals[piece] - j;
            if let Some(j) = (j..end - i).find(|&j| !goes_up(i, j)) {
                j_of_i[i % TILE] = j as u16;
            }
            if let Some(i) = (i..end - j).find(|&i| goes_up(i, j)) {
                i_of_j[j % TILE] = i as u16;
            }
        }
        js[PIECES - 1]
    }
}

/// The j at which the walk crosses each of the diagonals i + j = `sums`. The last diagonal is the farthest.
#[inline(always)]
fn on_diagonals<const D: usize>(sums: [usize; D], goes_up: impl Fn(usize, usize) -> bool) -> [usize; D] {
    // Searches the lowest i on the diagonal whose window holds the j before. All bisections are made at once and without a branch, because
    // a single one would wait for each value that it reads.
    let (mut low, mut len) = ([0; D], sums);
    for _ in 0..usize::BITS - sums[D - 1].leading_zeros() {
        for k in 0..D {
            let half = len[k] / 2;
            let beyond = !goes_up(low[k] + half, sums[k].wrapping_sub(low[k] + half + 1));
            let beyond = usize::from(beyond) & usize::from(len[k] > 0);
            low[k] += beyond * (half + 1);
            // An odd number has equally many on either side of the middle.
            len[k] = half - (beyond & !len[k]);
        }
    }
    std::array::from_fn(|k| sums[k] - low[k])
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::*;

    #[test]
    fn windows_are_those_found_by_bisection() {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(3);
        for n in [1, 2, 3, 7, 100, 1023, 2048, 4095, 4097, 9001] {
            let mut draw = |f: &dyn Fn(f64) -> f64| {
                let mut x: Vec<f64> = (0..n).map(|_| f(rng.random())).collect();
                x.sort_by(f64::total_cmp);
                x
            };
            let lines = [
                draw(&|u| u),
                draw(&|u| 1e6 + u),
                draw(&|u| (std::f64::consts::PI * (u - 0.5)).tan()),
                draw(&|u| (6.0 * u).floor() / 6.0),
                draw(&|u| (4.0 * u).floor() + 1e-9 * u),
                draw(&|_| 2.0),
            ];
            for x in &lines {
                let abscissas = Abscissas::new(x);
                let mut scratch = Scratch::default();
                for h in [1e-300, 1e-10, 1e-3, 1.0 / 6.0, 0.3, 0.9, 2.0, 1e9] {
                    for range in [0..n, n / 3..n / 2, n / 2..n, n - 1..n] {
                        if range.is_empty() {
                            continue;
                        }
                        let (mut starts, mut ends) = (Vec::new(), Vec::new());
                        let mut windows = WindowBounds::new(&abscissas, h, range.clone(), &mut scratch);
                        while let Some(some) = windows.next() {
                            assert!(some.points.start == range.start + starts.len() && !some.points.is_empty());
                            starts.extend_from_slice(some.starts);
                            ends.extend_from_slice(some.ends);
                        }
                        assert_eq!((starts.len(), ends.len()), (range.len(), range.len()));
                        for (k, i) in range.enumerate() {
                            let start = x.partition_point(|v| x[i] - v > h);
                            let end = x.partition_point(|v| v - x[i] <= h);
                            assert_eq!(
                                (starts[k] as usize, ends[k] as usize),
                                (start, end),
                                "n={n} h={h} i={i}"
                            );
                        }
                    }
                }
            }
        }
    }
}
