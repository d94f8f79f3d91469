//! Other vessels by AIS: what each has said of itself, joined by its MMSI.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;

use nalgebra::Vector2;
use planner::angle::direction;
use planner::snapshot::{VESSELS_MAX, VehicleId, Vessel, VesselStatus};
use planner::vessel::is_lost;

use crate::nmea::KNOT;
use crate::recent_positions::{displaced, moved};
use crate::{Origin, VesselFix, VesselMessage};

/// Most vessels that are remembered: more than a receiver at sea hears in a day.
const KNOWN_MAX: usize = 2_000;
/// Time after which a vessel that is not heard is forgotten, s.
const FORGOTTEN_S: f64 = 86_400.0;
/// Greatest distance of a vessel that matters, m: a ferry's way in the planner's five minutes.
const RANGE_M: f64 = 10_000.0;
/// Speed above which a vessel is not made fast, whatever it says, m/s: AIS reports it as under way
/// from three knots on (ITU-R M.1371), and its status is set by hand.
const MADE_FAST_MAX: f64 = 3.0 * KNOT;
/// Speed from which a course shows the heading, m/s.
const COURSE_MIN: f64 = 1.0;
/// Coast stations, by the countries in their MMSI (ITU-R M.585). An autopilot passes them on as
/// vessels.
const COAST_STATIONS: RangeInclusive<u32> = 2_010_000..=7_759_999;

/// The vessels that were heard. Times are s of the bridge's clock.
#[derive(Clone, Debug, Default)]
pub(crate) struct Vessels {
    /// The craft's own MMSI: given, or that of its own transponder.
    own: Option<u32>,
    known: BTreeMap<u32, Known>,
}

#[derive(Clone, Debug, Default)]
struct Known {
    heard_s: f64,
    /// The newest position, and its time, s.
    fix: Option<(f64, VesselFix)>,
    name: Option<String>,
    dimensions: Option<[f64; 4]>,
    /// `true` for a position that was not posted.
    is_new: bool,
}

impl Vessels {
    /// Nothing heard yet, for a craft whose transponder has the MMSI `own`.
    pub(crate) fn new(own: Option<u32>) -> Self {
        Self { own, known: BTreeMap::new() }
    }

    /// Takes a message that came at `now`, s. Those of the craft itself are no traffic.
    pub(crate) fn take(&mut self, now: f64, message: VesselMessage) {
        let mmsi = message.mmsi;
        if message.is_own {
            self.own.get_or_insert(mmsi);
        }
        if message.is_own || self.own == Some(mmsi) || COAST_STATIONS.contains(&mmsi) {
            self.known.remove(&mmsi);
            return;
        }
        if self.known.len() >= KNOWN_MAX && !self.known.contains_key(&mmsi) {
            self.known.retain(|_, vessel| now - vessel.heard_s < FORGOTTEN_S);
            let silent = self.known.iter().min_by(|a, b| a.1.heard_s.total_cmp(&b.1.heard_s));
            let silent = silent.map(|(mmsi, _)| *mmsi).filter(|_| self.known.len() >= KNOWN_MAX);
            silent.map(|mmsi| self.known.remove(&mmsi));
        }
        let vessel = self.known.entry(mmsi).or_default();
        vessel.heard_s = now;
        vessel.name = message.name.or(vessel.name.take());
        vessel.dimensions = message.dimensions.or(vessel.dimensions);
        if let Some(fix) = message.fix {
            let at = now - fix.age_s;
            // A relay repeats old positions.
            if vessel.fix.is_none_or(|(before, _)| before < at) {
                (vessel.fix, vessel.is_new) = (Some((at, fix)), true);
            }
        }
    }

    /// The vessels that may be near `here` at `now`, s, with their distances, m, nearest first.
    pub(crate) fn near(&self, now: f64, here: &Origin) -> Vec<(f64, Vessel)> {
        let known = self.known.iter().filter(|(_, vessel)| now - vessel.heard_s < FORGOTTEN_S);
        let seen = known.filter_map(|(mmsi, vessel)| vessel.at(*mmsi, here));
        let mut near: Vec<_> =
            seen.filter(|(_, vessel)| !is_lost(vessel, now - vessel.t_s.unwrap_or(now))).collect();
        near.sort_by(|a, b| a.0.total_cmp(&b.0));
        near
    }

