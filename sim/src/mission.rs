//! A mission: observe, ask the guide, follow its reference for a second, repeat.

use nalgebra::Vector2;
use planner::angle::wrap;
use planner::goal::GoalForecast;
use planner::snapshot::{Goal, PlanRequest, Snapshot};

use crate::{
    guide::{Guidance, Guide, GuideError},
    observe::{Acoustics, ReportedAs},
    record::{
        AuvReference, AuvRow, KnownAuv, KnownSurfaceCraft, NavigationRow, Record, Row, SurfaceCraftRow,
        VesselRow,
    },
    scenario::{CurrentFile, Scenario, Start},
    visits::TrueCosts,
    world::{
        SurfaceCraft, World, auv::SimulatedAuv, inner_loop::PERIOD, plant::Plant, vessel::SimulatedVessel,
    },
};

mod goal;

use goal::TrueGoal;
pub use goal::in_turn;

/// Inner-loop periods between two plans: one second.
const PERIODS_PER_PLAN: u32 = 10;
/// Time between two plans, s.
const PLAN_INTERVAL: f64 = 10.0 * PERIOD;
/// Distance between two points of a path in a record, m.
const PATH_POINT_INTERVAL: f64 = 1.0;
/// Largest number of points of a path in a record, enough for any chart.
const PATH_POINTS_MAX: u32 = 10_000;

/// Runs `scenario` with `seed` to its end. `progress` receives the completed fraction.
///
/// Without a surface craft, the guide is not called. Errors are of scenario, guide or snapshot.
pub fn run(
    scenario: &Scenario,
    guide: &mut dyn Guide,
    seed: u64,
    progress: &mut dyn FnMut(f64),
) -> Result<Record, GuideError> {
    run_from(scenario.start(seed)?, scenario, guide, seed, progress)
}

/// [`run`] from `start`, which the caller may have changed.
pub fn run_from(
    start: Start,
    scenario: &Scenario,
    guide: &mut dyn Guide,
    seed: u64,
    progress: &mut dyn FnMut(f64),
) -> Result<Record, GuideError> {
    let mut mission = Mission::from_start(start, scenario, guide.name(), seed);
    while !mission.is_over() {
        let snapshot = mission.observe()?;
        let asked = snapshot.as_ref().map(|snapshot| guide.guide(snapshot));
        let asked = asked.transpose()?;
        mission.step(snapshot.as_ref().zip(asked));
        progress(mission.done());
    }
    Ok(mission.into_record())
}

/// A mission that its caller advances tick by tick.
#[derive(Debug)]
pub struct Mission {
    start: Start,
    goal: Option<TrueGoal>,
    costs: Option<TrueCosts>,
    record: Record,
    ticks: u32,
    ticks_max: u32,
    /// `true` while the craft has no goal.
    stands_by: bool,
}

impl Mission {
    /// The mission of `scenario` with `seed`. `guide` is the name in its record.
    pub fn new(scenario: &Scenario, guide: &str, seed: u64) -> Result<Self, GuideError> {
        Ok(Self::from_start(scenario.start(seed)?, scenario, guide, seed))
    }

    /// The mission from `start`, which the caller may have changed.
    pub fn from_start(start: Start, scenario: &Scenario, guide: &str, seed: u64) -> Self {
        let mut record = empty_record(scenario, &start, guide, seed);
        let ticks_max = whole_plans(start.duration);
        record.rows.reserve(ticks_max as usize);
        let briefing = start.observer.as_ref().map(|observer| &observer.briefing);
        Self {
            goal: briefing.map(TrueGoal::new),
            costs: briefing.and_then(|briefing| TrueCosts::new(&briefing.goal)),
            start,
            record,
            ticks: 0,
            ticks_max,
            stands_by: false,
        }
    }

    /// `true` after its last tick.
    pub fn is_over(&self) -> bool {
        self.ticks_max <= self.ticks
    }

