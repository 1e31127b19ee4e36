//! Attitude in space: the unit quaternion of R, which maps body coordinates into inertial ones.
//!
//! A quaternion costs four states instead of the nine of a matrix, and one division brings it back to the unit
//! sphere. The functions here are homogeneous in the quaternion, so that the stages of a Runge–Kutta step, which
//! leave the sphere by a little, still turn with the world.

use std::f64::consts::{PI, TAU};

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// (4.44b), Ṙ = R S(ω), for the quaternion: q̇ = ½ q ⊗ (0, ω), with ω in body axes.
pub fn quaternion_rate(q: &Quaternion<f64>, omega: &Vector3<f64>) -> Quaternion<f64> {
    let [x, y, z, w] = [q.i, q.j, q.k, q.w];
    Quaternion::new(
        -0.5 * (x * omega.x + y * omega.y + z * omega.z),
        0.5 * (w * omega.x + y * omega.z - z * omega.y),
        0.5 * (w * omega.y + z * omega.x - x * omega.z),
        0.5 * (w * omega.z + x * omega.y - y * omega.x),
    )
}

/// R v, from body to inertial axes (times the square of the quaternion's norm).
pub fn to_inertial(q: &Quaternion<f64>, v: &Vector3<f64>) -> Vector3<f64> {
    let axis = q.imag();
    v * (q.w * q.w - axis.norm_squared()) + axis * (2.0 * axis.dot(v)) + axis.cross(v) * (2.0 * q.w)
}

/// Rᵀ e_z, the inertial z-axis in body axes (times the square of the quaternion's norm).
pub fn vertical_in_body(q: &Quaternion<f64>) -> Vector3<f64> {
    let [x, y, z, w] = [q.i, q.j, q.k, q.w];
    Vector3::new(2.0 * (x * z - w * y), 2.0 * (y * z + w * x), w * w - x * x - y * y + z * z)
}

/// Attitude from yaw, pitch and roll \[rad\], in this order about the axes z, y and x of the body.
pub fn from_yaw_pitch_roll(yaw: f64, pitch: f64, roll: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_euler_angles(roll, pitch, yaw)
}

/// Yaw, pitch and roll \[rad\] (Z-Y-X).
pub fn yaw_pitch_roll(attitude: &UnitQuaternion<f64>) -> [f64; 3] {
    let (roll, pitch, yaw) = attitude.euler_angles();
    [yaw, pitch, roll]
}

/// The angle in \[−π, π) that differs from this one by whole turns.
pub fn wrap(angle: f64) -> f64 {
    (angle + PI).rem_euclid(TAU) - PI
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_functions_agree_with_the_rotation_matrix(
            yaw in -3.0..3.0f64, pitch in -1.5..1.5f64, roll in -3.0..3.0f64, w in prop::array::uniform3(-2.0..2.0f64),
        ) {
            let q = from_yaw_pitch_roll(yaw, pitch, roll);
            let (r, w) = (q.to_rotation_matrix(), Vector3::from(w));
            prop_assert!((to_inertial(&q, &w) - r * w).norm() < 1e-14);
            prop_assert!((vertical_in_body(&q) - r.transpose() * Vector3::z()).norm() < 1e-14);
            // R S(ω), column by column, against a central difference along q̇.
            let h = 1e-5;
            let rate = quaternion_rate(&q, &w);
            let turned = |h: f64| UnitQuaternion::new_normalize(q.into_inner() + rate * h).to_rotation_matrix();
            let difference = (turned(h).matrix() - turned(-h).matrix()) / (2.0 * h);
            prop_assert!((difference - r.matrix() * w.cross_matrix()).norm() < 1e-8);
        }

        #[test]
        fn angles_come_back(yaw in -3.1..3.1f64, pitch in -1.5..1.5f64, roll in -3.1..3.1f64) {
            let angles = yaw_pitch_roll(&from_yaw_pitch_roll(yaw, pitch, roll));
            prop_assert!((Vector3::from(angles) - Vector3::new(yaw, pitch, roll)).norm() < 1e-12);
        }

        #[test]
        fn wrapping_keeps_the_direction(angle in -50.0..50.0f64) {
            let wrapped = wrap(angle);
            prop_assert!((-PI..PI).contains(&wrapped));
            prop_assert!((wrapped.sin() - angle.sin()).abs() < 1e-13 && (wrapped.cos() - angle.cos()).abs() < 1e-13);
        }
    }

    #[test]
    fn a_yaw_of_a_quarter_turn_points_the_bow_along_y() {
        let q = from_yaw_pitch_roll(PI / 2.0, 0.0, 0.0);
        assert!((to_inertial(&q, &Vector3::x()) - Vector3::y()).norm() < 1e-15);
    }
}
