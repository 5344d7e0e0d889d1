//! Random polynomials, from which several examples make their linear blocks.

use rand::RngExt;
use rand_pcg::Pcg64;

/// A monic polynomial in z^-1 with random real roots and pairs, of moduli from 0.2 to `largest`.
pub fn polynomial(rng: &mut Pcg64, order: usize, largest: f64) -> Vec<f64> {
    let mut c = vec![1.0];
    while c.len() <= order {
        let radius = rng.random_range(0.2..largest);
        let pair = order + 1 - c.len() >= 2 && rng.random_bool(0.6);
        let factor = if pair {
            let angle: f64 = rng.random_range(0.1..2.6);
            vec![1.0, -2.0 * radius * angle.cos(), radius * radius]
        } else {
            vec![1.0, if rng.random_bool(0.3) { radius } else { -radius }]
        };
        let mut product = vec![0.0; c.len() + factor.len() - 1];
        for (i, p) in c.iter().enumerate() {
            for (j, q) in factor.iter().enumerate() {
                product[i + j] += p * q;
            }
        }
        c = product;
    }
    c
}