    /// The completed fraction.
    pub fn done(&self) -> f64 {
        f64::from(self.ticks) / f64::from(self.ticks_max)
    }

    /// Number of rows of its complete record.
    pub fn n_rows(&self) -> u32 {
        self.ticks_max
    }

    /// Mission time, s.
    pub fn time(&self) -> f64 {
        self.start.world.time()
    }

    /// The present knowledge; none without a surface craft. Each call draws new sensor errors.
    pub fn observe(&mut self) -> Result<Option<Snapshot>, GuideError> {
        let world = &self.start.world;
        let (Some(observer), Some(craft)) = (&mut self.start.observer, &world.surface_craft) else {
            return Ok(None);
        };
        Ok(Some(observer.observe(world, craft, PLAN_INTERVAL)?))
    }

    /// `true` if the craft measures ranges to the AUVs alone; their estimates are then judged.
    fn is_ranged(&self) -> bool {
        let observer = self.start.observer.as_ref();
        observer.is_some_and(|observer| observer.briefing.reported_as == ReportedAs::Ranges)
    }

    /// What [`Self::observe`] makes a snapshot of.
    pub(crate) fn request(&mut self) -> Option<PlanRequest> {
        let world = &self.start.world;
        let (observer, craft) = (self.start.observer.as_mut()?, world.surface_craft.as_ref()?);
        Some(observer.request(world, craft, PLAN_INTERVAL))
    }

    /// Position of the surface craft (north, east), m, unless it is dead.
    pub(crate) fn position(&self) -> Option<Vector2<f64>> {
        let world = &self.start.world;
        let craft = world.surface_craft.as_ref();
        craft.filter(|_| !world.faults.craft_is_dead(world.time())).map(SurfaceCraft::position)
    }

    /// True positions of the AUVs (north, east), m.
    pub(crate) fn auv_positions(&self) -> Vec<Vector2<f64>> {
        self.start.world.auvs.iter().map(SimulatedAuv::position).collect()
    }

    /// The channel between the AUVs and the surface craft, if there is one.
    pub(crate) fn acoustics(&mut self) -> Option<&mut Acoustics> {
        self.start.observer.as_mut()?.acoustics.as_mut()
    }

    /// Changes the goal by which the distance is measured; without one it is 0.
    pub(crate) fn pursue(&mut self, goal: Option<&Goal>) {
        self.stands_by = goal.is_none();
        if let (Some(goal), Some(pursued)) = (goal, &mut self.goal) {
            pursued.change(goal);
        }
    }

    /// Advances by a tick. The surface craft follows the guide's answer to [`Self::observe`].
    pub fn step(&mut self, guided: Option<(&Snapshot, Guidance)>) {
        self.sail(guided, &Vec::from_iter(self.position()));
        self.navigate(&Vec::from_iter(self.position()));
    }