    /// The nearest vessels whose positions are new since the last call.
    pub(crate) fn news(&mut self, now: f64, here: &Origin) -> Vec<Vessel> {
        let is_new = |vessel: &Vessel| {
            let mmsi = vessel.id.0.parse().ok();
            mmsi.and_then(|mmsi: u32| self.known.get(&mmsi)).is_some_and(|known| known.is_new)
        };
        let near = self.near(now, here).into_iter().map(|(_, vessel)| vessel);
        let news = near.filter(is_new).take(VESSELS_MAX).collect();
        self.known.values_mut().for_each(|vessel| vessel.is_new = false);
        news
    }
}

impl Known {
    /// The vessel with its distance from `here`, m, if its position is known and near enough.
    fn at(&self, mmsi: u32, here: &Origin) -> Option<(f64, Vessel)> {
        let (at, fix) = self.fix.as_ref()?;
        let middle = self.middle(fix);
        let distance = moved(here, &middle).norm();
        let is_under_way = fix.speed.is_some_and(|speed| MADE_FAST_MAX < speed);
        let vessel = Vessel {
            id: VehicleId(format!("{mmsi:09}")),
            name: self.name.clone(),
            t_s: Some(*at),
            // The service computes metres.
            north_m: f64::NAN,
            east_m: f64::NAN,
            lat_deg: Some(middle.lat_deg),
            lon_deg: Some(middle.lon_deg),
            course_rad: fix.course,
            speed_mps: fix.speed,
            heading_rad: fix.heading,
            length_m: self.dimensions.map(|[bow, stern, ..]| bow + stern),
            sigma_m: None,
            plan: Vec::new(),
            status: fix.status,
        };
        let status = if is_under_way && vessel.is_made_fast() { VesselStatus::UnderWay } else { fix.status };
        (distance <= RANGE_M).then_some((distance, Vessel { status, ..vessel }))
    }

