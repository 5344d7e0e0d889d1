//! The linear reference: how far a linear model gets.
//!
//! $$ Y_n = o + \frac{B(z)}{A(z)} z^{-s} U_n + e_n $$
//! by the output error (Ljung 1999, section 4.2), started by the Steiglitz-McBride iteration at orders 1 to 10; poles and
//! numerator coefficients are then added and taken away while Schwarz's criterion falls, and generalised least squares makes the
//! estimate efficient where the error is coloured noise. For a nonlinear system this is the best linear approximation under this input.

use super::super::block::{Monitor, Rational, Stage, restructured};
use crate::error::Result;
use crate::identify::request::{Progress, Request, Structure};
use crate::identify::result::{Detail, Identification, LinearBlock, NamedBlock, StructureName, Value};
use crate::identify::run::{Run, path, start_details};

/// The identification of a linear system by its output error.
///
/// ```
/// use flexure::identify::LINEAR;
/// use flexure::linear::TransferFunction;
/// use flexure::record::Record;
/// use rand::{RngExt, SeedableRng};
///
/// let system = TransferFunction::new(vec![0.0, 1.0, 0.5], vec![1.0, -1.2, 0.6])?;
/// let mut random = rand_pcg::Pcg64::seed_from_u64(1);
/// let u: Vec<f64> = (0..2000).map(|_| random.random_range(-1.0..1.0)).collect();
/// let y: Vec<f64> = system.simulate(&u).iter().map(|y| y + 0.1 * random.random_range(-1.0..1.0)).collect();
/// let result = LINEAR.identify(&Record::new([("u", u), ("y", y)])?, &["u"], "y")?;
/// assert_eq!(result.order, 2);
/// assert!(result.verdict.holds());
/// # Ok::<(), flexure::Error>(())
/// ```
pub const ROW: Structure = Structure {
    name: StructureName {
        key: "linear",
        title: "linear",
    },
    description: "linear dynamics alone",
    inputs: 1..=1,
    options: &[],
    complexity: Some(1),
    identify,
};

fn identify(request: &Request<'_>, progress: &mut Progress<'_>) -> Result<Identification> {
    let samples = request.samples("a linear fit (besides the fresh part)")?;
    let mut monitor = Monitor::new(progress);
    let prepared = request.prepared(&samples, &mut monitor);
    monitor.stage = Stage::Structure;
    let system = match prepared.best() {
        Some(g) => {
            restructured(&prepared.data, g, &mut monitor)
                .efficient(&prepared.data, &mut monitor)
                .system
        }
        None => Rational::pass().with_numerator(vec![0.0]),
    };
    monitor.finished()?;
    let (input, output) = (prepared.inputs[0], prepared.output);
    // One more for the offset.
    let parameters = system.count() + 1;
    let gain = output.spread / input.spread;
    let scaled = system.with_numerator(system.b.iter().map(|b| gain * b).collect());
    let linear = LinearBlock::of(scaled.transfer_function(prepared.delay)?);
    let output_offset = output.mean - scaled.static_gain() * input.mean;
    let path = path(request, vec![NamedBlock::new("linear", "Linear part", linear)]);
    let run = Run::new(&samples, path.model(output_offset), vec![path], parameters)?;
    let start = "the order of the linear approximation with the smallest Schwarz criterion";
    Ok(Identification {
        details: [
            start_details(start, prepared, &run.paths),
            vec![Detail::new("nonlinearity", Value::None).unsaved()],
        ]
        .concat(),
        output_offset,
        ..run.identification(&ROW, request)?
    })
}
