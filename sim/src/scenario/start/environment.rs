//! The environment of a start: water, bounds, faults, sensors, acoustics.

use std::{f64::consts::TAU, ops::RangeInclusive};

use nalgebra::Vector2;
use planner::snapshot::{KeepOut, NoGo, bounds_faults, clockwise, no_go_faults};

use super::draw::{Draw, Stream, check_count, craft_stream, stream};
use super::invalid::{InvalidScenario, invalid, of_snapshot, refused};
use crate::observe::{
    Acoustics, AcousticsSetup, Briefing, Observer, ReportedAs, SensorSetup, SurfaceSensors,
};
use crate::own_navigation::RangingFaults;
use crate::record::Bounds;
use crate::scenario::file::{
    AcousticsFile, BoundsFile, Calls, CurrentFile, FaultFile, FaultKindFile, RangingFile, Scenario,
    SensorsFile, WaterFile,
};
use crate::world::World;
use crate::world::fault::{Fault, FaultKind, Faults};
use crate::world::inner_loop::PERIOD;
use crate::world::water::{GaussMarkov, MeanCurrent, Shear, Water, WaterSetup, Waves};

/// Largest standard deviation of the yaw rate in waves, rad/s: a sixth of a snapshot's range.
const YAW_RATE_SIGMA_MAX: f64 = 0.5;

impl Scenario {
    pub(super) fn water(
        &self,
        file: &WaterFile,
        seed: u64,
        draw: &mut Draw,
    ) -> Result<Water, InvalidScenario> {
        let current = match &file.current {
            None => MeanCurrent::Constant(Vector2::zeros()),
            Some(CurrentFile::Constant { north_mps, east_mps }) => {
                let north = draw.take(north_mps);
                MeanCurrent::Constant(Vector2::new(north, draw.take(east_mps)))
            }
            Some(CurrentFile::Grid { file }) => {
                let grid = self.files.grid(file);
                MeanCurrent::Gridded(grid.map_err(|error| invalid("water.current.grid.file", error))?)
            }
        };
        let setup = WaterSetup {
            current,
            gauss_markov: file.gauss_markov.as_ref().map(|file| GaussMarkov {
                sigma: draw.take(&file.sigma_mps),
                correlation_time: draw.take(&file.correlation_s),
            }),
            shear: file.shear.as_ref().map(|file| Shear {
                depth: draw.take(&file.depth_m),
                factor: draw.take(&file.factor),
                turn: draw.take_or(file.turn_rad.as_ref(), 0.0),
            }),
            waves: file.waves.as_ref().map(|file| Waves {
                heading_sigma: draw.take(&file.heading_sigma_rad),
                surge_sigma: draw.take(&file.surge_sigma_mps),
                peak_period: draw.take(&file.peak_period_s),
                damping: draw.take(&file.damping),
            }),
        };
        if let Some(waves) = &setup.waves {
            // The heading's rate is its deviation times the peak frequency.
            let range = 0.0..=YAW_RATE_SIGMA_MAX * waves.peak_period / TAU;
            within("water.waves.heading_sigma_rad", waves.heading_sigma, range)?;
        }
        Ok(Water::new(&setup, stream(seed, Stream::Water)))
    }

    /// The faults that concern the surface craft with this number.
    pub(super) fn faults(&self, number: usize, draw: &mut Draw) -> Result<Faults, InvalidScenario> {
        check_count("faults", self.faults.len())?;
        let mut faults = vec![];
        for (i, file) in self.faults.iter().enumerate() {
            let fault = self.fault(i, file, draw)?;
            let called = |id: &String| self.craft_called(&format!("faults[{i}].craft"), id);
            let of = file.craft.as_ref().map(called).transpose()?;
            let is_of_auv = matches!(
                file.what,
                FaultKindFile::AuvStops { .. }
                    | FaultKindFile::AuvDies { .. }
                    | FaultKindFile::AuvLeavesPath { .. }
            );
            if of.is_some() && is_of_auv {
                return refused(format!("faults[{i}].craft"), "a fault of an AUV has no craft: leave it out");
            }
            if of.is_none_or(|of| of == number) {
                faults.push(fault);
            }
        }
        Ok(Faults(faults))
    }

