use super::*;

#[test]
fn steps_have_the_covariance_of_the_tuned_correlated_kernel() {
    let (decay, memory) = (0.8_f64, 5);
    let v = steps(decay, memory);
    for i in 0..memory {
        for k in 0..memory {
            let covariance: f64 = v[i.max(k)..].iter().sum();
            assert!((covariance - decay.powi(i.max(k) as i32)).abs() < 1e-12, "{i} {k}");
        }
    }
}

#[test]
fn kernels_and_running_sums_predict_the_same() {
    let memory = Memory { first: 4, second: 3 };
    let u: Vec<f64> = (0..40).map(|i| (0.9 * f64::from(i * i)).sin()).collect();
    let coefficients: Vec<f64> = (0..memory.coefficients()).map(|i| (1.3 * i as f64).cos()).collect();
    let columns = running_sums(memory, &u, 2);
    let fit = Fit {
        memory,
        priors: START,
        evidence: Evidence {
            deviance: 0.0,
            variance: 1.0,
            coefficients: coefficients.clone(),
        },
    };
    let unit = Scale { mean: 0.0, spread: 1.0 };
    let model = fit.model(2, unit, unit);
    for (n, got) in model.simulate(&u).into_iter().enumerate() {
        let want: f64 = columns.iter().zip(&coefficients).map(|(c, w)| w * c[n]).sum();
        assert!((got - want).abs() < 1e-10, "{n}: {got} {want}");
    }
}

#[test]
fn the_evidence_is_that_of_the_gaussian_process() {
    // Brute force: -2 log N(y; 0, s (Phi P Phi' + I)) with the noise variance s profiled.
    let memory = Memory { first: 3, second: 2 };
    let n = 15;
    let u: Vec<f64> = (0..n).map(|i| (1.7 * i as f64).sin()).collect();
    let y: Vec<f64> = (0..n).map(|i| (0.8 * i as f64).cos()).collect();
    let columns = running_sums(memory, &u, 0);
    let d = deviations(memory, START);
    let mut covariance = vec![0.0; n * n];
    for (i, row) in covariance.chunks_exact_mut(n).enumerate() {
        for (j, entry) in row.iter_mut().enumerate() {
            let both = columns.iter().zip(&d).map(|(c, d)| d * d * c[i] * c[j]);
            *entry = both.sum::<f64>() + f64::from(u8::from(i == j));
        }
    }
    let WithDeterminant {
        solution: x,
        log_determinant,
    } = linalg::solve_with_determinant(&covariance, &y).unwrap();
    let quadratic: f64 = x.iter().zip(&y).map(|(x, y)| x * y).sum();
    let want = n as f64 * (quadratic / n as f64).ln() + log_determinant;
    let equations = regression(&y, &columns, 0);
    let Evidence {
        deviance: got,
        variance,
        ..
    } = evidence(memory, START, &equations, n as f64).unwrap();
    assert!((got - want).abs() < 1e-5 * want.abs(), "{got} {want}");
    assert!((variance - quadratic / n as f64).abs() < 1e-5 * variance);
}
