//! Gaussian sums by a fast Gauss transform in one dimension.
//!
//! The line is cut into boxes one bandwidth wide. With g(z) = exp(-z^2/2), a source at c + u h and a
//! point at d + s h, |u|, |s| <= 1/2, and tau = (d - c)/h,
//! $$ g(\tau + s - u) = \sum_{k,l} \frac{g^{(k+l)}(\tau)}{k!\,l!} s^l (-u)^k , $$
//! so a box of sources is its moments sum (-u)^k / k!, and a box of points a polynomial in s. As
//! |g^(m)(tau)| / m! is below 1.1 / sqrt(m!), terms beyond m = 32 are negligible in double precision.
//! Pairs of boxes with few points are summed directly.

use super::{Kernel, Sorted, Sums};

/// Terms kept in double precision: k + l < TERMS.
pub const TERMS: usize = 33;
/// Boxes on either side that are within reach. A point beyond 9 bandwidths is negligible in comparison with nearer ones, exp(-9^2 / 2) =
/// 3e-18. (If there are no nearer ones, the caller sums directly.)
pub const NEIGHBOURS: i64 = 10;
/// Terms and boxes that are enough for an accuracy of 1e-7.
pub const FEW_TERMS: usize = 17;
pub const FEW_NEIGHBOURS: i64 = 6;
/// With fewer pairs of points than this, the direct sum over two boxes is cheaper.
const DIRECT_PAIRS: usize = 100;

/// The centres of boxes are floats at least as fine as this, in bandwidths.
const FINE: f64 = 1e-3;

/// Sources of one box.
struct Sources<const TERMS: usize> {
    cell: i64,
    first: usize,
    end: usize,
    weight: [f64; TERMS],
    moment: [f64; TERMS],
}

/// Calls `visit(j, sums)` for each of the increasing points `at`, with TERMS terms and NEIGHBOURS boxes on either side.
pub fn transform<const TERMS: usize, const NEIGHBOURS: i64>(
    data: &Sorted,
    h: f64,
    at: &[f64],
    mut visit: impl FnMut(usize, Sums),
) {
    let origin = data.x[0];
    let cell_of = |x: f64| ((x - origin) / h).floor().clamp(-1e15, 1e15) as i64;
    // Centres are floats near the points, so that the differences from them lose no digits even if the origin is far away. If floats near
    // the points are too coarse, the centres are relative to the origin.
    let largest = origin.abs().max(data.x[data.len() - 1].abs());
    let zero = if largest * f64::EPSILON < FINE * h { 0.0 } else { origin };
    let centre_of = |cell: i64| (origin - zero) + (cell as f64 + 0.5) * h;
    let offset_in = |cell: i64, x: f64| ((x - zero) - centre_of(cell)) / h;

    let boxes = collect::<TERMS>(data, cell_of, offset_in);
    let (mut start, mut nearest) = (0, 0);
    while start < at.len() {
        let cell = cell_of(at[start]);
        let end = start + at[start..].partition_point(|&q| cell_of(q) <= cell);
        while nearest < boxes.len() && boxes[nearest].cell < cell - NEIGHBOURS {
            nearest += 1;
        }
        let near = boxes[nearest..].iter().take_while(|b| b.cell <= cell + NEIGHBOURS);
        let (mut weight, mut moment) = ([0.0; TERMS], [0.0; TERMS]);
        let mut direct = Vec::new();
        let mut mass = 0.0;
        for sources in near {
            mass += sources.weight[0];
            if (sources.end - sources.first) * (end - start) < DIRECT_PAIRS {
                direct.push(sources.first..sources.end);
            } else {
                let tau = (centre_of(cell) - centre_of(sources.cell)) / h;
                translate(sources, tau, &mut weight, &mut moment);
            }
        }
        for (j, &q) in at.iter().enumerate().take(end).skip(start) {
            let s = offset_in(cell, q);
            // With v = (X - q)/h: g' = v g and g'' = (v^2 - 1) g in s.
            let ([s0, s1, s2], [t0, t1, _]) = (derivatives(&weight, s), derivatives(&moment, s));
            let mut sums = Sums {
                mass: [mass, mass],
                s: [s0, s1, s2 + s0],
                t: [t0, t1],
                at: 0.0,
            };
            for range in &direct {
                let part = data.sums_over(range.clone(), Kernel::Gaussian, h, q, q, None);
                sums = Sums {
                    mass: sums.mass,
                    ..sums + part
                };
            }
            visit(j, sums);
        }
        start = end;
    }
}

/// The non-empty boxes in order with their moments sum (-u)^k / k! and sum y (-u)^k / k!.
fn collect<const TERMS: usize>(
    data: &Sorted,
    cell_of: impl Fn(f64) -> i64,
    offset_in: impl Fn(i64, f64) -> f64,
) -> Vec<Sources<TERMS>> {
    let mut boxes: Vec<Sources<TERMS>> = Vec::new();
    for i in 0..data.len() {
        let cell = cell_of(data.x[i]);
        if boxes.last().is_none_or(|b| b.cell != cell) {
            boxes.push(Sources {
                cell,
                first: i,
                end: i,
                weight: [0.0; TERMS],
                moment: [0.0; TERMS],
            });
        }
        let Some(sources) = boxes.last_mut() else { continue };
        sources.end = i + 1;
        let u = offset_in(cell, data.x[i]);
        let mut term = data.weight(i);
        for k in 0..TERMS {
            sources.weight[k] += term;
            sources.moment[k] += data.y[i] * term;
            term *= -u / (k + 1) as f64;
        }
    }
    boxes
}

/// Adds a box of sources, `tau` bandwidths below, to the polynomial in s of a box of points.
fn translate<const TERMS: usize>(
    sources: &Sources<TERMS>,
    tau: f64,
    weight: &mut [f64; TERMS],
    moment: &mut [f64; TERMS],
) {
    // g^(m)(tau) = (-1)^m He_m(tau) g(tau), He_{m+1} = tau He_m - m He_{m-1}.
    let mut derivative = [0.0; TERMS];
    derivative[0] = (-0.5 * tau * tau).exp();
    derivative[1] = -tau * derivative[0];
    for m in 1..TERMS - 1 {
        derivative[m + 1] = -tau * derivative[m] - m as f64 * derivative[m - 1];
    }
    let mut factorial = 1.0;
    for l in 0..TERMS {
        let (mut w, mut v) = (0.0, 0.0);
        for k in 0..TERMS - l {
            w += derivative[k + l] * sources.weight[k];
            v += derivative[k + l] * sources.moment[k];
        }
        weight[l] += w / factorial;
        moment[l] += v / factorial;
        factorial *= (l + 1) as f64;
    }
}

/// The polynomial and its first two derivatives.
fn derivatives<const TERMS: usize>(c: &[f64; TERMS], s: f64) -> [f64; 3] {
    let [value, first, half_second] = c
        .iter()
        .rev()
        .fold([0.0; 3], |[p, d, e], &v| [p * s + v, d * s + p, e * s + d]);
    [value, first, 2.0 * half_second]
}

#[cfg(test)]
#[path = "gaussian_tests.rs"]
mod tests;