    /// Advances all but the AUVs' own navigation by a tick. The AUVs are served by `craft`, at these positions.
    pub(crate) fn sail(&mut self, guided: Option<(&Snapshot, Guidance)>, craft: &[Vector2<f64>]) {
        let world = &self.start.world;
        let mut row = Row {
            time: world.time(),
            surface_craft: None,
            consorts: vec![],
            auvs: world.auvs.iter().map(|auv| auv_row(world, auv)).collect(),
            vessels: world.vessels.iter().map(vessel_row).collect(),
        };
        if let (Some((snapshot, guidance)), Some(asc), Some(goal)) =
            (guided, &world.surface_craft, &mut self.goal)
        {
            for (auv, estimate) in row.auvs.iter_mut().zip(snapshot.estimates()) {
                auv.known = Some(KnownAuv {
                    position: estimate.state.position(),
                    depth: estimate.state.depth_m,
                    course: estimate.state.course().radians(),
                    speed: estimate.state.speed_mps,
                    age: estimate.state.age_s,
                });
            }
            let goal = if self.stands_by { asc.position() } else { goal.position(world, guidance.serves) };
            row.surface_craft = Some(surface_craft_row(world, asc, goal, snapshot, guidance));
        }
        if let Some(costs) = &mut self.costs {
            for (place, auv) in row.auvs.iter_mut().enumerate() {
                auv.service = costs.observe(world, craft, place);
            }
            costs.end_tick(world);
        }
        if let Some(navigation) = &self.start.own_navigation {
            for (place, auv) in row.auvs.iter_mut().enumerate() {
                auv.navigation = navigation.row(&self.start.world, place);
            }
        }
        if let Some((snapshot, _)) = guided.filter(|_| self.is_ranged()) {
            let forecast = GoalForecast::holding(snapshot, None);
            for ((auv, truth), there) in row.auvs.iter_mut().zip(&world.auvs).zip(forecast.auvs()) {
                let error = there.at(0.0).position - truth.position();
                auv.navigation = NavigationRow::of(error, &there.position_covariance(0.0));
            }
        }
        let reference = row.surface_craft.as_ref().map(|craft| &craft.reference);
        for _ in 0..PERIODS_PER_PLAN {
            self.start.world.step(reference);
            if let Some(observer) = &mut self.start.observer {
                observer.listen(&self.start.world);
            }
        }
        self.record.rows.push(row);
        self.ticks += 1;
    }

    /// Advances the AUVs' own navigation, which measures from `craft`, at these positions.
    pub(crate) fn navigate(&mut self, craft: &[Vector2<f64>]) {
        if let Some(navigation) = &mut self.start.own_navigation {
            navigation.advance(&mut self.start.world, craft);
        }
    }

    /// The record so far.
    pub fn record(&self) -> &Record {
        &self.record
    }

    /// The record.
    pub fn into_record(self) -> Record {
        self.record
    }

    /// The record so far, for who completes it.
    pub(crate) fn record_mut(&mut self) -> &mut Record {
        &mut self.record
    }

    /// Removes the rows so far from the record, for a caller that stores them.
    pub fn take_rows(&mut self) -> Vec<Row> {
        std::mem::take(&mut self.record.rows)
    }

    /// Removes the paths, most of a record's memory, for a caller that keeps many missions.
    pub fn forget_paths(&mut self) {
        self.record.paths = vec![];
    }
}

fn empty_record(scenario: &Scenario, start: &Start, guide: &str, seed: u64) -> Record {
    let auvs = &start.world.auvs;
    let guide = if scenario.has_surface_craft() { guide } else { "" };
    Record {
        scenario: scenario.name.clone(),
        title: scenario.title.clone(),
        guide: guide.to_owned(),
        seed,
        interval: PLAN_INTERVAL,
        origin: start.origin,
        settled_after: start.settled_after,
        contact_range: start.contact_range,
        limits: start.limits,
        fleet: vec![],
        plant: plant(scenario, &start.world),
        bounds: start.bounds.clone(),
        faults: start.world.faults.0.clone(),
        auv_ids: auvs.iter().map(|auv| auv.id.to_string()).collect(),
        vessel_ids: start.world.vessels.iter().map(|vessel| vessel.id.clone()).collect(),
        paths: auvs.iter().map(path_points).collect(),
        rows: vec![],
    }
}

/// The physical limits of the surface craft. None in waves, whose loads are as large as those of
/// the thrusters, nor in a gridded current, which may be stronger elsewhere.
fn plant(scenario: &Scenario, world: &World) -> Option<Plant> {
    let grid = matches!(scenario.water.current, Some(CurrentFile::Grid { .. }));
    let known = scenario.water.waves.is_none() && !grid;
    let craft = world.surface_craft.as_ref().filter(|_| known)?;
    Some(Plant::of(&craft.hull))
}

#[expect(clippy::cast_possible_truncation, reason = "a scenario lasts a day at most")]
fn whole_plans(duration: f64) -> u32 {
    (duration / PLAN_INTERVAL) as u32
}

