//! The corrected estimate against an independent implementation.

use super::*;

/// Kernel, bandwidth, degree, rho, and corrected estimate and standard error at each of `AT`: scripts/reference/bands.py.
type Reference = (Kernel, f64, usize, f64, [[f64; 2]; 4]);

const AT: [f64; 4] = [-0.99, -0.411, 0.0743, 0.9017];

const REFERENCE: [Reference; 9] = [
    (
        Kernel::Epanechnikov,
        0.6,
        0,
        0.7,
        [
            [1.30346368912403, 0.388018913619618],
            [0.644221637214559, 0.10252788553939],
            [0.43809926570035, 0.0795692054368771],
            [1.37357972324441, 0.265835445838623],
        ],
    ),
    (
        Kernel::Epanechnikov,
        0.6,
        1,
        1.0,
        [
            [1.26484574718892, 0.44970612427125],
            [0.661301108833573, 0.117794555176166],
            [0.390357374571756, 0.0896191181212532],
            [1.3798114832492, 0.268936032478881],
        ],
    ),
    (
        Kernel::Epanechnikov,
        0.6,
        1,
        0.7,
        [
            [1.32078867281552, 0.388026817784318],
            [0.644203760288627, 0.102475196139512],
            [0.438085716634938, 0.0795739415806086],
            [1.35542826361982, 0.264270075881656],
        ],
    ),
    (
        Kernel::Triangular,
        0.6,
        0,
        0.7,
        [
            [1.29669599208805, 0.400100266743385],
            [0.65376045084361, 0.104974048116596],
            [0.424962773877616, 0.0795991341681344],
            [1.37624115324526, 0.267254888017736],
        ],
    ),
    (
        Kernel::Triangular,
        0.6,
        1,
        1.0,
        [
            [1.26025861469921, 0.459874996054547],
            [0.668885729125985, 0.12047406027285],
            [0.382784587628627, 0.09095814089662],
            [1.37846950089935, 0.269198081840572],
        ],
    ),
    (
        Kernel::Triangular,
        0.6,
        1,
        0.7,
        [
            [1.30896867606817, 0.399364980784148],
            [0.653757249570899, 0.104934551325509],
            [0.424941179612632, 0.0796072659516124],
            [1.36391293699593, 0.266443791942505],
        ],
    ),
    (
        Kernel::Gaussian,
        0.25,
        0,
        0.7,
        [
            [1.29022068766279, 0.366743168794871],
            [0.645681421410351, 0.100666347817231],
            [0.415693667752238, 0.0773739462123325],
            [1.36174705182905, 0.260406553102812],
        ],
    ),
    (
        Kernel::Gaussian,
        0.25,
        1,
        1.0,
        [
            [1.28024009601207, 0.426815386616697],
            [0.659899866139209, 0.113843360514665],
            [0.396627571104005, 0.0844603377526646],
            [1.38210270033452, 0.269413037097286],
        ],
    ),
    (
        Kernel::Gaussian,
        0.25,
        1,
        0.7,
        [
            [1.29231126739768, 0.376049207459162],
            [0.645622798604348, 0.100906881466001],
            [0.415664722498421, 0.0773847953554734],
            [1.36481599902398, 0.263548513679498],
        ],
    ),
];

#[test]
fn the_corrected_estimate_and_its_variance_are_the_reference_s() {
    let x: Vec<f64> = (0..60).map(|i| f64::from((37 * i) % 101) / 50.0 - 1.0).collect();
    let y: Vec<f64> = (0..60)
        .map(|i| x[i].powi(2) + ((53 * i * i + 7 * i) % 97) as f64 / 97.0)
        .collect();
    let data = Sorted::new(&x, &y, None);
    let variances: Vec<f64> = data.x.iter().map(|x| 0.1 + 0.5 * x * x).collect();
    for (kernel, h, degree, rho, values) in REFERENCE {
        let narrow = Window { data: &data, kernel, h };
        let smoother = Smoother {
            narrow,
            wide: Window { h: h / rho, ..narrow },
            degree: [Degree::Constant, Degree::Linear][degree],
            variances: &variances,
        };
        for (q, [estimate, error]) in AT.into_iter().zip(values) {
            let got = smoother.at(q, &Cells::default()).unwrap();
            let what = format!("{kernel:?} {degree} {rho} {q}");
            assert!(
                (data.mean + got.value - estimate).abs() < 1e-11,
                "{what}: {}",
                data.mean + got.value
            );
            assert!(
                (got.variance.sqrt() - error).abs() < 1e-11,
                "{what}: {}",
                got.variance.sqrt()
            );
        }
    }
}
