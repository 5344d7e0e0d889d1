//! The model as a block diagram.

use flexure::identify::Identification;
use flexure::identify::result::{BlockKind, FeedbackBlock, LinearBlock, NamedBlock, Path, StaticBlock};
use flexure::text::{capitalised, number};
use flexure_report::data::{DiagramBlock, Flow, Sketch};

use crate::labels::Labels;

/// The diagram from the inputs to the output.
pub(super) fn diagram(result: &Identification, labels: &Labels) -> Flow {
    let output = Flow::Signal(labels.of(&result.output));
    let offset = (result.output_offset != 0.0).then(|| Flow::Offset(constant(result, labels)));
    let mut parts = match &result.paths[..] {
        [path] => {
            let (front, behind) = (sources(path, labels), blocks(path, &result.output));
            [vec![front], behind].concat()
        }
        // If all branches have the same input, it forks.
        [first, others @ ..] if others.iter().all(|path| path.inputs == first.inputs) => {
            let branches = result.paths.iter().map(|path| joined(blocks(path, &result.output)));
            vec![sources(first, labels), Flow::Parallel(branches.collect())]
        }
        paths => {
            let branch =
                |path: &Path| Flow::Series([vec![sources(path, labels)], blocks(path, &result.output)].concat());
            vec![Flow::Sum(paths.iter().map(branch).collect())]
        }
    };
    parts.extend(offset);
    parts.push(output);
    Flow::Series(parts)
}

/// The constant that is added to the output, with its unit.
fn constant(result: &Identification, labels: &Labels) -> String {
    let value = number(result.output_offset).replace('-', "−");
    match labels.unit(&result.output) {
        "" => value,
        unit => format!("{value} {unit}"),
    }
}

/// The signals that enter a path.
fn sources(path: &Path, labels: &Labels) -> Flow {
    let mut signals: Vec<Flow> = path.inputs.iter().map(|name| Flow::Signal(labels.of(name))).collect();
    match signals.len() {
        1 => signals.remove(0),
        _ => Flow::Together(signals),
    }
}

/// The blocks of a path; blocks that act between the samples form a second, parallel way.
fn blocks(path: &Path, output: &str) -> Vec<Flow> {
    let of = |between: bool| -> Vec<Flow> {
        let own = path.blocks.iter().filter(|block| block.between_samples == between);
        own.map(|block| part(block, path, output)).collect()
    };
    let (at, between) = (of(false), of(true));
    match between.is_empty() {
        true => at,
        false => vec![Flow::Parallel(vec![joined(at), joined(between)])],
    }
}

fn joined(mut parts: Vec<Flow>) -> Flow {
    match parts.len() {
        1 => parts.remove(0),
        _ => Flow::Series(parts),
    }
}

/// A nonlinearity as a small curve.
fn curve(block: &StaticBlock) -> Sketch {
    let (x, y) = (block.curve.x().to_vec(), block.curve.y().to_vec());
    Sketch::Curve { x, y }
}

/// A loop: the linear part on the way forward, the nonlinearity on the way back.
fn feedback(title: &str, block: &FeedbackBlock) -> Flow {
    let model = &block.model;
    let entries = model.input_to_state.iter().zip(&model.nonlinearity_to_state);
    let forward = DiagramBlock {
        title: "Linear part".to_owned(),
        sketch: Sketch::Formula("x' = A x + B u".to_owned()),
        note: format!("order {}", model.order()),
    };
    let back = DiagramBlock {
        title: title.to_owned(),
        sketch: curve(&block.nonlinearity),
        note: String::new(),
    };
    Flow::Feedback {
        forward: Box::new(Flow::Block(forward)),
        back: Box::new(Flow::Block(back)),
        subtracted: entries.map(|(u, w)| u * w).sum::<f64>() < 0.0,
    }
}

/// A block of a path as a part of the diagram.
fn part(block: &NamedBlock, path: &Path, output: &str) -> Flow {
    let (sketch, note) = match &block.kind {
        BlockKind::Static(own) => (curve(own), String::new()),
        BlockKind::Feedback(own) => return feedback(&capitalised(&block.title), own),
        BlockKind::Linear(own) => (fraction(own), order_and_delay(own)),
        BlockKind::Surface(_) => (Sketch::Formula(format!("f({})", path.inputs.join(", "))), String::new()),
        BlockKind::Narx(model) => {
            let arguments = [&[output.to_owned()], &path.inputs[..]].concat();
            let formula = format!("f({})", arguments.join(", "));
            (Sketch::Formula(formula), format!("{} terms", model.terms.len()))
        }
        BlockKind::Volterra(_) => (Sketch::Formula("Σ h₁u + Σ h₂uu".to_owned()), String::new()),
    };
    Flow::Block(DiagramBlock {
        title: capitalised(&block.title),
        sketch,
        note,
    })
}

/// The middle of a linear block: a power of z for a delay, otherwise a fraction.
fn fraction(block: &LinearBlock) -> Sketch {
    let only_delays = block.order() == 0 && block.system.b().len() == block.delay() + 1;
    match (only_delays, block.order()) {
        (true, _) => Sketch::Formula("z⁻ˢ".to_owned()),
        (false, 0) => Sketch::Formula("B(z)".to_owned()),
        _ => Sketch::Fraction("B(z)".to_owned(), "A(z)".to_owned()),
    }
}

fn order_and_delay(block: &LinearBlock) -> String {
    match block.order() {
        0 => format!("delay {}", block.delay()),
        order => format!("order {order}, delay {}", block.delay()),
    }
}

#[cfg(test)]
mod tests {
    use flexure::linear::TransferFunction;

    use super::*;

    fn block(b: &[f64], a: &[f64]) -> LinearBlock {
        LinearBlock {
            system: TransferFunction::new(b.to_vec(), a.to_vec()).unwrap(),
            errors: None,
            impulse: None,
        }
    }

    #[test]
    fn linear_blocks_say_what_they_are() {
        let lag = block(&[0.0, 0.0, 0.5], &[1.0, -0.5]);
        assert_eq!(fraction(&lag), Sketch::Fraction("B(z)".to_owned(), "A(z)".to_owned()));
        assert_eq!(order_and_delay(&lag), "order 1, delay 2");
        let delay = block(&[0.0, 1.0], &[1.0]);
        assert_eq!(
            (fraction(&delay), order_and_delay(&delay)),
            (Sketch::Formula("z⁻ˢ".to_owned()), "delay 1".to_owned())
        );
        let finite = block(&[1.0, 1.0], &[1.0]);
        assert_eq!(
            (fraction(&finite), order_and_delay(&finite)),
            (Sketch::Formula("B(z)".to_owned()), "delay 0".to_owned())
        );
    }

    #[test]
    fn blocks_between_the_samples_are_a_way_beside_the_others() {
        let named = |title: &'static str, between_samples: bool| NamedBlock {
            between_samples,
            ..NamedBlock::new(title, title, BlockKind::Linear(block(&[1.0], &[1.0, -0.5])))
        };
        let path = Path {
            inputs: vec!["u".to_owned()],
            blocks: vec![named("front", false), named("between", true)],
        };
        let found = blocks(&path, "y");
        let [Flow::Parallel(ways)] = &found[..] else {
            panic!("{found:?}")
        };
        let titles = ways.iter().map(|way| match way {
            Flow::Block(block) => block.title.as_str(),
            other => panic!("{other:?}"),
        });
        assert_eq!(titles.collect::<Vec<_>>(), ["Front", "Between"]);
    }
}
