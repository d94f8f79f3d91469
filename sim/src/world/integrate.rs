//! Fixed-step integration of the vehicles' equations of motion.

use nalgebra::SVector;

/// The classical fourth-order Runge-Kutta step of `step` seconds for ẋ = `derivative`(x).
///
/// Inputs and current are held over the step, as the inner loops hold them, so the right-hand side
/// does not depend on time. Source: any text on numerical integration; local error O(step⁵).
pub fn rk4<const N: usize>(
    state: &SVector<f64, N>,
    step: f64,
    derivative: impl Fn(&SVector<f64, N>) -> SVector<f64, N>,
) -> SVector<f64, N> {
    let k_1 = derivative(state);
    let k_2 = derivative(&(state + k_1 * (0.5 * step)));
    let k_3 = derivative(&(state + k_2 * (0.5 * step)));
    let k_4 = derivative(&(state + k_3 * step));
    state + (k_1 + k_2 * 2.0 + k_3 * 2.0 + k_4) * (step / 6.0)
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector2;

    use super::*;

    /// Error after one period of the harmonic oscillator, whose exact flow is the identity.
    fn error_after_one_period(n_steps: u32) -> f64 {
        let step = std::f64::consts::TAU / f64::from(n_steps);
        let start = Vector2::new(1.0, 0.0);
        let end = (0..n_steps).fold(start, |state, _| rk4(&state, step, |x| Vector2::new(x.y, -x.x)));
        (end - start).norm()
    }

    #[test]
    fn halving_the_step_divides_the_error_by_sixteen() {
        let ratio = error_after_one_period(40) / error_after_one_period(80);
        // 2⁴ up to the next order's share, which is of the size of the step (0.16).
        assert!((ratio - 16.0).abs() < 1.0, "ratio {ratio}");
    }
}
