//! Seeded records of every kind of system.

use flexure::Record;
use flexure::linear::TransferFunction;
use flexure::model::Block;
use flexure::nonlinearity::{Curve, Outside};
use flexure_io::write_record;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::common::Folder;

fn linear(b: &[f64], a: &[f64]) -> Block {
    Block::Linear(TransferFunction::new(b.to_vec(), a.to_vec()).unwrap())
}

fn curve(x: &[f64], y: &[f64]) -> Block {
    Block::Static(Curve::new(x.to_vec(), y.to_vec(), Outside::Linear).unwrap())
}

/// Tabulates a function on [-4, 4].
fn table(f: impl Fn(f64) -> f64) -> Block {
    let x: Vec<f64> = (-200..=200).map(|i| f64::from(i) / 50.0).collect();
    curve(&x, &x.iter().map(|x| f(*x)).collect::<Vec<_>>())
}

/// White, uniform on [-2, 2].
fn white(samples: usize, seed: u64) -> Vec<f64> {
    let mut rng = Pcg64::seed_from_u64(seed);
    (0..samples).map(|_| rng.random_range(-2.0..2.0)).collect()
}

/// White noise through one pole at 0.7.
fn coloured(samples: usize, seed: u64) -> Vec<f64> {
    let mut state = 0.0;
    let pole = |w: f64| {
        state = 0.7 * state + 0.7 * w;
        state
    };
    white(samples, seed).into_iter().map(pole).collect()
}

/// A record of a system with one input `u`, with uniform noise of this half width on `y`.
pub fn write(folder: &Folder, name: &str, system: &Block, u: Vec<f64>, noise: f64) {
    let mut y = system.simulate(&u);
    let mut rng = Pcg64::seed_from_u64(1000 + u.len() as u64);
    y.iter_mut().for_each(|y| *y += rng.random_range(-noise..noise));
    write_record(folder.path(name), &Record::new([("u", u), ("y", y)]).unwrap()).unwrap();
}

pub fn linear_record(folder: &Folder) {
    write(
        folder,
        "r.csv",
        &linear(&[0.0, 1.0, 0.4], &[1.0, -1.2, 0.52]),
        coloured(1200, 1),
        0.05,
    );
}

/// Two experiments, r.csv and s.csv.
pub fn hammerstein(folder: &Folder) {
    folder.known("r.csv", 1500, 2);
    folder.known("s.csv", 1000, 3);
}

/// A Hammerstein record under a coloured input, with every 50th output missing.
pub fn missing(folder: &Folder) {
    folder.known("full.csv", 1500, 4);
    let text = folder.read("full.csv");
    let mut thinned = String::new();
    for (i, line) in text.lines().enumerate() {
        let fields: Vec<&str> = line.split(',').collect();
        let y = if i % 50 == 25 { "" } else { fields[1] };
        thinned += &format!("{},{y}\n", fields[0]);
    }
    folder.write("r.csv", thinned);
}

pub fn wiener(folder: &Folder) {
    let system = Block::Series(vec![linear(&[0.0, 0.5, 0.2], &[1.0, -0.6]), table(f64::tanh)]);
    write(folder, "r.csv", &system, coloured(1500, 5), 0.01);
}

pub fn wiener_hammerstein(folder: &Folder) {
    let system = Block::Series(vec![
        linear(&[1.0], &[1.0, -0.6]),
        curve(&[-1.0, 1.0], &[-1.0, 1.0]),
        table(|x| x.clamp(-1.0, 1.2)),
        linear(&[0.0, 1.0, 0.5], &[1.0, -0.3]),
    ]);
    write(folder, "r.csv", &system, coloured(2000, 6), 0.01);
}

pub fn hammerstein_wiener(folder: &Folder) {
    let system = Block::Series(vec![
        table(|u| u + 0.3 * u * u),
        linear(&[0.0, 0.4], &[1.0, -0.6]),
        table(|x| (0.7 * x).tanh()),
    ]);
    write(folder, "r.csv", &system, white(1500, 7), 0.005);
}

/// A mass on a hardening spring, with a damper.
pub fn feedback(folder: &Folder) {
    let u = white(1500, 12);
    let mut rng = Pcg64::seed_from_u64(13);
    let mut y: Vec<f64> = vec![0.0; u.len()];
    for n in 2..u.len() {
        let spring = 0.3 * y[n - 1] + 0.2 * y[n - 1].powi(3);
        y[n] = 1.5 * y[n - 1] - 0.6 * y[n - 2] + 0.4 * (u[n - 1] - spring);
    }
    y.iter_mut().for_each(|y| *y += rng.random_range(-0.02..0.02));
    write_record(folder.path("r.csv"), &Record::new([("u", u), ("y", y)]).unwrap()).unwrap();
}

