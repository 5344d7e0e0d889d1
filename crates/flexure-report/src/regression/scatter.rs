//! Many points in few numbers: all of them, or how many lie in each cell of a grid.

use serde::Serialize;

use crate::data::Scatter;
use crate::decimate::round;
use crate::limits;

/// Share of the points, at either end, that may lie outside the picture.
const TAIL: f64 = 0.005;
/// The picture is cut if all points together would need this many times the height.
const WIDE: f64 = 3.0;

/// Points as they are drawn.
#[derive(Serialize)]
pub(crate) struct Cloud {
    x: Vec<f64>,
    y: Vec<f64>,
    cells: Option<Cells>,
    /// The ordinates' range that shows all but far outliers.
    y_range: [f64; 2],
    /// Points outside that range.
    pub outside: usize,
}

impl Cloud {
    /// Whether the points are counted rather than drawn one by one.
    pub fn counted(&self) -> bool {
        self.cells.is_some()
    }
}

/// Counts on a grid of equal cells, those that are not empty.
#[derive(Serialize)]
struct Cells {
    x: [f64; 2],
    y: [f64; 2],
    columns: usize,
    rows: usize,
    /// `row * columns + column`, counted from the smallest abscissa and ordinate.
    index: Vec<usize>,
    count: Vec<u32>,
}

/// The finite points of a scatter; `None` without any.
pub(crate) fn cloud(scatter: &Scatter) -> Option<Cloud> {
    let pairs = scatter.x.iter().zip(&scatter.y).map(|(&x, &y)| [x, y]);
    let points: Vec<[f64; 2]> = pairs.filter(|p| p.iter().all(|v| v.is_finite())).collect();
    if points.is_empty() {
        return None;
    }
    let y_range = picture(points.iter().map(|p| p[1]).collect());
    let shown = |p: &&[f64; 2]| (y_range[0]..=y_range[1]).contains(&p[1]);
    let outside = points.len() - points.iter().filter(shown).count();
    let many = points.len() > limits::SCATTER_POINTS;
    let list = |k: usize| points.iter().map(|p| round(p[k])).collect();
    Some(Cloud {
        x: if many { Vec::new() } else { list(0) },
        y: if many { Vec::new() } else { list(1) },
        cells: many.then(|| cells(&points, y_range)),
        y_range,
        outside,
    })
}

/// The range of all values, cut to that of most where a few lie far out.
fn picture(mut values: Vec<f64>) -> [f64; 2] {
    values.sort_unstable_by(f64::total_cmp);
    let n = values.len();
    let (low, high) = (values[0], values[n - 1]);
    let tail = (TAIL * n as f64) as usize;
    let (bottom, top) = (values[tail], values[n - 1 - tail]);
    let bulk = top - bottom;
    if !(bulk > 0.0) || high - low <= WIDE * bulk {
        return [low, high];
    }
    [low.max(bottom - 0.5 * bulk), high.min(top + 0.5 * bulk)]
}

fn cells(points: &[[f64; 2]], y: [f64; 2]) -> Cells {
    let along_x = points.iter().map(|p| p[0]);
    let x = along_x.fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], v| [l.min(v), h.max(v)]);
    let [columns, rows] = limits::SCATTER_CELLS;
    let mut counts = vec![0_u32; columns * rows];
    let cell = |v: f64, [low, high]: [f64; 2], cells: usize| {
        let share = if high > low { (v - low) / (high - low) } else { 0.5 };
        ((share * cells as f64) as usize).min(cells - 1)
    };
    for p in points.iter().filter(|p| (y[0]..=y[1]).contains(&p[1])) {
        counts[cell(p[1], y, rows) * columns + cell(p[0], x, columns)] += 1;
    }
    let index: Vec<usize> = (0..counts.len()).filter(|&i| counts[i] > 0).collect();
    Cells {
        x,
        y,
        columns,
        rows,
        count: index.iter().map(|&i| counts[i]).collect(),
        index,
    }
}

