//! The coefficients of the Dormand-Prince method of order 8 with the embedded error estimators of
//! orders 5 and 3 (Hairer, Norsett & Wanner, Solving Ordinary Differential Equations I, II.5 and II.10).
//!
//! `C` are the nodes, `A` the non-zero stage weights, `B` the weights of the solution, `E3` and `E5`
//! those of the two error estimators; indices count from 1 as in the book.

pub(super) const C2: f64 = 0.05260015195876773;
pub(super) const C3: f64 = 0.0789002279381516;
pub(super) const C4: f64 = 0.1183503419072274;
pub(super) const C5: f64 = 0.2816496580927726;
pub(super) const C6: f64 = 0.3333333333333333;
pub(super) const C7: f64 = 0.25;
pub(super) const C8: f64 = 0.3076923076923077;
pub(super) const C9: f64 = 0.6512820512820513;
pub(super) const C10: f64 = 0.6;
pub(super) const C11: f64 = 0.8571428571428571;
pub(super) const C12: f64 = 1.0;
pub(super) const A2_1: f64 = 0.05260015195876773;
pub(super) const A3_1: f64 = 0.0197250569845379;
pub(super) const A3_2: f64 = 0.0591751709536137;
pub(super) const A4_1: f64 = 0.02958758547680685;
pub(super) const A4_3: f64 = 0.08876275643042054;
pub(super) const A5_1: f64 = 0.2413651341592667;
pub(super) const A5_3: f64 = -0.8845494793282861;
pub(super) const A5_4: f64 = 0.924834003261792;
pub(super) const A6_1: f64 = 0.037037037037037035;
pub(super) const A6_4: f64 = 0.17082860872947386;
pub(super) const A6_5: f64 = 0.12546768756682242;
pub(super) const A7_1: f64 = 0.037109375;
pub(super) const A7_4: f64 = 0.17025221101954405;
pub(super) const A7_5: f64 = 0.06021653898045596;
pub(super) const A7_6: f64 = -0.017578125;
pub(super) const A8_1: f64 = 0.03709200011850479;
pub(super) const A8_4: f64 = 0.17038392571223998;
pub(super) const A8_5: f64 = 0.10726203044637328;
pub(super) const A8_6: f64 = -0.015319437748624402;
pub(super) const A8_7: f64 = 0.008273789163814023;
pub(super) const A9_1: f64 = 0.6241109587160757;
pub(super) const A9_4: f64 = -3.3608926294469414;
pub(super) const A9_5: f64 = -0.868219346841726;
pub(super) const A9_6: f64 = 27.59209969944671;
pub(super) const A9_7: f64 = 20.154067550477894;
pub(super) const A9_8: f64 = -43.48988418106996;
pub(super) const A10_1: f64 = 0.47766253643826434;
pub(super) const A10_4: f64 = -2.4881146199716677;
pub(super) const A10_5: f64 = -0.590290826836843;
pub(super) const A10_6: f64 = 21.230051448181193;
pub(super) const A10_7: f64 = 15.279233632882423;
pub(super) const A10_8: f64 = -33.28821096898486;
pub(super) const A10_9: f64 = -0.020331201708508627;
pub(super) const A11_1: f64 = -0.9371424300859873;
pub(super) const A11_4: f64 = 5.186372428844064;
pub(super) const A11_5: f64 = 1.0914373489967295;
pub(super) const A11_6: f64 = -8.149787010746927;
pub(super) const A11_7: f64 = -18.52006565999696;
pub(super) const A11_8: f64 = 22.739487099350505;
pub(super) const A11_9: f64 = 2.4936055526796523;
pub(super) const A11_10: f64 = -3.0467644718982196;
pub(super) const A12_1: f64 = 2.273310147516538;
pub(super) const A12_4: f64 = -10.53449546673725;
pub(super) const A12_5: f64 = -2.0008720582248625;
pub(super) const A12_6: f64 = -17.9589318631188;
pub(super) const A12_7: f64 = 27.94888452941996;
pub(super) const A12_8: f64 = -2.8589982771350235;
pub(super) const A12_9: f64 = -8.87285693353063;
pub(super) const A12_10: f64 = 12.360567175794303;
pub(super) const A12_11: f64 = 0.6433927460157636;
pub(super) const B1: f64 = 0.054293734116568765;
pub(super) const B6: f64 = 4.450312892752409;
pub(super) const B7: f64 = 1.8915178993145003;
pub(super) const B8: f64 = -5.801203960010585;
pub(super) const B9: f64 = 0.3111643669578199;
pub(super) const B10: f64 = -0.1521609496625161;
pub(super) const B11: f64 = 0.20136540080403034;
pub(super) const B12: f64 = 0.04471061572777259;
pub(super) const E3_1: f64 = -0.18980075407240762;
pub(super) const E3_6: f64 = 4.450312892752409;
pub(super) const E3_7: f64 = 1.8915178993145003;
pub(super) const E3_8: f64 = -5.801203960010585;
pub(super) const E3_9: f64 = -0.4226823213237919;
pub(super) const E3_10: f64 = -0.1521609496625161;
pub(super) const E3_11: f64 = 0.20136540080403034;
pub(super) const E3_12: f64 = 0.02265179219836082;
pub(super) const E5_1: f64 = 0.01312004499419488;
pub(super) const E5_6: f64 = -1.2251564463762044;
pub(super) const E5_7: f64 = -0.4957589496572502;
pub(super) const E5_8: f64 = 1.6643771824549864;
pub(super) const E5_9: f64 = -0.35032884874997366;
pub(super) const E5_10: f64 = 0.3341791187130175;
pub(super) const E5_11: f64 = 0.08192320648511571;
pub(super) const E5_12: f64 = -0.022355307863886294;

/// For each of the 12 stages, the weights of the slopes before it. The first stage has none.
#[rustfmt::skip]
pub const STAGES: [[f64; 11]; 12] = [
    [0.0; 11],
    [A2_1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [A3_1, A3_2, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [A4_1, 0.0, A4_3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [A5_1, 0.0, A5_3, A5_4, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [A6_1, 0.0, 0.0, A6_4, A6_5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [A7_1, 0.0, 0.0, A7_4, A7_5, A7_6, 0.0, 0.0, 0.0, 0.0, 0.0],
    [A8_1, 0.0, 0.0, A8_4, A8_5, A8_6, A8_7, 0.0, 0.0, 0.0, 0.0],
    [A9_1, 0.0, 0.0, A9_4, A9_5, A9_6, A9_7, A9_8, 0.0, 0.0, 0.0],
    [A10_1, 0.0, 0.0, A10_4, A10_5, A10_6, A10_7, A10_8, A10_9, 0.0, 0.0],
    [A11_1, 0.0, 0.0, A11_4, A11_5, A11_6, A11_7, A11_8, A11_9, A11_10, 0.0],
    [A12_1, 0.0, 0.0, A12_4, A12_5, A12_6, A12_7, A12_8, A12_9, A12_10, A12_11],
];
/// The weights of the slopes in a step.
pub const SOLUTION: [f64; 12] = [B1, 0.0, 0.0, 0.0, 0.0, B6, B7, B8, B9, B10, B11, B12];
