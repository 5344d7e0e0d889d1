//! The table of a link that is a beam, in a chain file.

use flexure::manipulator::chain::{Beam, SegmentedBeam, SpringPlacement};
use flexure::manipulator::flexible_arm::{FlexibleBeam, ShapeFunctions};
use serde::Deserialize;

use super::values::{list, triples};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct BeamTable {
    length: f64,
    stiffness: f64,
    density: f64,
    #[serde(default)]
    damping: f64,
    #[serde(default, deserialize_with = "list::<_, _, 3>")]
    along: Option<[f64; 3]>,
    #[serde(default)]
    model: BeamModel,
    count: Option<usize>,
    springs: Option<Springs>,
    #[serde(default, deserialize_with = "triples")]
    axes: Option<Vec<[f64; 3]>>,
    axial_stiffness: Option<f64>,
}

#[derive(Deserialize, Default, Clone, Copy, PartialEq)]
#[serde(rename_all = "lowercase")]
pub(super) enum BeamModel {
    #[default]
    Segments,
    Elements,
    Modes,
}

#[derive(Deserialize, Clone, Copy)]
#[serde(rename_all = "lowercase")]
enum Springs {
    Root,
    Middle,
}

impl BeamTable {
    /// Whether the beam has a floating frame, and is no chain of segments.
    pub fn floats(&self) -> bool {
        self.model != BeamModel::Segments
    }

    /// A key that is given, but means nothing for the model.
    pub fn idle(&self) -> Option<&'static str> {
        let keys = [
            ("springs", self.floats() && self.springs.is_some()),
            ("axes", self.floats() && self.axes.is_some()),
            ("axial_stiffness", !self.floats() && self.axial_stiffness.is_some()),
        ];
        keys.into_iter().find_map(|(key, idle)| idle.then_some(key))
    }

    /// The place of the straight beam's tip in the link's frame, m.
    pub fn tip(&self) -> [f64; 3] {
        let along = self.along.unwrap_or(X);
        let size = along.iter().map(|a| a * a).sum::<f64>().sqrt();
        along.map(|a| a / size * self.length)
    }

    fn beam(&self) -> Beam {
        Beam {
            length: self.length,
            stiffness: self.stiffness,
            density: self.density,
            damping: self.damping,
        }
    }

    /// The beam of link number `link` from 0, whose joint has this axis, as segments.
    pub fn segmented(&self, link: usize, axis: [f64; 3]) -> SegmentedBeam {
        SegmentedBeam {
            link,
            beam: self.beam(),
            along: self.along.unwrap_or(X),
            axes: self.axes.clone().unwrap_or_else(|| vec![axis]),
            segments: self.count.unwrap_or(BANERJEE),
            springs: match self.springs {
                Some(Springs::Middle) => SpringPlacement::Middle,
                _ => SpringPlacement::Root,
            },
        }
    }

    /// The beam of link number `link` from 0 in its floating frame.
    pub fn floating(&self, link: usize) -> FlexibleBeam {
        FlexibleBeam {
            link,
            beam: self.beam(),
            along: self.along.unwrap_or(X),
            axial_stiffness: self.axial_stiffness,
            functions: match (self.model, self.count) {
                (BeamModel::Modes, count) => ShapeFunctions::Modes(count.unwrap_or(MODES)),
                (_, Some(count)) => ShapeFunctions::Elements(count),
                (_, None) => ShapeFunctions::default(),
            },
        }
    }
}

const X: [f64; 3] = [1.0, 0.0, 0.0];
/// The segments of a beam that does not say how many: as in Banerjee's.
const BANERJEE: usize = 3;
/// The modes of one that does not: the first two are exact without a load, and the third bends as a load asks.
const MODES: usize = 3;
