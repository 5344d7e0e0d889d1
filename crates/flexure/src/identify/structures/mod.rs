//! The block structures, a file each: where its search starts, and which parts it has.

mod hammerstein_wiener;
pub(super) mod linear;
mod multiple_inputs;
mod parallel;
pub(super) mod wiener;
pub(super) mod wiener_hammerstein;

pub use hammerstein_wiener::{HammersteinWiener, HammersteinWienerIdentification};
pub use linear::Linear;
pub use multiple_inputs::{InputBranch, MultipleInputs, MultipleInputsIdentification, MultipleInputsModel};
pub use parallel::{Parallel, ParallelBranch, ParallelIdentification};
pub use wiener::{Wiener, WienerIdentification, WienerStart};
pub use wiener_hammerstein::{WienerHammerstein, WienerHammersteinIdentification};