/// Equidistant points of its path, or the points of the track that it repeats.
fn path_points(auv: &SimulatedAuv) -> Vec<Vector2<f64>> {
    if let Some(track) = &auv.track {
        return track.outline(PATH_POINTS_MAX as usize);
    }
    let length = auv.path.length();
    let n = (length / PATH_POINT_INTERVAL).ceil();
    #[expect(clippy::cast_possible_truncation, reason = "clamped just here")]
    let n = n.clamp(1.0, f64::from(PATH_POINTS_MAX)) as u32;
    let point = |k| auv.path.at(length * f64::from(k) / f64::from(n)).position;
    (0..=n).map(point).collect()
}

fn vessel_row(vessel: &SimulatedVessel) -> VesselRow {
    let SimulatedVessel { position, course, speed, length, .. } = *vessel;
    VesselRow { position, course, speed, length }
}

fn surface_craft_row(
    world: &World,
    craft: &SurfaceCraft,
    goal: Vector2<f64>,
    snapshot: &Snapshot,
    guidance: Guidance,
) -> SurfaceCraftRow {
    SurfaceCraftRow {
        position: craft.position(),
        heading: wrap(craft.state[2]),
        surge: craft.state[3],
        sway: craft.state[4],
        yaw_rate: craft.state[5],
        thrust_port: craft.state[6],
        thrust_starboard: craft.state[7],
        current: world.water.current(&craft.position(), 0.0),
        goal,
        energy: craft.energy,
        heading_travel: craft.heading_travel,
        known: KnownSurfaceCraft {
            time: snapshot.t_s,
            position: snapshot.asc.position(),
            heading: snapshot.asc.heading(),
            surge: snapshot.asc.speed_mps,
            current: snapshot.current.map(Into::into),
        },
        reference: guidance.reference,
        method: guidance.method,
        serves: guidance.serves,
        manoeuvre: guidance.manoeuvre,
        predicted_rms: guidance.predicted_rms,
        solve_ms: guidance.solve_time.map(|time| 1e3 * time.as_secs_f64()),
    }
}

fn auv_row(world: &World, auv: &SimulatedAuv) -> AuvRow {
    let error = auv.path_error();
    let reference = auv.reference();
    let (surge, pitch) = reference.map_or((0.0, 0.0), |reference| (reference.surge, reference.pitch));
    AuvRow {
        position: auv.position(),
        depth: auv.depth(),
        pitch: auv.pitch(),
        heading: wrap(auv.heading()),
        surge: auv.state[5],
        current: world.water.current(&auv.position(), auv.depth()),
        reference: AuvReference { surge, pitch, heading: auv.heading_reference() },
        path_point: auv.path_point(),
        along_track: error.s_1,
        cross_track: error.y_1,
        known: None,
        service: None,
        craft: None,
        navigation: None,
    }
}

#[cfg(test)]
mod tests {
    use planner::parameters::Parameters;

    use super::*;
    use crate::guide::LosGuide;

    fn short(name: &str) -> Scenario {
        Scenario::named(name).expect("exists").lasting(60.0)
    }

    #[test]
    fn progress_never_falls_and_ends_at_one() {
        let mut seen = vec![];
        let mut guide = LosGuide::new(Parameters::default().los);
        run(&short("paper-tracking"), &mut guide, 0, &mut |done| {
            seen.push(done);
        })
        .expect("runs");
        assert!(seen.is_sorted());
        assert_eq!(seen.last(), Some(&1.0));
    }

    #[test]
    fn a_failing_guide_ends_the_mission_with_its_error() {
        struct Broken;
        impl Guide for Broken {
            fn name(&self) -> &'static str {
                "broken"
            }

            fn guide(&mut self, _: &planner::snapshot::Snapshot) -> Result<Guidance, GuideError> {
                Err("the line is dead".into())
            }
        }
        let error = run(&short("paper-tracking"), &mut Broken, 0, &mut |_| {}).expect_err("fails");
        assert_eq!(error.to_string(), "the line is dead");
    }
}
