//! Does the error follow from nonlinear functions of the output's past?
//!
//! Where the nonlinearity lies in a loop, as friction does, or has a memory of its own, the error of a chain of blocks depends on the
//! state of the system. That hardly shows in single lags of the input; it does in the output itself. The test is one of added variables.
//! Let $v = A(q) e$ be the error after the autoregression that whitens it. In
//! $$ v_k = c + \sum_{i=1}^{p} \alpha_i e_{k-i} + \sum_{i=0}^{m} \beta_i u_{k-i} + \sum_{i=1}^{m} \gamma_i y_{k-i} + \sum_j \theta_j \varphi_j + w_k $$
//! the functions $\varphi_j$ of $y_{k-1}$ and of $y_{k-1} - y_{k-2}$ explain nothing if the error is autoregressive noise, because they are
//! known before $v_k$ (a nonlinear autoregression against a linear one; Luukkonen, Saikkonen and Terasvirta 1988). They are hinges
//! $\max(0, z - \kappa)$ at quantiles $\kappa$ of their argument.

use super::regression::Regression;
use super::test::{Observed, ResidualTest, TestKind};
use crate::vectors::dot;

/// Lags m of the input and the output whose linear part is not tested. Convention.
const LAGS: usize = 5;
/// Hinges of each argument. Convention.
const HINGES: usize = 6;
/// If other columns determine a column, at most this share of its length remains, by rounding.
const DETERMINED: f64 = 1e-7;

/// The test of an error, with the input and the measured output that belong to it.
pub(super) fn output_functions(error: &Regression, u: &[f64], y: &[f64], level: f64) -> ResidualTest {
    let (e, v) = (error.original(), error.whitened());
    let order = error.order();
    let first = order.max(LAGS) + 1;
    let n = e.len().saturating_sub(first);
    let lagged = |signal: &[f64], lag: usize| signal[first - lag..first - lag + n].to_vec();
    let own = (1..=order).map(|i| lagged(e, i));
    let inputs = (0..=LAGS).map(|i| lagged(u, i));
    let outputs = (1..=LAGS).map(|i| lagged(y, i));
    let linear = [vec![1.0; n]].into_iter().chain(own).chain(inputs).chain(outputs);
    let change: Vec<f64> = lagged(y, 1).iter().zip(lagged(y, 2)).map(|(a, b)| a - b).collect();
    let functions = hinges(&lagged(y, 1)).chain(hinges(&change)).collect::<Vec<_>>();

    let mut basis = Basis::default();
    linear.for_each(|column| basis.add(column));
    let taken = basis.columns.len();
    functions.into_iter().for_each(|column| basis.add(column));
    let [linear, functions] = [&basis.columns[..taken], &basis.columns[taken..]];

    let mut left = v[first..].to_vec();
    linear.iter().for_each(|q| subtract(&mut left, q));
    let all: f64 = left.iter().map(|v| v * v).sum();
    let mut follows = vec![0.0; n];
    for q in functions {
        let slope = dot(q, &left);
        follows.iter_mut().zip(q).for_each(|(f, q)| *f += slope * q);
    }
    let explained: f64 = follows.iter().map(|f| f * f).sum();
    let terms = functions.len();
    let rest = n.saturating_sub(basis.columns.len()).max(1) as f64;
    let unexplained = (all - explained).max(f64::EPSILON * all);
    let observed = Observed {
        statistic: if all > 0.0 { rest * explained / unexplained } else { 0.0 },
        terms: terms.max(1),
        explained: error.share_of_original(&follows),
    };
    ResidualTest::fisher(
        TestKind::OutputFunctionIndependence,
        observed,
        rest,
        Default::default(),
        level,
    )
}

/// Hinges at evenly spaced quantiles.
fn hinges(z: &[f64]) -> impl Iterator<Item = Vec<f64>> {
    let mut sorted = z.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let quantile = move |k: usize| sorted.get(k * sorted.len() / (HINGES + 1)).copied().unwrap_or(0.0);
    (1..=HINGES).map(move |k| z.iter().map(|z| (z - quantile(k)).max(0.0)).collect())
}

/// Orthonormal columns (modified Gram-Schmidt, twice because of rounding).
#[derive(Default)]
struct Basis {
    columns: Vec<Vec<f64>>,
}

impl Basis {
    /// Adds a column, unless the present columns determine it.
    fn add(&mut self, mut column: Vec<f64>) {
        let length = dot(&column, &column).sqrt();
        for _ in 0..2 {
            self.columns.iter().for_each(|q| subtract(&mut column, q));
        }
        let left = dot(&column, &column).sqrt();
        if left > DETERMINED * length {
            column.iter_mut().for_each(|x| *x /= left);
            self.columns.push(column);
        }
    }
}