    fn fault(&self, i: usize, file: &FaultFile, draw: &mut Draw) -> Result<Fault, InvalidScenario> {
        let from = draw.take(&file.from_s);
        let until = draw.take_or(file.until_s.as_ref(), f64::INFINITY);
        if until <= from {
            let reason = format_args!("{until} s is not after the start at {from} s");
            return refused(format!("faults[{i}].until_s"), reason);
        }
        let auv = |kind: &str, id: &str| self.auv_called(&format!("faults[{i}].what.{kind}.auv"), id);
        let moved = |kind: &str, id: &str| {
            let number = auv(kind, id)?;
            if self.auvs[number].track.is_none() {
                return Ok(number);
            }
            let reason = format_args!("{id:?} repeats its recorded track, whatever happens");
            refused(format!("faults[{i}].what.{kind}.auv"), reason)
        };
        let what = match &file.what {
            FaultKindFile::Thruster { side, share } => {
                FaultKind::Thruster { side: *side, share: draw.take(share) }
            }
            FaultKindFile::CraftDies => FaultKind::CraftDies,
            FaultKindFile::GnssOutage => FaultKind::GnssOutage,
            FaultKindFile::ClockOffset { offset_s } => FaultKind::ClockOffset(draw.take(offset_s)),
            FaultKindFile::Silence { auv: id } => FaultKind::Silence(auv("silence", id)?),
            FaultKindFile::AuvStops { auv: id } => FaultKind::Stops(moved("auv_stops", id)?),
            FaultKindFile::AuvDies { auv: id } => FaultKind::Dies(moved("auv_dies", id)?),
            FaultKindFile::AuvLeavesPath { auv: id, heading_rad } => FaultKind::LeavesPath {
                auv: moved("auv_leaves_path", id)?,
                // Drawn only if given: earlier scenarios keep their numbers.
                heading: heading_rad.as_ref().map(|heading| draw.take(heading)),
            },
            FaultKindFile::RudderStuck { share } => FaultKind::RudderStuck(draw.take(share)),
            FaultKindFile::ThrustStuck { share } => FaultKind::ThrustStuck(draw.take(share)),
            FaultKindFile::WrongAccuracy { auv: id, factor } => {
                FaultKind::WrongAccuracy { auv: auv("wrong_accuracy", id)?, factor: draw.take(factor) }
            }
            FaultKindFile::ReportsSpeedZero { auv: id } => {
                FaultKind::ReportsSpeedZero(auv("reports_speed_zero", id)?)
            }
            FaultKindFile::MessagesTwice { auv: id } => FaultKind::MessagesTwice(auv("messages_twice", id)?),
        };
        Ok(Fault { from, until, what })
    }

    pub(super) fn observer(
        &self,
        world: &World,
        briefing: Briefing,
        (seed, number): (u64, usize),
        draw: &mut Draw,
    ) -> Result<Observer, InvalidScenario> {
        let sensors = sensors(&self.knowledge.sensors, draw);
        let acoustics = self.knowledge.acoustics.as_ref();
        let acoustics = acoustics.map(|file| self.acoustics(file, draw)).transpose()?;
        let noise = craft_stream(seed, number, Stream::Acoustics);
        let acoustics = acoustics.map(|setup| Acoustics::new(&setup, PERIOD, noise));
        let sensors = SurfaceSensors::new(sensors, craft_stream(seed, number, Stream::Sensors));
        Ok(Observer::new(world, briefing, sensors, acoustics))
    }

    fn acoustics(&self, file: &AcousticsFile, draw: &mut Draw) -> Result<AcousticsSetup, InvalidScenario> {
        let field = "knowledge.acoustics.slots_s";
        for id in file.slots_s.keys() {
            self.auv_called(field, id)?;
        }
        let slots = self.auvs.iter().map(|auv| {
            let missing = || invalid(field, format_args!("{:?} has no slot", auv.id));
            Ok(draw.take(file.slots_s.get(&auv.id).ok_or_else(missing)?))
        });
        let slots = slots.collect::<Result<Vec<_>, _>>()?;
        let loss = draw.take_or(file.loss.as_ref(), 0.0);
        let position_sigma = draw.take(&file.position_sigma_m);
        let setup = AcousticsSetup {
            frame: draw.take(&file.frame_s),
            slot_length: draw.take(&file.slot_length_s),
            slots,
            sound_speed: draw.take_or(file.sound_speed_mps.as_ref(), 1500.0),
            latency: draw.take(&file.latency_s),
            position_sigma,
            depth_sigma: draw.take_or(file.depth_sigma_m.as_ref(), 0.0),
            course_sigma: draw.take_or(file.course_sigma_rad.as_ref(), 0.0),
            speed_sigma: draw.take_or(file.speed_sigma_mps.as_ref(), 0.0),
            range_max: draw.take(&file.range_max_m),
            loss,
            loss_at_range_max: draw.take_or(file.loss_at_range_max.as_ref(), loss),
            outlier_share: draw.take_or(file.outlier_share.as_ref(), 0.0),
            outlier_sigma: draw.take_or(file.outlier_sigma_m.as_ref(), 10.0 * position_sigma),
        };
        if file.reported_as == ReportedAs::State && !file.course_and_speed {
            return refused(
                "knowledge.acoustics.course_and_speed",
                "a state has course and speed; reported_as = \"reports\" needs none",
            );
        }
        if file.calls != Calls::Unasked && !self.has_fleet() {
            let reason = "one surface craft has the slots for itself; leave it out";
            return refused("knowledge.acoustics.calls", reason);
        }
        let check = |member, value, range| within(format!("knowledge.acoustics.{member}"), value, range);
        let longest = setup.latency.min(setup.frame);
        check("slot_length_s", setup.slot_length, 0.0..=longest)?;
        check("loss_at_range_max", setup.loss_at_range_max, setup.loss..=1.0)?;
        for (auv, slot) in self.auvs.iter().zip(&setup.slots) {
            within(format!("{field}.{}", auv.id), *slot, 0.0..=setup.frame)?;
        }
        Ok(setup)
    }
}

