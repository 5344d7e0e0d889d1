use super::*;
use crate::selection::test_data::noisy;

/// As in scripts/reference/dpill.py.
fn sample(n: usize, shape: &str) -> (Vec<f64>, Vec<f64>) {
    let (mut abscissas, mut ordinates) = (Vec::new(), Vec::new());
    for i in 0..n {
        let x = ((37 * i) % (2 * n + 1)) as f64 / n as f64 - 1.0;
        let noise = ((53 * i * i + 7 * i) % 97) as f64 / 97.0;
        let m = match shape {
            "wave" => (3.0 * x).sin(),
            "step" if x == 0.0 => 0.0,
            "step" => x.signum(),
            _ => x.abs(),
        };
        abscissas.push(x + 0.2 * x.powi(3));
        ordinates.push(m + noise);
    }
    (abscissas, ordinates)
}

#[test]
fn bandwidths_are_those_of_kernsmooth() {
    for (n, shape, want) in [
        (30, "wave", 0.17025174126238948),
        (61, "bend", 0.11431305706322444),
        (200, "wave", 0.09661054684890454),
        (200, "step", 0.0801618415966802),
        (1000, "bend", 0.06499887366360055),
        (5000, "wave", 0.05330999646478713),
        (5000, "step", 0.01778890754985144),
    ] {
        let (x, y) = sample(n, shape);
        let found = PlugIn::from_data(&Sorted::new(&x, &y, None)).unwrap();
        let got = found.search(Kernel::Gaussian).bandwidth;
        assert!((got / want - 1.0).abs() < 1e-9, "{n} {shape}: {got} {want}");
        assert!(!found.at_edge);
        let wider = found.search(Kernel::Epanechnikov).bandwidth / got;
        assert!((wider - 2.2138).abs() < 1e-4, "{wider}");
    }
}

#[test]
fn the_factors_between_kernels_are_the_known_ones() {
    // Marron and Nolan (1988), table 1.
    for (kernel, want) in [
        (Kernel::Uniform, 1.3510),
        (Kernel::Triangular, 1.8882),
        (Kernel::Epanechnikov, 1.7188),
        (Kernel::Biweight, 2.0362),
        (Kernel::Triweight, 2.3122),
        (Kernel::Gaussian, 0.7764),
    ] {
        assert!(
            (canonical(kernel) - want).abs() < 5e-5,
            "{kernel:?} {}",
            canonical(kernel)
        );
    }
}

#[test]
fn the_noise_and_the_curvature_are_found() {
    let (x, y) = noisy(1, 5000, |x| (2.0 * x).sin());
    let found = PlugIn::from_data(&Sorted::new(&x, &y, None)).unwrap();
    assert!((found.noise / 0.01 - 1.0).abs() < 0.06, "{}", found.noise);
    // The mean of 16 sin^2 2x on [-2, 2] is 8 - sin(8).
    let curvature = 8.0 - 8.0_f64.sin();
    assert!(
        (found.curvature / curvature - 1.0).abs() < 0.15,
        "{} {curvature}",
        found.curvature
    );
    assert!(
        found.description().contains("5 blocks") || found.description().contains("4 blocks"),
        "{}",
        found.description()
    );
}

#[test]
fn equal_weights_are_no_weights_and_unequal_ones_count() {
    let (x, y) = noisy(2, 400, |x| x.sin());
    let of = |w: &[f64]| PlugIn::from_data(&Sorted::new(&x, &y, Some(w))).unwrap();
    let plain = PlugIn::from_data(&Sorted::new(&x, &y, None)).unwrap();
    assert!((of(&[7.0; 400]).gaussian / plain.gaussian - 1.0).abs() < 1e-9);
    // A tenth of the points, much noisier but of small weight, hardly matters.
    let worse: Vec<f64> = y
        .iter()
        .enumerate()
        .map(|(i, y)| if i % 10 == 0 { y + 50.0 * (y - x[i].sin()) } else { *y })
        .collect();
    let w: Vec<f64> = (0..400).map(|i| if i % 10 == 0 { 1.0 / 2601.0 } else { 1.0 }).collect();
    let spoilt = PlugIn::from_data(&Sorted::new(&x, &worse, None)).unwrap();
    let weighted = PlugIn::from_data(&Sorted::new(&x, &worse, Some(&w))).unwrap();
    assert!(
        (weighted.gaussian / plain.gaussian - 1.0).abs() < 0.15,
        "{weighted:?} {plain:?}"
    );
    assert!(spoilt.noise > 50.0 * weighted.noise);
}

#[test]
fn a_system_that_does_not_determine_a_direction_is_still_solved() {
    let solution = solve([[4.0, 2.0], [2.0, 1.0]], [8.0, 4.0]);
    assert_eq!(solution, [2.0, 0.0]);
    let [a, b] = solve([[4.0, 1.0], [1.0, 3.0]], [6.0, 7.0]);
    assert!((a - 1.0).abs() < 1e-14 && (b - 2.0).abs() < 1e-14);
}