pub fn parallel(folder: &Folder) {
    let system = Block::Parallel(vec![
        Block::Series(vec![table(|u| u.powi(3) / 4.0), linear(&[0.0, 0.5], &[1.0, -0.8])]),
        Block::Series(vec![table(f64::abs), linear(&[1.0], &[1.0, 0.4])]),
    ]);
    write(folder, "r.csv", &system, white(1500, 8), 0.01);
}

/// Two inputs, p and q, each with a branch; and `z`, a product of both through one pole.
pub fn two_inputs(folder: &Folder) {
    let (p, q) = (white(1500, 9), white(1500, 10));
    let mut rng = Pcg64::seed_from_u64(11);
    let (mut y, mut z) = (vec![0.0; p.len()], vec![0.0; p.len()]);
    for n in 1..p.len() {
        y[n] = 0.6 * y[n - 1] + p[n].powi(2) + q[n - 1].tanh();
        z[n] = 0.5 * z[n - 1] + p[n] * q[n];
    }
    let mut noise = || rng.random_range(-0.02..0.02);
    y.iter_mut().chain(&mut z).for_each(|value| *value += noise());
    let record = Record::new([("p", p), ("q", q), ("y", y), ("z", z)]).unwrap();
    write_record(folder.path("r.csv"), &record).unwrap();
}

/// Eight periods of 200 samples.
pub fn periodic(folder: &Folder) {
    let period = white(200, 12);
    let u = period.repeat(8);
    write(
        folder,
        "r.csv",
        &Block::Series(vec![table(f64::tanh), linear(&[0.5, 0.2], &[1.0, -0.5])]),
        u,
        0.02,
    );
}

/// Points for regressions: a kink, two columns, weights.
pub fn points(folder: &Folder) {
    let (x, z, w) = (coloured(800, 13), white(800, 14), white(800, 15));
    let mut rng = Pcg64::seed_from_u64(16);
    let y = x
        .iter()
        .zip(&z)
        .map(|(x, z)| x.abs() + 0.5 * z.sin() + rng.random_range(-0.3..0.3))
        .collect();
    let w: Vec<f64> = w.iter().map(|w| w.abs()).collect();
    write_record(
        folder.path("r.csv"),
        &Record::new([("x", x), ("z", z), ("y", y), ("w", w)]).unwrap(),
    )
    .unwrap();
}

const ARM_HEAD: &str = "[arm]\nmodel = \"nonlinear\"\n\
    [[arm.link]]\nmass = 1.5075\nlength = 4.5\ncom = 2.25\ninertia = 2.544\n\
    [[arm.link]]\nmass = 1.5075\nlength = 4.5\ncom = 2.25\ninertia = 2.544\n";
const JOINT: &str = "[[arm.joint]]\nmotor_inertia = 1.0\ncubic = 500.0\nlinear = 500.0\nwindup = 10.0\nwindup_sharpness = 3000.0\n\
    friction = [0.5, 150.0, 50.0, 2.0, 100.0, 0.5]\n";
const ARM_TAIL: &str = "[run]\nduration = 12.0\nsample_time = 0.002\n\
    [excitation]\nkind = \"multisine\"\nseed = 3\namplitude = [40.0, 20.0]\nf_min = 0.05\nf_max = 3.0\n\
    [noise]\nstd = { tau1 = 0.4, tau2 = 0.2, q1 = 1e-5, q2 = 1e-5, qm1 = 1e-5, qm2 = 1e-5 }\n";

/// An arm file and its log.
pub fn arm(folder: &Folder) {
    folder.write("arm.toml", format!("{ARM_HEAD}{JOINT}{JOINT}{ARM_TAIL}"));
    folder.done("simulate arm.toml -o log.csv");
}

/// The log of an arm in which only the shoulder moves.
pub fn shoulder(folder: &Folder) {
    let tail = ARM_TAIL
        .replace("[40.0, 20.0]", "8.0")
        .replace("tau2 = 0.2, ", "")
        .replace("q2 = 1e-5, ", "")
        .replace(", qm2 = 1e-5", "");
    folder.write("arm.toml", format!("{ARM_HEAD}{JOINT}{JOINT}locked = true\n{tail}"));
    folder.done("simulate arm.toml -o log.csv");
}
