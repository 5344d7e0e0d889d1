//! The choice of a window for every node, the places of the jumps, and the curve from them.

use super::windows::{Family, Line, Windows};
use crate::nonlinearity::kernel::Sorted;

/// The estimates from the left and from the right contradict each other if they differ by more than this many standard errors.
const CONTRADICTION: f64 = 6.0;

/// Jumps below this share of the largest ordinate are rounding.
const ROUNDING: f64 = 1e-9;

/// The sides of a node to which its window reaches.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// To the left only.
    Left,
    /// To both sides.
    Both,
    /// To the right only.
    Right,
}

/// The window that was chosen at a node.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LocalWindow {
    /// The node, in the unit of x.
    pub x: f64,
    /// How far the window reaches, to both sides or to one (Gaussian: its standard deviation), in the unit of x.
    pub bandwidth: f64,
    /// The sides to which it reaches.
    pub side: Side,
    /// The estimate.
    pub value: f64,
    /// Its standard error. It does not include the bias, which is at most as large.
    pub standard_error: f64,
}

/// The choice for all nodes.
pub struct Chosen {
    pub table: Vec<LocalWindow>,
    pub curve: Broken,
    pub jumps: Vec<f64>,
}

impl Chosen {
    /// A choice without jumps.
    pub fn smooth(table: Vec<LocalWindow>, data: &Sorted) -> Chosen {
        Chosen {
            curve: curve(&table, &[], data),
            table,
            jumps: Vec::new(),
        }
    }
}

/// A piecewise linear function with jumps: two points with one abscissa.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Broken {
    x: Vec<f64>,
    y: Vec<f64>,
}

/// A piece between two neighbouring points.
struct Piece {
    /// The index of the first.
    first: usize,
    slope: f64,
}

/// A line and the window that it is fitted over.
#[derive(Clone, Copy)]
struct Grown {
    side: Side,
    bandwidth: f64,
    line: Line,
}

impl Broken {
    fn push(&mut self, x: f64, y: f64) {
        self.x.push(x);
        self.y.push(y);
    }

    /// The value at `x`; at a jump, the value on its right.
    pub fn value(&self, x: f64) -> f64 {
        let Some(Piece { first, slope }) = self.piece(x) else {
            return self.y.first().copied().unwrap_or(f64::NAN);
        };
        self.y[first] + slope * (x - self.x[first])
    }

    /// The slope at `x`.
    pub fn slope(&self, x: f64) -> f64 {
        self.piece(x).map_or(0.0, |piece| piece.slope)
    }

    /// The piece that holds `x`.
    fn piece(&self, x: f64) -> Option<Piece> {
        let last = self.x.len().checked_sub(2)?;
        let first = self.x.partition_point(|&v| v <= x).saturating_sub(1).min(last);
        let width = self.x[first + 1] - self.x[first];
        let slope = if width > 0.0 {
            (self.y[first + 1] - self.y[first]) / width
        } else {
            0.0
        };
        Some(Piece { first, slope })
    }
}