pub(super) fn bounds(file: &BoundsFile, draw: &mut Draw) -> Result<Bounds, InvalidScenario> {
    check_count("bounds.keep_outs", file.keep_outs.len())?;
    check_count("bounds.area", file.area.len())?;
    let keep_outs = file.keep_outs.iter().map(|disc| {
        let centre = Vector2::new(draw.take(&disc.north_m), draw.take(&disc.east_m));
        KeepOut::new(centre, draw.take(&disc.radius_m))
    });
    let keep_outs = keep_outs.collect();
    let mut corners = |ring: &Vec<_>| draw.points(ring).into_iter().map(Into::into).collect();
    let no_go = file.no_go.iter().map(|area| NoGo {
        holes: area.holes.iter().map(&mut corners).collect(),
        ..NoGo::new(corners(&area.polygon))
    });
    let no_go: Vec<_> = no_go.collect();
    let mut bounds = Bounds {
        keep_outs,
        no_go,
        area: draw.points(&file.area),
        range_max: file.range_max_m.as_ref().map(|range| draw.take(range)),
        energy_max: file.energy_max_j.as_ref().map(|energy| draw.take(energy)),
        vessel_separation: None,
    };
    // Snapshots contain them and have the same rules.
    let faults = bounds_faults(&bounds.keep_outs, &bounds.area, bounds.range_max);
    match faults.into_iter().chain(no_go_faults(&bounds.no_go)).next() {
        None => {
            bounds.area = clockwise(&bounds.area);
            Ok(bounds)
        }
        Some(fault) => {
            // A scenario has the range beside the other bounds.
            let pointer = fault.pointer.replace("/acoustics", "");
            Err(of_snapshot("bounds", &pointer, &fault))
        }
    }
}

pub(super) fn ranging(file: &RangingFile, draw: &mut Draw) -> RangingFaults {
    RangingFaults {
        lost_share: draw.take_or(file.lost_share.as_ref(), 0.0),
        outlier_share: draw.take_or(file.outlier_share.as_ref(), 0.0),
        outlier: draw.take_or(file.outlier_max_m.as_ref(), 0.0),
        clock_drift: draw.take_or(file.clock_drift_mps.as_ref(), 0.0),
    }
}

fn sensors(file: &SensorsFile, draw: &mut Draw) -> SensorSetup {
    SensorSetup {
        position_sigma: draw.take_or(file.position_sigma_m.as_ref(), 0.0),
        position_correlation_time: draw.take_or(file.position_correlation_s.as_ref(), 0.0),
        velocity_sigma: draw.take_or(file.velocity_sigma_mps.as_ref(), 0.0),
        heading_sigma: draw.take_or(file.heading_sigma_rad.as_ref(), 0.0),
        heading_bias: draw.take_or(file.heading_bias_rad.as_ref(), 0.0),
        yaw_rate_sigma: draw.take_or(file.yaw_rate_sigma_radps.as_ref(), 0.0),
        speed_sigma: draw.take_or(file.speed_sigma_mps.as_ref(), 0.0),
    }
}

/// Checks a number against limits set by other numbers of the scenario.
fn within(field: impl Into<String>, value: f64, range: RangeInclusive<f64>) -> Result<(), InvalidScenario> {
    if range.contains(&value) {
        return Ok(());
    }
    let (least, most) = range.into_inner();
    let reason = format_args!("{value} is outside {least} to {most}, the limits that other members set");
    refused(field, reason)
}
