//! The block structures, one file each, with the starts of its search and its parts; and the list of all structures.

mod delayed_static;
mod hammerstein_wiener;
mod limits;
mod linear;
mod multiple_inputs;
mod parallel;
#[cfg(test)]
mod tests;
mod wiener;
mod wiener_hammerstein;

use super::auto::AUTO;
use super::feedback::FEEDBACK;
use super::hammerstein::HAMMERSTEIN;
use super::reference::{NARX, VOLTERRA};
use super::request::Structure;
use super::surface::JOINT_INPUTS;

pub use hammerstein_wiener::ROW as HAMMERSTEIN_WIENER;
pub use linear::ROW as LINEAR;
pub use multiple_inputs::ROW as MULTIPLE_INPUTS;
pub use parallel::ROW as PARALLEL;
pub use wiener::ROW as WIENER;
pub use wiener_hammerstein::ROW as WIENER_HAMMERSTEIN;

/// All structures, in the order of lists.
pub(super) static STRUCTURES: &[Structure] = &[
    AUTO,
    LINEAR,
    HAMMERSTEIN,
    WIENER,
    WIENER_HAMMERSTEIN,
    HAMMERSTEIN_WIENER,
    FEEDBACK,
    PARALLEL,
    MULTIPLE_INPUTS,
    JOINT_INPUTS,
    delayed_static::ROW,
    NARX,
    VOLTERRA,
];
