//! A steady turn through the newest fixes: a spiral, or a vehicle that circles.

use nalgebra::{Complex, Vector2};

use crate::{
    facts::{
        angle::Course,
        evidence::{AuvState, Report},
        ranges::AUV_SPEED_MAX,
    },
    tuned::EstimateNumbers,
};

/// Fewest fixes of a turn, for five numbers.
const FIXES_MIN: usize = 6;

/// Longest time that counts, s: the rate of turn of a spiral changes.
const TIME_MAX: f64 = 300.0;

/// Rates of turn that are compared, rad/s, to either side: 0.005 to 0.06, a tenth apart.
const RATES: (i32, f64, f64) = (26, 0.005, 1.1);

/// A circle at constant speed through the newest fixes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SteadyTurn {
    /// Velocity at the newest fix over ground (north, east), m/s.
    velocity: Vector2<f64>,
    rate: f64,
    /// Time for which it has lasted, s.
    lasted: f64,
}

/// Sums over fixes z at times t, with the weights w: of w, w b, w z, w |b|², w b̄ z, w |z|².
#[derive(Clone, Copy, Default)]
struct Sums {
    one: f64,
    b: Complex<f64>,
    z: Complex<f64>,
    bb: f64,
    bz: Complex<f64>,
    zz: f64,
}

/// The turn of the fixes in a window, or their line: rate, position, velocity, and misfit.
type Fitted = (f64, (Complex<f64>, Complex<f64>, f64));

impl Sums {
    /// Adds a fix at an arc with the chord b per unit of velocity.
    fn and(mut self, b: Complex<f64>, z: Complex<f64>, sigma: f64) -> Self {
        let w = sigma.powi(-2);
        self.one += w;
        self.b += b * w;
        self.z += z * w;
        self.bb += w * b.norm_sqr();
        self.bz += b.conj() * z * w;
        self.zz += w * z.norm_sqr();
        self
    }

    /// The motion of least squares: position, velocity, and the sum of squared residuals.
    fn fit(&self) -> (Complex<f64>, Complex<f64>, f64) {
        let spread = (self.one * self.bb - self.b.norm_sqr()).max(f64::MIN_POSITIVE);
        let velocity = (self.bz * self.one - self.b.conj() * self.z) / spread;
        let position = (self.z - self.b * velocity) / self.one;
        let explained = position.conj() * self.z + velocity.conj() * self.bz;
        (position, velocity, self.zz - explained.re)
    }
}

impl SteadyTurn {
    /// The `state` in this turn. Its place is filtered from the newest fixes, its course would lag.
    pub(crate) fn of(&self, state: &AuvState) -> AuvState {
        AuvState {
            course_rad: Course::of(&self.velocity).radians(),
            speed_mps: self.velocity.norm().min(AUV_SPEED_MAX),
            turn_rate_radps: self.rate,
            ..*state
        }
    }

    /// Its length so far, m: it ends as soon as not.
    pub(crate) fn length(&self) -> f64 {
        self.velocity.norm() * self.lasted
    }

