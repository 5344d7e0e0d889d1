//! Inputs that are not white, which the paper excludes: what is done about them helps.

use flexure::identify::{PlainHammerstein, Warning};
use flexure::linear::TransferFunction;
use flexure::systems::{KnownNonlinearity, known_linear_parts, relative_error_after_alignment};
use flexure::{Record, signal};

use super::curve;

/// A dead zone and the damped linear part behind a delay of 2, driven by white noise through 1 / (1 - 0.8 z^-1).
fn coloured_record(n: usize, seed: u64) -> Record {
    let [linear, _] = known_linear_parts();
    let delayed = [&[0.0, 0.0], linear.b()].concat();
    let linear = TransferFunction::new(delayed, linear.a().to_vec()).unwrap();
    let filter = TransferFunction::new(vec![0.8], vec![1.0, -0.8]).unwrap();
    let u = filter.simulate(&signal::white_gaussian(n, 1.0, seed).unwrap());
    let w: Vec<f64> = u.iter().map(|&u| KnownNonlinearity::DeadZone.value(u)).collect();
    let noise = signal::white_gaussian(n, 0.3, seed + 1000).unwrap();
    let y = linear.simulate(&w).iter().zip(noise).map(|(y, e)| y + e).collect();
    Record::new([("u", u), ("y", y)]).unwrap()
}

#[test]
fn a_coloured_input_is_named_and_its_colour_taken_out() {
    for seed in 1..=5 {
        let record = coloured_record(8000, seed);
        let result = PlainHammerstein::default().identify(&record, "u", "y").unwrap();
        assert!(
            result
                .warnings
                .iter()
                .any(|w| matches!(w, Warning::InputNotWhite { lag: 1, .. })),
            "{:?}",
            result.warnings
        );
        let grid: Vec<f64> = (0..=100).map(|i| -2.5 + 0.05 * f64::from(i)).collect();
        let truth: Vec<f64> = grid.iter().map(|&x| KnownNonlinearity::DeadZone.value(x)).collect();
        let estimate: Vec<f64> = grid.iter().map(|&x| curve(&result).value(x)).collect();
        let error = relative_error_after_alignment(&truth, &estimate);
        let fit = result.verdict.measures.fit_percent;
        println!(
            "seed {seed}: error {error:.4}, fit {fit:.2} %, delay {}, order {}",
            result.delay, result.order
        );
        // Measured without it: error 0.09 to 0.10, fit 9 to 15 %, delay 0.
        assert!(error < 0.05, "seed {seed}: {error}");
        assert_eq!(result.delay, 2);
        assert!(fit > 90.0, "seed {seed}: {fit}");
    }
}

/// As above with a pole at 0.9 and a delay of 350.
fn far_record() -> Record {
    let filter = TransferFunction::new(vec![0.5], vec![1.0, -0.9]).unwrap();
    let u = filter.simulate(&signal::white_gaussian(6000, 1.0, 5).unwrap());
    let linear = TransferFunction::new([vec![0.0; 350], vec![1.0, 0.4]].concat(), vec![1.0, -0.7]).unwrap();
    let y = linear.simulate(&u.iter().map(|u| u.tanh()).collect::<Vec<_>>());
    let noise = signal::white_gaussian(6000, 0.1, 6).unwrap();
    Record::new([("u", u), ("y", y.iter().zip(noise).map(|(y, e)| y + e).collect())]).unwrap()
}

#[test]
fn a_delay_beyond_the_lags_of_one_deconvolution_is_reached() {
    for delay in [None, Some(350)] {
        let method = PlainHammerstein {
            delay,
            ..PlainHammerstein::default()
        };
        let result = method.identify(&far_record(), "u", "y").unwrap();
        assert_eq!(result.delay, 350);
        let fit = result.verdict.measures.fit_percent;
        assert!(fit > 90.0, "given {delay:?}: {fit}");
    }
}

#[test]
fn colour_can_be_ignored() {
    let method = PlainHammerstein {
        ignore_colour: true,
        ..PlainHammerstein::default()
    };
    let record = coloured_record(8000, 1);
    let fit = |method: PlainHammerstein| method.identify(&record, "u", "y").unwrap().verdict.measures.fit_percent;
    assert!(fit(method) < 0.5 * fit(PlainHammerstein::default()));
}
