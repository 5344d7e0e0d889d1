//! The block structures, a file each: where its search starts, and which parts it has.

pub(super) mod hammerstein_wiener;
pub(super) mod linear;
pub(super) mod multiple_inputs;
pub(super) mod parallel;
pub(super) mod wiener;
pub(super) mod wiener_hammerstein;

pub use hammerstein_wiener::HammersteinWiener;
pub use linear::Linear;
pub use multiple_inputs::MultipleInputs;
pub use parallel::Parallel;
pub use wiener::Wiener;
pub use wiener_hammerstein::WienerHammerstein;
