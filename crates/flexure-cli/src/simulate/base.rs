//! The motion of a base that is moved, from a record.

use std::path::Path;

use anyhow::{Result, anyhow, bail};
use flexure::manipulator::chain::BaseMotion;
use flexure::simulation::Sampling;
use flexure::text::{list, shown_path};
use flexure_io::read_record;

use super::chain::columns_or_zeros;

const POSITION: [&str; 3] = ["base_x", "base_y", "base_z"];
const ANGLES: [&str; 3] = ["base_roll", "base_pitch", "base_yaw"];
const QUATERNION: [&str; 4] = ["base_qx", "base_qy", "base_qz", "base_qw"];

/// The motion through the poses of a record, one row an instant of the run; columns that are missing are zero.
pub fn base_motion(path: &Path, sampling: &Sampling) -> Result<BaseMotion> {
    let (file, rows) = (read_record(path)?, sampling.rows());
    let given = |names: &[&str]| names.iter().any(|name| file.record.column(name).is_ok());
    let turned = [given(&ANGLES), given(&QUATERNION)];
    if !given(&POSITION) && turned == [false, false] {
        bail!(
            "{}: no column is the motion of a base; they are called {}, or base_qx to base_qw for the angles",
            shown_path(path),
            list(&[POSITION, ANGLES].concat())
        );
    }
    if turned == [true, true] {
        bail!(
            "{}: the base's orientation is given twice, by angles and by a quaternion; leave out {}, or base_qx to base_qw",
            shown_path(path),
            list(&ANGLES)
        );
    }
    let columns = |names: &[&str]| columns_or_zeros(&file, names, rows);
    let (position, angles, quaternion) = (columns(&POSITION)?, columns(&ANGLES)?, columns(&QUATERNION)?);
    let poses = (0..rows).map(|k| {
        let [x, y, z] = [0, 1, 2].map(|i| position[i][k]);
        let [a, b, c, d] = match turned[1] {
            true => [0, 1, 2, 3].map(|i| quaternion[i][k]),
            false => quaternion_of([0, 1, 2].map(|i| angles[i][k])),
        };
        [x, y, z, a, b, c, d]
    });
    let motion = BaseMotion::new(&poses.collect::<Vec<_>>(), sampling.sample_time());
    motion.map_err(|error| anyhow!("{}: {error}", shown_path(path)))
}

/// The quaternion of turns about the fixed axes x, y and z, one after the other, as URDF's rpy.
fn quaternion_of(angles: [f64; 3]) -> [f64; 4] {
    let [(sr, cr), (sp, cp), (sy, cy)] = angles.map(|angle| (0.5 * angle).sin_cos());
    [
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    ]
}