    /// The middle of the vessel, if its dimensions and the direction of its bow are known, else its
    /// antenna.
    fn middle(&self, fix: &VesselFix) -> Origin {
        let goes = fix.speed.is_some_and(|speed| COURSE_MIN <= speed);
        let bow = fix.heading.or(fix.course.filter(|_| goes));
        let Some((bow, [ahead, astern, port, starboard])) = bow.zip(self.dimensions) else {
            return fix.position;
        };
        let bow = direction(bow);
        // Zero to bow and port means that the antenna's place is not known.
        if (ahead, port) == (0.0, 0.0) {
            return fix.position;
        }
        let right = Vector2::new(-bow.y, bow.x);
        displaced(&fix.position, &(0.5 * (bow * (ahead - astern) + right * (starboard - port))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::on_earth;

    const SHIP: u32 = 244_123_456;

    fn here() -> Origin {
        on_earth(38.0, -9.0).expect("is on Earth")
    }

    /// A message of `mmsi`, this far north of the craft, m.
    fn at(mmsi: u32, north: f64, change: impl Fn(&mut VesselFix)) -> VesselMessage {
        let position = displaced(&here(), &Vector2::new(north, 0.0));
        let status = VesselStatus::UnderWay;
        let mut fix = VesselFix { age_s: 0.0, position, course: None, speed: None, heading: None, status };
        change(&mut fix);
        VesselMessage { mmsi, fix: Some(fix), ..VesselMessage::default() }
    }

    fn only(vessels: &Vessels, now: f64) -> Vessel {
        let near = vessels.near(now, &here());
        assert_eq!(near.len(), 1, "{near:?}");
        near[0].1.clone()
    }

    /// North and east of the craft, m.
    fn place(vessel: &Vessel) -> [f64; 2] {
        let place = vessel.lat_deg.zip(vessel.lon_deg).and_then(|(lat, lon)| on_earth(lat, lon));
        moved(&here(), &place.expect("is in degrees")).into()
    }

    #[test]
    fn name_and_length_join_the_position_and_shift_it_to_the_middle() {
        let mut vessels = Vessels::default();
        let dimensions = Some([100.0, 20.0, 15.0, 5.0]);
        let said = VesselMessage {
            mmsi: SHIP,
            name: Some("EXAMPLE".to_owned()),
            dimensions,
            ..at(SHIP, 0.0, |_| ())
        };
        vessels.take(0.0, VesselMessage { fix: None, ..said });
        assert_eq!(vessels.near(1.0, &here()), []);
        vessels.take(5.0, at(SHIP, 500.0, |fix| fix.heading = Some(std::f64::consts::FRAC_PI_2)));
        let vessel = only(&vessels, 6.0);
        assert_eq!(
            (vessel.id.0.as_str(), vessel.called(), vessel.length_m),
            ("244123456", "EXAMPLE", Some(120.0))
        );
        // The bow is 100 m east of the antenna, the stern 20 m west: the middle is 40 m east; port
        // is north by 15 m, starboard south by 5 m: 5 m north.
        let [north, east] = place(&vessel);
        assert!((north - 505.0).abs() < 0.1 && (east - 40.0).abs() < 0.1, "{north} m, {east} m");
        // Without a heading, a course shows it under way only.
        for (speed, expected) in [(5.0, [540.0, -5.0]), (0.2, [500.0, 0.0])] {
            vessels.take(
                10.0 + speed,
                at(SHIP, 500.0, |fix| (fix.course, fix.speed) = (Some(0.0), Some(speed))),
            );
            let [north, east] = place(&only(&vessels, 20.0));
            assert!(
                (north - expected[0]).abs() < 0.1 && (east - expected[1]).abs() < 0.1,
                "{north} m, {east} m"
            );
            vessels.known.clear();
            vessels.take(0.0, VesselMessage { dimensions, ..at(SHIP, 0.0, |fix| fix.age_s = 100.0) });
        }
    }

    #[test]
    fn the_craft_itself_and_coast_stations_are_no_traffic() {
        for (own, echo) in [(Some(SHIP), false), (None, true)] {
            let mut vessels = Vessels::new(own);
            vessels.take(0.0, at(SHIP, 1.0, |_| ()));
            vessels.take(1.0, VesselMessage { is_own: echo, ..at(SHIP, 1.0, |_| ()) });
            vessels.take(2.0, at(SHIP, 1.0, |_| ()));
            vessels.take(2.0, at(2_442_000, 100.0, |_| ()));
            assert_eq!(vessels.near(3.0, &here()), []);
            vessels.take(3.0, at(SHIP + 1, 50.0, |_| ()));
            assert_eq!(only(&vessels, 3.0).id.0, "244123457");
        }
    }

    #[test]
    fn a_vessel_at_anchor_stays_for_a_day_and_one_that_moves_is_not_made_fast() {
        let mut vessels = Vessels::default();
        vessels.take(0.0, at(SHIP, 100.0, |fix| fix.status = VesselStatus::AtAnchor));
        vessels.take(0.0, at(SHIP + 1, 200.0, |fix| fix.speed = Some(1.0)));
        assert_eq!(vessels.near(899.0, &here()).len(), 2);
        assert_eq!(only(&vessels, 86_000.0).id.0, "244123456");
        assert_eq!(vessels.near(86_400.0, &here()), []);
        let status = |speed: f64| {
            let mut vessels = Vessels::default();
            vessels.take(
                0.0,
                at(SHIP, 9.0, |fix| (fix.status, fix.speed) = (VesselStatus::Moored, Some(speed))),
            );
            only(&vessels, 1.0).status
        };
        assert_eq!((status(1.5), status(1.6)), (VesselStatus::Moored, VesselStatus::UnderWay));
    }

    #[test]
    fn the_newest_position_counts_and_is_news_once() {
        let mut vessels = Vessels::default();
        vessels.take(10.0, at(SHIP, 100.0, |_| ()));
        vessels.take(11.0, at(SHIP, 900.0, |fix| fix.age_s = 5.0));
        vessels.take(11.0, at(SHIP + 1, 20_000.0, |_| ()));
        let news = vessels.news(12.0, &here());
        assert_eq!((news.len(), news[0].t_s, place(&news[0])[0].round()), (1, Some(10.0), 100.0));
        assert_eq!(vessels.news(13.0, &here()), []);
    }

    #[test]
    fn memory_and_news_are_bounded_and_keep_the_nearest() {
        let mut vessels = Vessels::default();
        for (number, north) in (0_u32..5_000).zip(0_u16..) {
            vessels.take(f64::from(number) * 0.01, at(SHIP + number, f64::from(north), |_| ()));
        }
        assert_eq!(vessels.known.len(), KNOWN_MAX);
        let news = vessels.news(60.0, &here());
        let nearest = (SHIP + 3_000..SHIP + 3_064).map(|mmsi| mmsi.to_string());
        assert!(news.iter().map(|vessel| vessel.id.0.clone()).eq(nearest));
    }
}
