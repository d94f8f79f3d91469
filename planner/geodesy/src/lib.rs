//! The local frame on Earth: latitude and longitude (WGS 84) from (north, east), and back.
//!
//! ```text
//! (north, east) = s (cos α, sin α)
//! ```
//!
//! s and α are length and azimuth, at the datum, of the geodesic from the datum to the place: the
//! azimuthal equidistant projection. Distances and directions from the datum are exact at any
//! distance; transverse distances are too long by at most s²/(6 R²), 1 cm per kilometre at 50 km.
//!
//! Source: C. F. F. Karney, Algorithms for geodesics, J. Geodesy 87 (2013),
//! doi:10.1007/s00190-012-0578-z, section 13.

use std::f64::consts::{PI, TAU};

use geographiclib_rs::{DirectGeodesic as _, Geodesic, InverseGeodesic as _};
use nalgebra::{Matrix2, Rotation2, Vector2};

/// Latitude and longitude (WGS 84) of the datum, rad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Origin {
    /// Geodetic latitude, rad, positive north.
    pub latitude: f64,
    /// Longitude, rad, positive east.
    pub longitude: f64,
}

/// Position of a local frame on Earth.
#[derive(Clone, Copy, Debug)]
pub struct Datum {
    latitude_deg: f64,
    longitude_deg: f64,
    ellipsoid: Geodesic,
}

/// A latitude beyond a pole, or a non-finite angle.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "latitude {latitude_deg}° and longitude {longitude_deg}° are no place on Earth: latitudes lie in [-90, 90]"
)]
pub struct NotOnEarth {
    /// The latitude given, degrees.
    pub latitude_deg: f64,
    /// The longitude given, degrees.
    pub longitude_deg: f64,
}

impl Datum {
    /// The local frame at `origin`. Longitudes may have any number of turns.
    pub fn new(origin: &Origin) -> Result<Self, NotOnEarth> {
        let (latitude_deg, longitude_deg) = degrees(origin)?;
        Ok(Self { latitude_deg, longitude_deg, ellipsoid: Geodesic::wgs84() })
    }

    /// (north, east) of `place`, m. At a pole, north is along the datum's own longitude.
    pub fn to_local(&self, place: &Origin) -> Result<Vector2<f64>, NotOnEarth> {
        let (latitude_deg, longitude_deg) = degrees(place)?;
        let (distance, azimuth_deg, _, _): (f64, f64, f64, f64) =
            self.ellipsoid.inverse(self.latitude_deg, self.longitude_deg, latitude_deg, longitude_deg);
        Ok(direction(azimuth_deg.to_radians()) * distance)
    }

    /// Latitude and longitude of `position` (north, east), m; the longitude is in [−π, π].
    pub fn from_local(&self, position: &Vector2<f64>) -> Origin {
        // `+ 0.0` turns −0.0 into 0.0, for which atan2 would answer −π on the southern ray.
        let azimuth = (position.y + 0.0).atan2(position.x + 0.0);
        let azimuth_deg = azimuth.to_degrees();
        let (latitude_deg, longitude_deg): (f64, f64) =
            self.ellipsoid.direct(self.latitude_deg, self.longitude_deg, azimuth_deg, position.norm());
        Origin { latitude: latitude_deg.to_radians(), longitude: longitude_deg.to_radians() }
    }

    /// Convergence at `position` (north, east), m: true minus local bearings, rad, in (−π, π].
    ///
    /// ```text
    /// γ = α₂ − α₁
    /// ```
    ///
    /// α₁ and α₂ are the azimuths of the geodesic from the datum, at the datum and at the position.
    /// Bearings across the geodesic differ equally; those in between by up to s²/(12 R²) less or
    /// more, since transverse distances are too long.
    pub fn convergence(&self, position: &Vector2<f64>) -> f64 {
        let [azimuth, azimuth_there, _] = self.along(position);
        PI - (PI - (azimuth_there - azimuth)).rem_euclid(TAU)
    }

    /// The derivative of true (north, east) at `position` (north, east), m, by the local frame's.
    ///
    /// ```text
    /// J = R(α₂) diag(1, m₁₂/s) R(−α₁)
    /// ```
    ///
    /// s and m₁₂ are the geodesic's length and reduced length (Karney, section 3): geodesics that
    /// leave the datum dα apart are m₁₂ dα apart there, and s dα in the local frame.
    pub fn true_from_local(&self, position: &Vector2<f64>) -> Matrix2<f64> {
        let [azimuth, azimuth_there, across] = self.along(position);
        Rotation2::new(azimuth_there)
            * Matrix2::from_diagonal(&Vector2::new(1.0, across))
            * Rotation2::new(-azimuth)
    }