impl Windows<'_> {
    /// One bandwidth for all nodes.
    pub fn uniform(&self, data: &Sorted, h: f64) -> Chosen {
        let lines = self.around(h);
        let window = |line| Grown {
            side: Side::Both,
            bandwidth: h,
            line,
        };
        Chosen::smooth(self.table(|j| lines[j].map(window)), data)
    }

    /// Each of the three families has a last consistent line at every node. The one with the smallest standard error is chosen. Lines are
    /// consistent if their intervals of `threshold` standard errors have a point in common.
    pub fn adapted(&self, data: &Sorted, threshold: f64) -> Chosen {
        let nodes = self.design.nodes.len();
        let grown = |family: &Family, side: Side| -> Vec<Option<Grown>> {
            let grown = |j: usize| self.last_consistent(family, side, j, threshold);
            (0..nodes).map(grown).collect()
        };
        let left = grown(&self.left, Side::Left);
        let both = grown(&self.both, Side::Both);
        let right = grown(&self.right, Side::Right);
        let table = self.table(|j| {
            let families = [both[j], left[j], right[j]].into_iter().flatten();
            families.min_by(|a, b| a.line.error.total_cmp(&b.line.error))
        });
        let smooth = curve(&table, &[], data);
        let jumps = self.jumps(data, [&left, &right], &smooth);
        Chosen {
            curve: curve(&table, &jumps, data),
            table,
            jumps: jumps.iter().map(|jump| jump.x).collect(),
        }
    }

    fn table(&self, chosen: impl Fn(usize) -> Option<Grown>) -> Vec<LocalWindow> {
        (0..self.design.nodes.len())
            .filter_map(|j| {
                let Grown { side, bandwidth, line } = chosen(j)?;
                Some(LocalWindow {
                    x: self.design.nodes[j],
                    bandwidth,
                    side,
                    value: line.value,
                    standard_error: line.error,
                })
            })
            .collect()
    }

    /// The last line at node `j` whose interval has a point in common with the intervals of all lines before it.
    fn last_consistent(&self, family: &Family, side: Side, j: usize, threshold: f64) -> Option<Grown> {
        let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
        let mut last = None;
        for (lines, &bandwidth) in family.iter().zip(&self.design.bandwidths) {
            let Some(line) = lines[j] else { continue };
            low = low.max(line.value - threshold * line.error);
            high = high.min(line.value + threshold * line.error);
            if low > high {
                break;
            }
            last = Some(Grown { side, bandwidth, line });
        }
        last
    }

    /// Runs of cells between nodes over which the line from the left and the line from the right contradict each other by more than both
    /// biases can explain. Each run comes with the lines from the nodes before and after it.
    fn jumps(&self, data: &Sorted, [left, right]: [&[Option<Grown>]; 2], smooth: &Broken) -> Vec<Jump> {
        let evidence = 2.0 * (left.len() as f64).ln();
        let across = |from: usize, to: usize| {
            let lines = [left[from]?.line, right[to]?.line];
            let nodes = [self.design.nodes[from], self.design.nodes[to]];
            Some(Jump {
                x: f64::NAN,
                spacing: 0.0,
                nodes,
                lines,
            })
        };
        let torn = |cell: usize| {
            across(cell, cell + 1).is_some_and(|jump| {
                let middle = 0.5 * (jump.nodes[0] + jump.nodes[1]);
                let [l, r] = jump.lines;
                (jump.value(0, middle) - jump.value(1, middle)).abs() > CONTRADICTION * l.error.hypot(r.error)
            })
        };
        let least = ROUNDING * data.y.iter().fold(0.0, |most: f64, y| most.max(y.abs()));
        let torn: Vec<bool> = (0..left.len().saturating_sub(1)).map(torn).collect();
        let mut jumps = Vec::new();
        let mut cell = 0;
        for run in torn.chunk_by(|a, b| a == b) {
            if run[0] {
                let evidence = evidence * self.design.noise[cell].powi(2);
                jumps.extend(
                    across(cell, cell + run.len())
                        .and_then(|jump| jump.placed(data, smooth, evidence))
                        .filter(|jump| jump.height() > least),
                );
            }
            cell += run.len();
        }
        jumps
    }
}

/// A jump between two nodes, and the lines on either side with their nodes.
struct Jump {
    x: f64,
    /// The distance between the points on either side of the jump.
    spacing: f64,
    nodes: [f64; 2],
    lines: [Line; 2],
}

impl Jump {
    fn value(&self, side: usize, x: f64) -> f64 {
        self.lines[side].value + self.lines[side].slope * (x - self.nodes[side])
    }

    /// The height that remains if the two lines may meet anywhere within `spacing`. It is not positive at a kink.
    fn height(&self) -> f64 {
        let [l, r] = self.lines;
        let bent = (l.slope - r.slope).abs() * self.spacing;
        (self.value(0, self.x) - self.value(1, self.x)).abs() - bent
    }

    /// Puts the jump where the residuals of the points between the nodes are smallest. `None` if all of them belong to one side, or if the
    /// sum of their squares is not smaller by `evidence` than without a jump.
    fn placed(mut self, data: &Sorted, smooth: &Broken, evidence: f64) -> Option<Jump> {
        let from = data.x.partition_point(|&x| x < self.nodes[0]);
        let to = data.x.partition_point(|&x| x <= self.nodes[1]);
        let square = |i: usize, value: f64| data.weight(i) * (data.y[i] - value).powi(2);
        let (mut gain, mut best, mut place, mut spacing) = (0.0, f64::NEG_INFINITY, f64::NAN, 0.0);
        for i in from..to {
            // First all points are taken as right of the jump, then one after the other as left of it.
            gain += square(i, smooth.value(data.x[i])) - square(i, self.value(1, data.x[i]));
        }
        for i in from..to.saturating_sub(1) {
            let (x, next) = (data.x[i], data.x[i + 1]);
            gain += square(i, self.value(1, x)) - square(i, self.value(0, x));
            // A jump does not lie between points of one abscissa.
            if gain > best && next > x {
                (best, place, spacing) = (gain, x + 0.5 * (next - x), next - x);
            }
        }
        (self.x, self.spacing) = (place, spacing);
        (best > evidence).then_some(self)
    }
}

/// The curve through the table. Between the nodes of a jump it follows the jump's two lines.
fn curve(table: &[LocalWindow], jumps: &[Jump], data: &Sorted) -> Broken {
    let mut curve = Broken::default();
    let mut rest = jumps.iter().peekable();
    for window in table {
        while let Some(jump) = rest.next_if(|jump| jump.nodes[1] <= window.x) {
            curve.push(jump.x, jump.value(0, jump.x));
            curve.push(jump.x, jump.value(1, jump.x));
        }
        if rest.peek().is_none_or(|jump| window.x <= jump.nodes[0]) {
            curve.push(window.x, window.value);
        }
    }
    // Without any window only the mean is known.
    if curve.x.is_empty() {
        curve.push(data.x[0], 0.0);
    }
    curve
}