    /// The longest steady turn that ends at the newest of the `fixes`. None if that has a course or a
    /// line fits.
    ///
    /// ```text
    /// z(t) = p + v b(t)     b = (exp(i ω t) − 1) / (i ω)
    /// ```
    /// is linear in the position p and the velocity v (north + i east) for each rate of turn ω.
    pub(crate) fn newest(fixes: &[(usize, Report)], tuned: &EstimateNumbers) -> Option<Self> {
        let (_, last) = fixes.last().filter(|(_, fix)| fix.ground_track().is_none())?;
        let newest: Vec<_> = fixes
            .iter()
            .rev()
            .map(|(_, fix)| {
                let [north, east] = (fix.position() - last.position()).into();
                (fix.t_s - last.t_s, Complex::new(north, east), fix.sigma_m)
            })
            .take_while(|(time, ..)| -TIME_MAX <= *time)
            .collect();
        // Fits to growing numbers of the newest fixes.
        let fits = |rate: f64| {
            let chord = move |time: f64| match rate {
                0.0 => Complex::new(time, 0.0),
                _ => (Complex::cis(rate * time) - 1.0) / Complex::new(0.0, rate),
            };
            let sums = newest.iter().scan(Sums::default(), move |sums, (time, z, sigma)| {
                *sums = sums.and(chord(*time), *z, *sigma);
                Some(*sums)
            });
            sums.map(move |sums| (rate, sums.fit()))
        };
        let straight: Vec<_> = fits(0.0).collect();
        let bends = |(_, (.., misfit)): &Fitted| tuned.steady_turn_gain <= *misfit;
        if -tuned.steady_turn_time < newest[newest.len() - 1].0 || !straight.iter().any(bends) {
            return None;
        }
        let mut turning = straight.clone();
        let (n, least, ratio) = RATES;
        for rate in (0..n).flat_map(|k| [1.0, -1.0].map(|side| side * least * ratio.powi(k))) {
            for (best, other) in turning.iter_mut().zip(fits(rate)) {
                if other.1.2 < best.1.2 {
                    *best = other;
                }
            }
        }
        let windows = turning.into_iter().zip(straight).zip(&newest).enumerate();
        let longest_first = windows.skip(FIXES_MIN - 1).rev();
        let mut turns = longest_first.filter_map(|(place, ((turn, line), (time, ..)))| {
            let ((rate, (_, velocity, misfit)), (_, (.., bent)), lasted) = (turn, line, -time);
            let freedom = (2 * place - 3) as f64;
            let is_clear = misfit <= freedom + tuned.steady_turn_misfit * (2.0 * freedom).sqrt()
                && tuned.steady_turn_gain <= bent - misfit
                && tuned.steady_turn_time <= lasted
                && tuned.steady_turn_min <= rate.abs() * lasted;
            is_clear.then_some(Self { velocity: Vector2::new(velocity.re, velocity.im), rate, lasted })
        });
        turns.next()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{estimate::tests::Random, tests::prelude::*};

    const SIGMA: f64 = 1.5;
    const SPEED: f64 = 0.9;

    /// The turn of a vehicle that followed `path` for a `time`, s, with a fix every ten seconds.
    fn turn(path: &Path, time: f64, seed: u64) -> Option<SteadyTurn> {
        let mut random = Random(seed);
        let times = (0..64).map(|k| time - 10.0 * f64::from(63 - k)).filter(|t_s| 0.0 <= *t_s);
        let fix = |t_s: f64| {
            let place = path.at(SPEED * t_s).position + random.normal() * SIGMA;
            (0, Report::new(t_s, place, SIGMA))
        };
        SteadyTurn::newest(&times.map(fix).collect::<Vec<_>>(), &EstimateNumbers::DEFAULT)
    }

    fn through(points: Vec<[f64; 2]>) -> Path {
        declared_through(points, None, SPEED).path().expect("is a path")
    }

    #[test]
    fn a_circle_is_found_after_two_minutes() {
        let mut found = 0;
        for (seed, side) in (0..20).zip([1.0, -1.0].into_iter().cycle()) {
            let point = |k: i32| {
                let angle = 0.05 * f64::from(k);
                [60.0 * angle.sin(), side * 60.0 * (1.0 - angle.cos())]
            };
            let circle = through((0..110).map(point).collect());
            assert_eq!(turn(&circle, 100.0, seed), None);
            if let Some(turn) = turn(&circle, 200.0, seed) {
                found += 1;
                near(turn.rate, side * SPEED / 60.0, 0.003);
                near(turn.velocity.norm(), SPEED, 0.08);
                let course = angle_of(&turn.velocity) - circle.at(SPEED * 200.0).tangent;
                assert!(course.sin().abs() < 0.15, "{seed}: {course}");
            }
        }
        // Of fixes on a circle as many fit worse than the bound.
        assert!(16 <= found, "{found} of 20");
    }

    #[test]
    fn lanes_and_boxes_are_no_steady_turn() {
        let lanes = Path::lawn_mower(Vector2::new(7.0, -3.0), 0.4, 150.0, 30.0, 8);
        let corners = [[0.0, 0.0], [120.0, 0.0], [120.0, 120.0], [0.0, 120.0]];
        let boxes = through(corners.repeat(5));
        let times = || (1..=10).map(|k| 100.0 * f64::from(k) + 17.0);
        let found = |path: &Path| {
            let all = (0..20).flat_map(|seed| times().map(move |time| turn(path, time, seed)));
            all.flatten().count()
        };
        assert_eq!([found(&lanes), found(&boxes)], [0, 0]);
    }
}
