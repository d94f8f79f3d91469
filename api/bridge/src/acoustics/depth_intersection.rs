//! The point at which a line of sight of unknown length reaches a known depth.

use nalgebra::Vector3;

use crate::{Parsed, reject_if};

pub(super) const NO_DEPTH: &str = "angles without a depth";
const TOO_LEVEL: &str = "angles too level for the depth";

/// Flattest usable line of sight, rad (10°): there, 1 m of depth is 6 m of distance.
const ELEVATION_MIN: f64 = 0.174_532_925_199_432_95;

/// The vector along the unit vector `direction` that reaches `below`, m, positive down.
pub(super) fn intersect(direction: &Vector3<f64>, below: f64) -> Parsed<Vector3<f64>> {
    let is_steep = direction.z.abs() >= ELEVATION_MIN.sin();
    reject_if(!is_steep, TOO_LEVEL)?;
    let length = below / direction.z;
    // Otherwise the line points up and the AUV is deeper, or the reverse: one of the two is wrong.
    (length > 0.0).then(|| direction * length).ok_or(NO_DEPTH)
}

/// Standard deviation of the intersection, m: the greater one along or across the line of sight.
///
/// ```text
/// h = z / tan e      along² = (σ_z / tan e)² + (z σ_e / sin² e)²      across = h σ_e
/// ```
///
/// z is the difference of depths, e the angle below the horizontal, σ_e the angles' deviation, rad.
pub(super) fn intersection_sigma(vector: &Vector3<f64>, sigma_e: f64, sigma_z: f64) -> f64 {
    let (h, z) = (vector.xy().norm(), vector.z.abs());
    let sin_e = z / vector.norm();
    let along = (sigma_z * h / z).hypot(z * sigma_e / (sin_e * sin_e));
    along.max(h * sigma_e)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_standard_deviation_follows_from_small_changes_of_angle_and_depth() {
        let (sigma_e, sigma_z, step) = (0.02_f64, 0.5_f64, 1e-6_f64);
        for elevation in [0.2_f64, 0.6, 1.2] {
            let unit = |e: f64, b: f64| Vector3::new(e.cos() * b.cos(), e.cos() * b.sin(), e.sin());
            let end = |e: f64, b: f64, z: f64| intersect(&unit(e, b), z).expect("is steep").xy();
            let here = end(elevation, 0.0, 20.0);
            let by_angle = (end(elevation + step, 0.0, 20.0) - here).norm() / step * sigma_e;
            let by_depth = (end(elevation, 0.0, 20.0 + step) - here).norm() / step * sigma_z;
            // One rad of the direction's own error across is 1 / cos e rad of bearing.
            let across = (end(elevation, step, 20.0) - here).norm() / step * sigma_e;
            let expected = by_angle.hypot(by_depth).max(across);
            let vector = intersect(&unit(elevation, 0.0), 20.0).expect("is steep");
            let sigma = intersection_sigma(&vector, sigma_e, sigma_z);
            assert!((sigma / expected - 1.0).abs() < 1e-4, "{elevation}: {sigma} and {expected}");
        }
    }

    #[test]
    fn level_lines_and_lines_away_from_the_depth_are_rejected() {
        let (sin, cos) = 0.17_f64.sin_cos();
        assert_eq!(intersect(&Vector3::new(cos, 0.0, sin), 10.0), Err(TOO_LEVEL));
        assert_eq!(intersect(&Vector3::new(0.8, 0.0, -0.6), 10.0), Err(NO_DEPTH));
        assert!(intersect(&Vector3::new(0.8, 0.0, 0.6), 0.0).is_err());
        assert!(intersect(&Vector3::new(f64::NAN, 0.0, f64::NAN), 1.0).is_err());
    }
}
