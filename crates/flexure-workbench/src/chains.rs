//! The simulated motion of a chain as a page.

use flexure::Record;
use flexure::manipulator::chain::{Base, Chain, DrivenChain};
use flexure::text::{counted, short};
use flexure_report::data::{Axis, ChainMotion, Fact, MotionPage, Signal};

/// The values of the position of a base that floats or is moved, in a record: its place and its orientation.
const BASE: [&str; 7] = ["base_x", "base_y", "base_z", "base_qx", "base_qy", "base_qz", "base_qw"];

/// The page of the record that a simulation of this chain gave; `name` is what is simulated.
///
/// # Errors
/// Where the record lacks columns of [`chain_columns`](flexure::manipulator::chain::chain_columns), and the report's errors.
pub fn motion_page(
    chain: &DrivenChain,
    record: &Record,
    sample_time: f64,
    name: &str,
    command: Option<String>,
) -> anyhow::Result<String> {
    let chain = chain.chain();
    let moves = record.column(BASE[0]).is_ok();
    let of_base = BASE.iter().filter(|_| moves).map(|name| (*name).to_owned());
    let of_joints = chain.joints().iter().map(|joint| format!("q_{joint}"));
    let positions: Vec<String> = of_base.chain(of_joints).collect();
    let columns = positions.iter().map(|name| record.column(name));
    let columns = columns.collect::<flexure::Result<Vec<&[f64]>>>()?;
    let mut data = chain.data();
    let points = (0..record.len()).map(|i| {
        let q: Vec<f64> = columns.iter().map(|column| column[i]).collect();
        chain.points(&mut data, &q)
    });
    let points = points.collect::<flexure::Result<Vec<_>>>()?;
    let duration = sample_time * (record.len().saturating_sub(1)) as f64;
    let base = match chain.base() {
        Base::Free => "free",
        Base::Fixed if moves => "moving",
        Base::Fixed => "fixed",
    };
    let joints = counted(chain.joints().len(), "joint");
    let facts = motion_facts(chain, &points, duration);
    let signals = signals(chain, record, moves)?;
    let page = MotionPage {
        title: format!("Motion of {name}"),
        subtitle: format!(
            "{joints} on a {base} base, simulated for {} s{}. Limits of the joints are ignored.",
            short(duration),
            if signals.iter().any(|signal| signal.name.starts_with("tau_")) {
                ""
            } else {
                " without torques"
            }
        ),
        facts,
        chain: ChainMotion {
            caption: format!(
                "Lines join the joints; the last ends at its link's centre of mass, whose path is drawn{}.",
                if moves { ", as is that of the base" } else { "" }
            ),
            lines: chain.lines(),
            points,
            free_base: moves,
        },
        signals,
        time: Axis::of_samples(Some(sample_time), 0),
        command,
    };
    Ok(flexure_report::render_motion(&page)?)
}

/// The facts of a motion of this duration, s, from the points of the chain at every sample.
fn motion_facts(chain: &Chain, points: &[Vec<[f64; 3]>], duration: f64) -> Vec<Fact> {
    let mut facts = vec![
        fact("Joints", chain.joints().len().to_string(), "that move"),
        fact("Duration", format!("{} s", short(duration)), "simulated"),
    ];
    if chain.base() == Base::Free {
        let moved = farthest(points.iter().map(|points| points[0]));
        facts.push(fact(
            "Base drift",
            format!("{} m", short(moved)),
            "the largest distance from where it started",
        ));
    }
    let ends = chain.joints().len() + 1..chain.lines().len() + 1;
    let reach = ends.map(|end| farthest(points.iter().map(|points| points[end])));
    facts.push(fact(
        "End motion",
        format!("{} m", short(reach.fold(0.0, f64::max))),
        "the largest distance of the last link's centre of mass from where it started",
    ));
    facts
}

fn fact(name: &str, value: String, note: &str) -> Fact {
    Fact::new(name, value, note.to_owned())
}

/// The largest distance from the first of these points.
fn farthest(mut points: impl Iterator<Item = [f64; 3]>) -> f64 {
    let Some(first) = points.next() else {
        return 0.0;
    };
    let distance = |p: [f64; 3]| (0..3).map(|c| (p[c] - first[c]).powi(2)).sum::<f64>().sqrt();
    points.map(distance).fold(0.0, f64::max)
}

/// The positions of the base and the joints, and the torques.
fn signals(chain: &Chain, record: &Record, moves: bool) -> flexure::Result<Vec<Signal>> {
    let base = BASE[..3].iter().filter(|_| moves).map(|name| ((*name).to_owned(), "m"));
    let joints = || chain.joints().iter().zip(chain.prismatic());
    let positions = joints().map(|(joint, prismatic)| (format!("q_{joint}"), if prismatic { "m" } else { "rad" }));
    let torques = joints().map(|(joint, prismatic)| (format!("tau_{joint}"), if prismatic { "N" } else { "N m" }));
    // Passive joints have no torque, and a torque that never acts shows nothing.
    let acts = |name: &str| record.column(name).is_ok_and(|tau| tau.iter().any(|tau| *tau != 0.0));
    let torques = torques.filter(|(name, _)| acts(name));
    let signal = |(name, unit): (String, &str)| {
        Ok(Signal {
            values: record.column(&name)?.to_vec(),
            name,
            unit: unit.to_owned(),
        })
    };
    base.chain(positions).chain(torques).map(signal).collect()
}
