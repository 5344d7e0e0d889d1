//! The same steps, implemented independently with NumPy and SciPy: scripts/reference/hammerstein_plain.py
//! printed the values below.

use flexure::identify::RegressionLag;

use super::*;

/// The script's record: a linear congruential generator, a cubic, a recursion with a delay of 3.
fn generated(n: usize) -> Record {
    let mut state: u64 = 12345;
    let mut draw = |levels: u64| {
        state = (1_103_515_245 * state + 12345) % (1 << 31);
        ((state >> 16) % levels) as f64
    };
    let u: Vec<f64> = (0..n).map(|_| (draw(41) - 20.0) / 10.0).collect();
    let e: Vec<f64> = (0..n).map(|_| (draw(1001) - 500.0) / 5000.0).collect();
    let w: Vec<f64> = u.iter().map(|u| u + 0.25 * u.powi(3)).collect();
    let linear = filter(&[0.0, 0.0, 0.0, 1.0, 0.4, 0.1], &[1.0, -1.2, 0.52]);
    let y = linear.simulate(&w).iter().zip(e).map(|(y, e)| y + 7.0 + e).collect();
    record(u, y)
}

#[test]
fn every_step_agrees_with_scipy() {
    let record = generated(600);
    assert_close(&record.column("u").unwrap()[..3], &[0.5, 0.5, -0.2], 1e-15, "u");
    assert_close(
        &record.column("y").unwrap()[3..6],
        &[7.59605, 8.36825, 8.410475],
        1e-12,
        "y",
    );
    let result = PlainHammerstein {
        parameter: Some(0.25),
        order: Some(2),
        delay: Some(3),
        regression_lag: RegressionLag::At(4),
        ..Default::default()
    }
    .identify(&record, "u", "y")
    .unwrap();

    assert!(is_correlated_with(&result, "input"));
    assert_eq!(result.fitted, 450);
    let at = [-2.0, -1.3, 0.0, 1.3, 2.0];
    let phi = [
        -8.670363558378849,
        -0.07533755292278599,
        8.047229966403869,
        13.381096953930932,
        22.73826038493986,
    ];
    assert_eq!(curve(&result).x().len(), 41);
    assert_close(&at.map(|x| curve(&result).value(x)), &phi, 1e-6, "phi");
    let response = [
        0.006878666596586479,
        0.017940358595567488,
        0.010417641919622007,
        0.2452213839635364,
        0.3827300407966316,
        0.3510309153257384,
        0.22725753723313835,
        0.09377867291447617,
        -0.0075293068809772256,
    ];
    assert_eq!(impulse(&result).values.len(), 16);
    // All to the accuracy of the least-squares iteration, through the static gain.
    assert_close(&impulse(&result).values[..9], &response, 1e-7, "k");
    assert!((impulse(&result).limit - 0.07963150524720287).abs() < 1e-7);
    let b = [
        0.0,
        0.0,
        0.0,
        0.24522138425190107,
        0.04036916531307901,
        -0.08517622815469916,
    ];
    assert_close(linear_part(&result).b(), &b, 1e-6, "b");
    assert_close(
        linear_part(&result).a(),
        &[1.0, -1.453034543884833, 0.653448865295114],
        1e-6,
        "a",
    );
    // Before the normalisation, that is over the gain.
    let ratio = numbers(&result, "hankel_singular_values")[0] / 1.985401485506547;
    for (got, want) in numbers(&result, "hankel_singular_values").iter().zip([
        1.985401485506547,
        0.8132019097007231,
        0.10692768215047198,
    ]) {
        assert!((got - ratio * want).abs() < 1e-9 && (ratio - 1.0).abs() < 1e-9);
    }
    let predicted = [0, 100, 450, 599].map(|i| result.predicted[i]);
    let expected = [
        7.1311375333126445,
        6.303408007678038,
        3.8247014949181946,
        9.721126373603449,
    ];
    assert_close(&predicted, &expected, 1e-6, "predicted");
    let measures = result.verdict.measures;
    assert!((measures.fit_percent - 77.89897290102677).abs() < 1e-5);
    assert!((measures.rms - 1.2368442405029951).abs() < 1e-6);
}