/// Subtracts from a column its part along a unit column.
fn subtract(column: &mut [f64], unit: &[f64]) {
    let part = dot(column, unit);
    column.iter_mut().zip(unit).for_each(|(x, q)| *x -= part * q);
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    use super::*;
    use crate::linear::TransferFunction;
    use crate::signal::gaussian;

    fn filtered(b: &[f64], a: &[f64], v: &[f64]) -> Vec<f64> {
        TransferFunction::new(b.to_vec(), a.to_vec()).unwrap().simulate(v)
    }

    fn test(e: &[f64], u: &[f64], y: &[f64]) -> ResidualTest {
        output_functions(&Regression::new(e), u, y, 0.01)
    }

    /// The system is a saturation, and the error is the noise itself, white or coloured: the test keeps its level.
    #[test]
    fn noise_of_any_colour_passes() {
        for a in [[1.0, 0.0], [1.0, -0.95]] {
            let rejected = |seed: &u64| {
                let n = 800;
                let u = gaussian(n, *seed);
                let bent: Vec<f64> = u.iter().map(|u| u.clamp(-0.7, 1.0)).collect();
                let y = filtered(&[0.0, 1.0, 0.5], &[1.0, -1.5, 0.7], &bent);
                let e = filtered(&[0.2], &a, &gaussian(n, 1000 + seed));
                let y: Vec<f64> = y.iter().zip(&e).map(|(y, e)| y + e).collect();
                !test(&e, &u, &y).passed()
            };
            // A binomial variable of 300 runs at 1 % exceeds 9 with a probability of 0.1 %.
            let count = (0..300_u64).filter(rejected).count();
            assert!(count <= 9, "{count} of 300");
        }
    }

    /// A link with friction: the error of a linear model depends on the velocity.
    #[test]
    fn friction_in_a_loop_is_seen() {
        let n = 1500;
        let mut rng = Pcg64::seed_from_u64(1);
        let torque = filtered(
            &[0.3],
            &[1.0, -0.95],
            &(0..n).map(|_| rng.random_range(-1.0..1.0)).collect::<Vec<f64>>(),
        );
        let run = |friction: &dyn Fn(f64) -> f64| -> Vec<f64> {
            let step = |v: &mut f64, tau: &f64| {
                *v += 0.02 * (tau - friction(*v));
                Some(*v)
            };
            torque.iter().scan(0.0, step).collect()
        };
        let y = run(&|v| 0.2 * (30.0 * v).tanh() + 0.5 * v);
        // A linear model: its friction grows with the velocity throughout.
        let p = run(&|v| 1.3 * v);
        let e: Vec<f64> = y
            .iter()
            .zip(&p)
            .zip(gaussian(n, 2))
            .map(|((y, p), w)| y - p + 1e-4 * w)
            .collect();
        let found = test(&e, &torque, &y);
        assert!(found.p_value < 1e-6 && found.effect > 0.0, "{found:?}");
        let linear = test(
            &gaussian(n, 3).iter().map(|w| 1e-3 * w).collect::<Vec<_>>(),
            &torque,
            &p,
        );
        assert!(linear.passed(), "{linear:?}");
    }

    /// The statistic is that of two least-squares fits, summed directly.
    #[test]
    fn the_statistic_compares_two_regressions() {
        let (u, y, e) = (gaussian(200, 4), gaussian(200, 5), gaussian(200, 6));
        let found = test(&e, &u, &y);
        let error = Regression::new(&e);
        assert_eq!(error.order(), 0);
        let hinge = |z: &dyn Fn(usize) -> f64| -> Vec<Vec<f64>> {
            let z: Vec<f64> = (6..200).map(z).collect();
            hinges(&z).collect()
        };
        let functions = [hinge(&|k| y[k - 1]), hinge(&|k| y[k - 1] - y[k - 2])].concat();
        let squares = |functions: &[Vec<f64>]| -> f64 {
            let rows: Vec<Vec<f64>> = (6..200)
                .map(|k| {
                    let linear = [1.0]
                        .into_iter()
                        .chain((0..=5).map(|i| u[k - i]))
                        .chain((1..=5).map(|i| y[k - i]));
                    linear.chain(functions.iter().map(|f| f[k - 6])).collect()
                })
                .collect();
            let columns = rows[0].len();
            let slopes = crate::linalg::least_squares(&rows.concat(), columns, &e[6..]).unwrap();
            let fitted = rows
                .iter()
                .map(|row| row.iter().zip(&slopes).map(|(x, b)| x * b).sum::<f64>());
            fitted.zip(&e[6..]).map(|(f, e)| (e - f).powi(2)).sum()
        };
        let (without, with) = (squares(&[]), squares(&functions));
        let direct = (194.0 - 24.0) * (without - with) / with;
        assert_eq!(found.degrees, 12);
        assert!(
            (found.statistic - direct).abs() < 1e-8 * direct,
            "{} {direct}",
            found.statistic
        );
    }

    #[test]
    fn columns_that_say_nothing_are_left_out() {
        let e = gaussian(100, 7);
        let constant = [1.0; 100];
        let found = test(&e, &constant, &constant);
        assert!(found.passed() && found.statistic == 0.0);
        assert!(test(&constant, &e, &e).passed());
    }
}