    /// α₁, α₂, rad, and m₁₂/s of the geodesic to `position`.
    fn along(&self, position: &Vector2<f64>) -> [f64; 3] {
        /// Up to here the ratio is 1 to twelve digits; for tiny lengths it would be rounding.
        const SHORT_M: f64 = 1.0;
        let azimuth = (position.y + 0.0).atan2(position.x + 0.0);
        let distance = position.norm();
        let (_, _, azimuth_there_deg, reduced): (f64, f64, f64, f64) =
            self.ellipsoid.direct(self.latitude_deg, self.longitude_deg, azimuth.to_degrees(), distance);
        let across = if distance < SHORT_M { 1.0 } else { reduced / distance };
        [azimuth, azimuth_there_deg.to_radians(), across]
    }
}

/// Unit vector (north, east) that points along `angle`, rad, clockwise from north.
pub fn direction(angle: f64) -> Vector2<f64> {
    let (sin, cos) = angle.sin_cos();
    Vector2::new(cos, sin)
}

fn degrees(place: &Origin) -> Result<(f64, f64), NotOnEarth> {
    const POLE_DEG: f64 = 90.0;
    let (latitude_deg, longitude_deg) = (place.latitude.to_degrees(), place.longitude.to_degrees());
    if latitude_deg.abs() <= POLE_DEG && longitude_deg.is_finite() {
        Ok((latitude_deg, longitude_deg))
    } else {
        Err(NotOnEarth { latitude_deg, longitude_deg })
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use rand::{RngExt as _, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    fn origin(latitude_deg: f64, longitude_deg: f64) -> Origin {
        Origin { latitude: latitude_deg.to_radians(), longitude: longitude_deg.to_radians() }
    }

    fn datum(latitude_deg: f64, longitude_deg: f64) -> Datum {
        Datum::new(&origin(latitude_deg, longitude_deg)).expect("is on Earth")
    }

    /// WGS 84: semi-major axis, m, and first eccentricity squared.
    const A: f64 = 6_378_137.0;
    const FLATTENING: f64 = 1.0 / 298.257_223_563;
    const E2: f64 = FLATTENING * (2.0 - FLATTENING);

    /// Radii of curvature along the meridian and across it (prime vertical), m.
    fn radii(latitude: f64) -> (f64, f64) {
        let w2 = 1.0 - E2 * latitude.sin().powi(2);
        (A * (1.0 - E2) / w2.powf(1.5), A / w2.sqrt())
    }

    #[test]
    fn positions_are_restored_to_a_micrometre_at_every_latitude() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        for (latitude, longitude) in [
            (0.0, 0.0),
            (38.41, -9.12),
            (-54.8, 180.0),
            (71.0, -179.9),
            (89.9, 30.0),
            (90.0, 0.0),
            (-90.0, 77.0),
        ] {
            let datum = datum(latitude, longitude);
            for _ in 0..100 {
                let position = direction(rng.random_range(0.0..TAU)) * rng.random_range(0.0..50_000.0);
                let back = datum.to_local(&datum.from_local(&position)).expect("is on Earth");
                assert!((back - position).norm() < 1e-6, "{latitude}: {position} and {back}");
            }
        }
    }

    #[test]
    fn north_is_the_meridian_arc() {
        for latitude in [-80.0_f64, -38.41, 0.0, 12.0, 65.0] {
            let reached = datum(latitude, 20.0).from_local(&Vector2::new(10_000.0, 0.0));
            assert!((reached.longitude - 20_f64.to_radians()).abs() < 1e-15);
            let (from, to) = (latitude.to_radians(), reached.latitude);
            // Simpson's rule; its error over 0.1° is far below a micrometre.
            let arc =
                (to - from) / 6.0 * (radii(from).0 + 4.0 * radii(f64::midpoint(from, to)).0 + radii(to).0);
            assert!((arc - 10_000.0).abs() < 1e-6, "{latitude}: {arc}");
        }
    }

    #[test]
    fn east_is_an_arc_of_the_prime_vertical() {
        for latitude in [-80.0_f64, -38.41, 0.0, 12.0, 65.0] {
            let across = radii(latitude.to_radians()).1;
            // The geodesic's series over 100 m after two terms is tan²φ·s³/N² < 1 µm.
            let reached = datum(latitude, 20.0).from_local(&Vector2::new(0.0, 100.0));
            let turned = (reached.longitude - 20_f64.to_radians()) * across * latitude.to_radians().cos();
            assert!((turned - 100.0).abs() < 1e-6, "{latitude}: {turned}");
            let (along, _) = radii(latitude.to_radians());
            let sagged = (latitude.to_radians() - reached.latitude) * along;
            let sag = latitude.to_radians().tan() * 100.0 * 100.0 / (2.0 * across);
            assert!((sagged - sag).abs() < 1e-6, "{latitude}: {sagged} and {sag}");
        }
    }

    #[test]
    fn convergence_is_the_local_bearing_of_true_south_to_north() {
        const EARTH_RADIUS_M: f64 = 6.371e6;
        for latitude in [-70.0, -38.0, 0.0, 38.0, 70.0] {
            let datum = datum(latitude, 179.0);
            for bearing_deg in [0.0, 40.0, 90.0, 135.0, 180.0, 230.0, 270.0] {
                for distance in [0.0, 1e3, 20e3, 200e3, 600e3] {
                    let position = direction(f64::to_radians(bearing_deg)) * distance;
                    let place = datum.from_local(&position);
                    let at = |step: f64| {
                        let latitude = place.latitude + step;
                        datum.to_local(&Origin { latitude, ..place }).expect("is on Earth")
                    };
                    // Steps of 6 m along the meridian.
                    let north = at(1e-6) - at(-1e-6);
                    let expected = -north.y.atan2(north.x);
                    let most = 1e-8 + (distance / EARTH_RADIUS_M).powi(2) / 12.0;
                    let given = datum.convergence(&position);
                    assert!(
                        (given - expected).abs() <= 1.02 * most,
                        "{latitude} {position}: {given} and {expected}"
                    );
                }
            }
        }
        // On a sphere, sin α₂ = cos φ / cos φ₂ due east: 14.5°.
        let far = datum(70.0, 0.0).convergence(&Vector2::new(0.0, 600e3));
        assert!((far.to_degrees() - 14.5).abs() < 0.1, "{}", far.to_degrees());
    }

    #[test]
    fn true_bearings_and_distances_of_small_steps_are_those_of_the_geodesic() {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        for _ in 0..1000 {
            let datum = datum(rng.random_range(-80.0..80.0), rng.random_range(-180.0..180.0));
            let position = direction(rng.random_range(0.0..TAU)) * rng.random_range(0.0..900e3);
            let step = direction(rng.random_range(0.0..TAU)) * 10.0;
            let [from, to] = [position - step, position + step].map(|end| datum.from_local(&end));
            let here = Datum::new(&datum.from_local(&position)).expect("is on Earth");
            let [from, to] = [from, to].map(|end| here.to_local(&end).expect("is on Earth"));
            let error = datum.true_from_local(&position) * (2.0 * step) - (to - from);
            assert!(error.norm() < 1e-6, "{position} {step}: {error}");
        }
        for at_the_datum in [0.0, 1e-9] {
            let close = datum(38.0, 1.0).true_from_local(&Vector2::new(0.0, at_the_datum));
            assert!((close - Matrix2::identity()).norm() < 1e-12, "{close}");
        }
    }

    #[test]
    fn a_place_across_the_antimeridian_is_near() {
        for (datum, east_of_it) in [
            (datum(-17.0, 179.999), origin(-17.0, -179.999)),
            (datum(-17.0, -180.001), origin(-17.0, 180.001)),
            (datum(-17.0, 539.999), origin(-17.0, -179.999)),
        ] {
            let local = datum.to_local(&east_of_it).expect("is on Earth");
            let (_, across) = radii(17_f64.to_radians());
            let expected = across * 17_f64.to_radians().cos() * 0.002_f64.to_radians();
            assert!((local.y - expected).abs() < 1e-3, "{local}");
            assert!(local.x.abs() < 0.01, "{local}");
        }
    }

    #[test]
    fn the_datum_itself_is_the_origin_even_at_a_pole() {
        for latitude in [-90.0, 0.0, 90.0] {
            let datum = datum(latitude, 5.0);
            let here = datum.from_local(&Vector2::zeros());
            assert!((here.latitude - latitude.to_radians()).abs() < 1e-15);
            let local = datum.to_local(&here).expect("is on Earth");
            assert!(local.norm() < 1e-9, "{local}");
        }
    }

    #[test]
    fn a_place_that_is_not_on_earth_is_refused_by_name() {
        for place in
            [origin(90.1, 0.0), origin(f64::NAN, 0.0), origin(0.0, f64::NAN), origin(0.0, f64::INFINITY)]
        {
            assert!(Datum::new(&place).is_err());
            assert!(datum(0.0, 0.0).to_local(&place).is_err());
        }
        let refused = Datum::new(&origin(-91.0, 7.0)).expect_err("is beyond the pole");
        assert!(refused.to_string().contains("-91"), "{refused}");
        let pole = Origin { latitude: FRAC_PI_2, longitude: 0.0 };
        assert!(Datum::new(&pole).is_ok());
    }
}
