//! The cells that hold points, as a tree with one level a dimension: at each level the distinct coordinates of the
//! cells that agree in the dimensions before it.

use std::ops::Range;

use super::{Ends, InOrder, Rule, SLICES, push};

#[derive(Debug, Clone, PartialEq)]
pub struct Tree {
    levels: Vec<Level>,
}

/// The cells' coordinates along one dimension, for each combination of the coordinates before it.
#[derive(Debug, Clone, PartialEq, Default)]
struct Level {
    /// Increasing among the children of one entry of the level before.
    coordinate: Vec<i64>,
    /// Entry e has the children `first[e]..first[e + 1]`: entries of the next level, or points.
    first: Vec<u32>,
}

impl Tree {
    /// Orders the points by comparison of their cells' coordinates.
    pub fn ordered(rule: &Rule, x: &[&[f64]]) -> InOrder<Tree> {
        let (n, d) = (x[0].len(), x.len());
        let mut keys = vec![0_i64; n * d];
        for (j, column) in x.iter().enumerate() {
            for (i, &x) in column.iter().enumerate() {
                keys[i * d + j] = rule.coordinate(j, x);
            }
        }
        let key = |i: u32| &keys[i as usize * d..][..d];
        let mut order: Vec<u32> = (0..n as u32).collect();
        order.sort_unstable_by(|&i, &k| key(i).cmp(key(k)).then(i.cmp(&k)));
        let mut tree = Tree {
            levels: vec![Level::default(); d],
        };
        let mut start = 0;
        for cell in order.chunk_by(|&i, &k| key(i) == key(k)) {
            tree.push(key(cell[0]), start);
            start += cell.len();
        }
        for level in 0..d {
            let end = tree.levels.get(level + 1).map_or(n, |next| next.coordinate.len());
            tree.levels[level].first.push(end as u32);
        }
        InOrder { index: tree, order }
    }

    /// Adds the next cell in order, whose first point is `start`.
    fn push(&mut self, coordinates: &[i64], start: usize) {
        let d = coordinates.len();
        let mut new = false;
        for (j, &coordinate) in coordinates.iter().enumerate() {
            // All entries below a new one are new.
            if new || self.levels[j].coordinate.last() != Some(&coordinate) {
                new = true;
                let child = self.levels.get(j + 1).map_or(start, |next| next.coordinate.len());
                self.levels[j].coordinate.push(coordinate);
                self.levels[j].first.push(if j + 1 == d { start } else { child } as u32);
            }
        }
    }

    pub fn groups(&self) -> Vec<Range<usize>> {
        let Some((last, before)) = self.levels.split_last() else {
            return Vec::new();
        };
        let parents = before.last().map_or(&[][..], |level| &level.first);
        let slices = SLICES as i64;
        let mut groups = Vec::new();
        for children in parents.windows(2) {
            let mut entry = children[0] as usize;
            let siblings = &last.coordinate[entry..children[1] as usize];
            for group in siblings.chunk_by(|a, b| a.div_euclid(slices) == b.div_euclid(slices)) {
                let end = entry + group.len();
                groups.push(last.first[entry] as usize..last.first[end] as usize);
                entry = end;
            }
        }
        groups
    }

    pub fn runs(&self, ends: &Ends, runs: &mut Vec<Range<usize>>) {
        self.descend(0, 0..self.levels[0].coordinate.len(), ends, runs);
    }

    fn descend(&self, j: usize, entries: Range<usize>, ends: &Ends, runs: &mut Vec<Range<usize>>) {
        let level = &self.levels[j];
        let (low, high) = ends[j];
        let coordinates = &level.coordinate[entries.clone()];
        let from = entries.start + before(coordinates, low);
        let to = entries.start + before(coordinates, high.saturating_add(1));
        if from >= to {
            return;
        }
        if j + 1 == self.levels.len() {
            push(level.first[from] as usize..level.first[to] as usize, runs);
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
    // This is the place if no earlier cell is empty.
    let guess = limit.saturating_sub(first) as usize;
    if coordinates.get(guess) == Some(&limit) {
        return guess;
    }
    coordinates[..coordinates.len().min(guess)].partition_point(|&c| c < limit)
}
