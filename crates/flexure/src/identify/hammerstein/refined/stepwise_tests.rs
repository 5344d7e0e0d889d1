use super::super::basis::tests::sample;
use super::*;

#[test]
fn the_gain_of_every_candidate_is_that_of_a_refit() {
    let (u, z) = sample(200, 0.3, 1, |u| (u - 1.0).abs());
    let cells = Cells::new(&u);
    let means = cells.means(&z);
    let start = [
        Term::Power(0),
        Term::Power(1),
        Term::Power(2),
        Term::Power(3),
        Term::TruncatedPower { at: 0.21, degree: 1 },
    ];
    let fit = OrthogonalFit::new(&cells, &means, &start);
    for m in [1, 7, 20, 40, 60] {
        for (k, degree) in DEGREES.into_iter().enumerate() {
            if fit.norm[k][m] <= DEPENDENT * cells.norms[k][m] {
                continue;
            }
            let mut terms = start.to_vec();
            terms.push(Term::TruncatedPower {
                at: cells.lower[m],
                degree,
            });
            // The same by the cells' weighted least squares.
            let rows = |t: &[Term]| -> Vec<f64> {
                let row = |(s, w): (&f64, &f64)| t.iter().map(|t| w.sqrt() * t.value(*s)).collect::<Vec<_>>();
                cells.s.iter().zip(&cells.count).flat_map(row).collect()
            };
            let rhs: Vec<f64> = means.iter().zip(&cells.count).map(|(z, w)| w.sqrt() * z).collect();
            let squares = |t: &[Term]| -> f64 {
                let c = crate::linalg::least_squares(&rows(t), t.len(), &rhs).unwrap();
                let fitted = rows(t);
                let of = |i: usize| {
                    c.iter()
                        .enumerate()
                        .map(|(j, c)| c * fitted[i * t.len() + j])
                        .sum::<f64>()
                };
                rhs.iter().enumerate().map(|(i, r)| (r - of(i)).powi(2)).sum()
            };
            let want = squares(&start) - squares(&terms);
            let got = fit.product[k][m].powi(2) / fit.norm[k][m];
            assert!((got - want).abs() < 1e-6 * (1.0 + want), "{m} {degree}: {got} {want}");
        }
    }
}

#[test]
fn pruning_drops_what_a_refit_would_drop() {
    let (u, z) = sample(600, 0.2, 2, |u| u.max(0.0));
    let cells = Cells::new(&u);
    let means = cells.means(&z);
    let mut terms: Vec<Term> = (0..4).map(Term::Power).collect();
    terms.extend([-0.7, -0.25, 0.2, 0.5].map(|at| Term::TruncatedPower { at, degree: 1 }));
    let kept = prune(
        &OrthogonalFit::new(&cells, &means, &terms),
        &Costs {
            variance: 0.04,
            smooth: false,
        },
    );
    // The kink is at 0, -0.25 in the unit coordinate.
    assert!(
        kept.contains(&Term::TruncatedPower { at: -0.25, degree: 1 }),
        "{kept:?}"
    );
    assert_eq!(kept.len(), 3, "{kept:?}");
}
