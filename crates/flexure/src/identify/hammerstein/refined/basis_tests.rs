use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};

use super::*;

pub(in super::super) fn sample(n: usize, noise: f64, seed: u64, phi: impl Fn(f64) -> f64) -> (Vec<f64>, Vec<f64>) {
    let mut rng = rand_pcg::Pcg64::seed_from_u64(seed);
    let u: Vec<f64> = (0..n).map(|_| rng.random_range(-3.0..5.0)).collect();
    let z = u
        .iter()
        .map(|u| {
            let e: f64 = StandardNormal.sample(&mut rng);
            phi(*u) + noise * e
        })
        .collect();
    (u, z)
}

/// The basis that is chosen for errors of this variance, without known places.
fn selected(cells: &Cells, u: &[f64], z: &[f64], variance: f64) -> Selection {
    select(
        cells,
        u,
        z,
        &[],
        &Costs {
            variance,
            smooth: false,
        },
    )
}

/// The kinds and places of the breakpoints chosen.
fn chosen(n: usize, noise: f64, seed: u64, phi: impl Fn(f64) -> f64) -> Vec<(f64, u8)> {
    let (u, z) = sample(n, noise, seed, phi);
    let cells = Cells::new(&u);
    let selection = selected(&cells, &u, &z, noise * noise);
    let mut found: Vec<(f64, u8)> = selection
        .terms
        .iter()
        .filter_map(|t| match t {
            Term::TruncatedPower { at, degree } => Some((cells.unit.back(*at), *degree)),
            Term::Power(_) => None,
        })
        .collect();
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    found
}

#[test]
fn kinks_jumps_and_nothing_at_all() {
    for seed in 0..5 {
        assert!(chosen(3000, 0.2, seed, |u| 0.3 * u - 1.0).is_empty());
        let kink = chosen(3000, 0.2, seed, |u| (u - 1.3).max(0.0));
        assert!(
            kink.len() == 1 && kink[0].1 == 1 && (kink[0].0 - 1.3).abs() < 0.1,
            "{kink:?}"
        );
        let jump = chosen(3000, 0.2, seed, |u| (u - 1.3).signum());
        assert!(
            jump.len() == 1 && jump[0].1 == 0 && (jump[0].0 - 1.3).abs() < 0.01,
            "{jump:?}"
        );
    }
}

#[test]
fn a_mirrored_problem_has_the_mirrored_answer() {
    let phi = |u: f64| if u < 0.5 { 0.0 } else { 1.0 + 0.3 * (u - 2.0).max(0.0) };
    let (u, z) = sample(2000, 0.1, 4, phi);
    let mirrored: Vec<f64> = u.iter().map(|u| -u).collect();
    let (a, b) = (Cells::new(&u), Cells::new(&mirrored));
    let (p, q) = (selected(&a, &u, &z, 0.01), selected(&b, &mirrored, &z, 0.01));
    let (f, g) = (p.basis.combined(&p.coefficients), q.basis.combined(&q.coefficients));
    for i in 0..50 {
        let x = -2.9 + 7.8 * f64::from(i) / 50.0;
        assert!(
            (f.value(x) - g.value(-x)).abs() < 0.03,
            "{x}: {} {}",
            f.value(x),
            g.value(-x)
        );
    }
}

#[test]
fn few_levels_are_cells_of_their_own() {
    let u: Vec<f64> = (0..600).map(|i| f64::from(i % 5)).collect();
    let z: Vec<f64> = u.iter().map(|u| u * u - 7.0).collect();
    let cells = Cells::new(&u);
    assert_eq!(cells.levels(10), Some(vec![0.0, 1.0, 2.0, 3.0, 4.0]));
    let selection = selected(&cells, &u, &z, 1e-6);
    let phi = selection.basis.combined(&selection.coefficients);
    for x in [0.0, 2.0, 4.0] {
        assert!((phi.value(x) - (x * x - 7.0)).abs() < 1e-9);
    }
    assert!(Cells::new(&[1.0, 2.0]).levels(1).is_none());
}

/// The levels are 1 apart. So a kink at 0.7, and a kink at 0.5 with a jump, are the same at every sample. The jump is not reported.
#[test]
fn a_kink_between_two_levels_needs_no_jump() {
    let u: Vec<f64> = (0..700).map(|i| f64::from(i % 7) - 3.0).collect();
    let cells = Cells::new(&u);
    let breakpoint = |at: f64, degree: u8| Term::TruncatedPower {
        at: cells.unit.of(at),
        degree,
    };
    // The curve's terms, from those of a kink at 0.5 and a jump.
    let found = |curve: &dyn Fn(f64) -> f64, jump: f64| {
        let z = cells.means(&u.iter().map(|u| curve(*u)).collect::<Vec<_>>());
        let terms = [Term::Power(0), Term::Power(1), breakpoint(0.5, 1), breakpoint(jump, 0)];
        let result = selection(&cells, &z, &terms);
        let phi = result.basis.combined(&result.coefficients);
        assert!(u.iter().all(|u| (phi.value(*u) - curve(*u)).abs() < 1e-9));
        result.terms
    };
    let kink = |u: f64| 2.0 * u - 3.0 * (u - 0.7).max(0.0);
    let terms = found(&kink, 0.5);
    let Term::TruncatedPower { at, degree: 1 } = terms[2] else {
        panic!("{terms:?}");
    };
    assert!((cells.unit.back(at) - 0.7).abs() < 1e-9 && terms.len() == 3);
    // A jump at another level stays; so does one that no kink before the next level can replace.
    let elsewhere = |u: f64| 2.0 * u - 3.0 * (u - 0.5).max(0.0) + f64::from(u > 1.5);
    assert_eq!(found(&elsewhere, 1.5).len(), 4);
    let large = |u: f64| 2.0 * u - 3.0 * (u - 0.5).max(0.0) + 2.0 * f64::from(u > 0.5);
    assert_eq!(found(&large, 0.5).len(), 4);
}