/// A histogram of the finite values, with the normal density of the same mean and standard deviation.
#[derive(Serialize)]
pub(crate) struct Histogram {
    /// The bins' edges, one more than there are bins.
    edges: Vec<f64>,
    /// The share of the values in each bin over the bin's width.
    density: Vec<f64>,
    /// The values' mean and standard deviation.
    mean: f64,
    spread: f64,
    /// Values outside the bins.
    pub outside: usize,
}

/// The histogram; `None` for values that do not vary.
pub(crate) fn histogram(values: &[f64]) -> Option<Histogram> {
    let values: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let spread = (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt();
    if !(spread > 0.0 && spread.is_finite()) {
        return None;
    }
    let [low, high] = picture(values.clone());
    let bins = (n.sqrt().ceil() as usize).clamp(8, 60);
    let width = (high - low) / bins as f64;
    let mut counts = vec![0_usize; bins];
    let mut outside = 0;
    for &v in &values {
        match (low..=high).contains(&v) {
            true => counts[(((v - low) / width) as usize).min(bins - 1)] += 1,
            false => outside += 1,
        }
    }
    Some(Histogram {
        edges: (0..=bins).map(|i| round(low + width * i as f64)).collect(),
        density: counts.iter().map(|&c| round(c as f64 / (n * width))).collect(),
        mean: round(mean),
        spread: round(spread),
        outside,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scatter(n: usize) -> Scatter {
        let x: Vec<f64> = (0..n).map(|i| (i * 7919 % 10_007) as f64).collect();
        let y = x.iter().map(|x| (x / 500.0).sin()).collect();
        Scatter { x, y }
    }

    #[test]
    fn few_points_are_all_kept() {
        let points = scatter(500);
        let cloud = cloud(&points).unwrap();
        assert_eq!((cloud.x.len(), cloud.outside, cloud.cells.is_none()), (500, 0, true));
        assert_eq!(cloud.x, points.x);
    }

    #[test]
    fn many_points_are_counted_and_none_is_lost() {
        let n = limits::SCATTER_POINTS + 1;
        let points = scatter(n);
        let cloud = cloud(&points).unwrap();
        let cells = cloud.cells.unwrap();
        assert!(cloud.x.is_empty());
        assert_eq!(cells.count.iter().sum::<u32>() as usize, n);
        // By brute force: the points of one cell.
        let (columns, rows) = (cells.columns, cells.rows);
        let (k, &index) = cells.index.iter().enumerate().nth(cells.index.len() / 2).unwrap();
        let edge = |[low, high]: [f64; 2], i: usize, of: usize| low + (high - low) * i as f64 / of as f64;
        let (column, row) = (index % columns, index / columns);
        let inside = |v: f64, range, i, of| edge(range, i, of) <= v && v < edge(range, i + 1, of);
        let found = (0..n)
            .filter(|&i| inside(points.x[i], cells.x, column, columns) && inside(points.y[i], cells.y, row, rows));
        assert_eq!(found.count() as u32, cells.count[k]);
    }

    #[test]
    fn an_outlier_does_not_flatten_the_picture_but_is_counted() {
        let mut points = scatter(1000);
        points.y[10] = 1e6;
        points.y[20] = f64::NAN;
        let cloud = cloud(&points).unwrap();
        assert_eq!(cloud.outside, 1);
        assert!(cloud.y_range[1] < 3.0 && cloud.x.len() == 999);
        assert!(super::cloud(&Scatter::default()).is_none());
    }

    #[test]
    fn a_histogram_adds_up_to_one() {
        let values: Vec<f64> = (0..1000).map(|i| ((i * 617 % 1000) as f64 / 1000.0).powi(2)).collect();
        let h = histogram(&values).unwrap();
        let total: f64 = h
            .density
            .iter()
            .zip(h.edges.windows(2))
            .map(|(d, e)| d * (e[1] - e[0]))
            .sum();
        assert!((total - 1.0).abs() < 1e-4 && h.outside == 0, "{total}");
        assert!((h.mean - 1.0 / 3.0).abs() < 1e-3);
        assert!(histogram(&[2.0; 9]).is_none() && histogram(&[]).is_none());
    }
}
