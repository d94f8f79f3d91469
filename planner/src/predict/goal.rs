//! The goal's motion, from the AUVs' forecasts.

use nalgebra::Vector2;
use smallvec::SmallVec;

use crate::{
    estimate::Route,
    facts::{
        angle::Course,
        auv::VehicleId,
        evidence::{AuvState, SPEED_AT_REST},
        goal::{Goal, Offset},
        localise::Figure,
        options::Forecast,
        previous_plan::PreviousPlan,
        ranges::AUVS_MAX,
        traffic::Avoidance,
    },
    predict::{
        forecast::{AuvForecast, Intent},
        motion::{Motion, course_from},
        offset::{Axes, displaced},
        smallest_circle::{Below, nearest_to_all},
        vessel::VesselForecast,
    },
    snapshot::build::{KnownAuv, Snapshot},
};

/// Ratio of a velocity to its σ below which a vehicle may rest: its square is χ²'s 99 % quantile.
const DEVIATIONS_AT_REST: f64 = 3.034_854_258_770_293;

/// The motion of the goal and of every AUV.
#[derive(Clone, Debug, PartialEq)]
pub struct GoalForecast {
    /// Forecasts of all AUVs, in the snapshot's order.
    auvs: Vec<AuvForecast>,
    /// The AUVs that the goal depends on, in its order.
    members: Vec<GoalMember>,
    rule: Rule,
    offset: Option<Offset>,
    /// The figure on which the goal moves about the followed point.
    figure: Option<Figure>,
    /// The way on which the goal moves instead, round what is in the way.
    way: Option<Way>,
    /// What is done about other vessels, if any may come near.
    avoidance: Option<Avoidance>,
    vessels: Vec<VesselForecast>,
    /// Last course of the followed point in motion.
    course: Course,
}

/// Places at which the craft is to be, at increasing times after the snapshot, s, from now on.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Way {
    /// Times, s, and places.
    pub(crate) places: Vec<(f64, Vector2<f64>)>,
    /// `false` if no way leads to the goal: this one goes as far as it can.
    pub(crate) is_open: bool,
}

impl Way {
    /// Its motion `ahead` seconds after the snapshot; none after its end.
    fn at(&self, ahead: f64) -> Option<Motion> {
        let later = self.places.iter().position(|(time, _)| ahead < *time)?.max(1);
        let [(begun, from), (arrived, to)] = [self.places.get(later - 1)?, self.places.get(later)?];
        let velocity = (to - from) / (arrived - begun);
        Some(Motion { position: from + velocity * (ahead - begun), velocity })
    }
}

/// The AUV that a visit goal follows for some time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Turn {
    /// Its end, s after the snapshot, half-open.
    pub(crate) until: f64,
    pub(crate) auv: usize,
    /// The leg to it, if the goal is on that instead of at the AUV.
    pub(crate) leg: Option<GoalLeg>,
}

impl Turn {
    /// The only turn, at the AUV with this index in the snapshot.
    pub(crate) fn only(auv: usize) -> Self {
        Self { until: f64::INFINITY, auv, leg: None }
    }
}

/// A straight leg at constant speed: times in s after the snapshot, positions in m (north, east).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct GoalLeg {
    pub(crate) depart: f64,
    pub(crate) arrive: f64,
    pub(crate) from: Vector2<f64>,
    pub(crate) to: Vector2<f64>,
}

impl GoalLeg {
    fn at(&self, ahead: f64) -> Motion {
        let velocity = (self.to - self.from) / (self.arrive - self.depart);
        Motion { position: self.from + velocity * (ahead - self.depart), velocity }
    }
}

/// An AUV that the goal depends on.
#[derive(Clone, Copy, Debug, PartialEq)]
struct GoalMember {
    auv: usize,
    /// Its weight in a mean; the sum over all members is 1.
    share: f64,
    at_rest: AtRest,
}

#[derive(Clone, Debug, PartialEq)]
enum Rule {
    Mean,
    /// Time since the epoch at the snapshot, and the dwell time, s.
    InTurn {
        since_epoch: f64,
        dwell: f64,
    },
    /// Turns in order of time, the last without end; each with its member.
    Scheduled(Vec<(Turn, usize)>),
    NearestToAll,
}

/// Axes of a member without a forecast of them.
#[derive(Clone, Copy, Debug, PartialEq)]
struct AtRest {
    /// Its reported course.
    course: Course,
    /// Tangent angle of the closest point of its path, rad; 0 without a path.
    tangent: f64,
}

impl GoalForecast {
    /// The forecast goal of `snapshot`. A visit goal follows the nearest AUV, since the schedule is
    /// the planner's choice ([`scheduled_goal`](crate::plan::scheduled_goal)). If the followed
    /// point may be at rest, its course is the previous plan's.
    pub fn new(snapshot: &Snapshot) -> Self {
        let previous = snapshot.previous_plan.as_ref();
        Self::holding(snapshot, previous.and_then(PreviousPlan::goal_course))
    }

    /// The goal of `snapshot` with the last course in motion `held`, as [`GoalForecast::course`].
    pub fn holding(snapshot: &Snapshot, held: Option<Course>) -> Self {
        Self::scheduled(snapshot, forecast_all(snapshot), held, &[])
    }

    /// The goal of `snapshot` with the forecasts `auvs`. `turns` are the AUVs that a visit goal
    /// follows, in order of time, the last without end; without turns it follows the nearest.
    pub(crate) fn scheduled(
        snapshot: &Snapshot,
        auvs: Vec<AuvForecast>,
        held: Option<Course>,
        turns: &[Turn],
    ) -> Self {
        let members = members(snapshot, &auvs);
        let mut forecast = Self {
            rule: Rule::of(snapshot, &members, turns, &auvs),
            members,
            auvs,
            offset: snapshot.goal.offset,
            figure: None,
            way: None,
            avoidance: None,
            vessels: Vec::new(),
            course: Course::new(0.0),
        };
        let now = forecast.followed(0.0);
        let still = now.velocity == Vector2::zeros();
        let first = forecast.member_in_turn(0.0).unwrap_or(0);
        let reported = still.then(|| forecast.members[first].at_rest.course);
        forecast.course = course_from(&now, forecast.speed_at_rest(0.0), held.or(reported));
        forecast
    }

    /// The same goal on `figure` about the mean of these AUVs; a schedule's about its first AUV.
    pub(crate) fn on_figure(mut self, figure: Figure, auvs: &[usize]) -> Self {
        if !matches!(self.rule, Rule::Scheduled(_)) {
            self.members.retain(|member| auvs.contains(&member.auv));
            let sum: f64 = self.members.iter().map(|member| member.share).sum();
            for member in &mut self.members {
                member.share /= sum;
            }
        }
        self.figure = Some(figure);
        self
    }

    /// The same goal, which moves on `way` until that ends.
    pub(crate) fn by_way_of(self, way: Way) -> Self {
        Self { way: Some(way), ..self }
    }

    /// The same goal of a craft that keeps clear of `vessels`.
    pub(crate) fn clear_of(self, vessels: Vec<VesselForecast>, avoidance: Avoidance) -> Self {
        Self { vessels, avoidance: Some(avoidance), ..self }
    }

    pub(crate) fn vessels(&self) -> &[VesselForecast] {
        &self.vessels
    }

    pub(crate) fn avoidance(&self) -> Option<&Avoidance> {
        self.avoidance.as_ref()
    }

    /// The figure of a goal that localises, or takes ranges in its visits.
    pub fn figure(&self) -> Option<&Figure> {
        self.figure.as_ref()
    }

    /// `true` for a mean of AUVs, which is the same wherever the craft is.
    pub(crate) fn is_mean(&self) -> bool {
        matches!(self.rule, Rule::Mean) && self.figure.is_none() && self.way.is_none()
    }

    /// `true` if the goal moves on a way round what is in its way.
    pub(crate) fn is_by_way(&self) -> bool {
        self.way.is_some()
    }

    /// `true` unless no way leads to the goal.
    pub(crate) fn is_reachable(&self) -> bool {
        self.way.as_ref().is_none_or(|way| way.is_open)
    }

    /// The goal's motion `ahead` seconds after the snapshot.
    pub fn at(&self, ahead: f64) -> Motion {
        self.way.as_ref().and_then(|way| way.at(ahead)).unwrap_or_else(|| self.wanted(ahead))
    }

    /// The goal's motion without a way round what is in its way.
    ///
    /// The velocity of an offset that turns includes ω × r.
    pub(crate) fn wanted(&self, ahead: f64) -> Motion {
        let followed = self.followed(ahead);
        if let Some(figure) = &self.figure {
            let (place, velocity) = self.on(figure, ahead);
            return Motion { position: followed.position + place, velocity: followed.velocity + velocity };
        }
        let Some(offset) = self.offset else {
            return followed;
        };
        let axes = match offset {
            Offset::Ned { .. } | Offset::Polar { .. } => Axes::NED,
            Offset::Target { .. } => self.target_axes(ahead),
            Offset::Path { .. } => self.path_axes(ahead),
        };
        displaced(&followed, &offset.vector(), axes)
    }

    /// Place on `figure` relative to the followed point, m, and its velocity relative to that, m/s.
    /// A leg of a schedule begins where the craft leaves the figure.
    fn on(&self, figure: &Figure, ahead: f64) -> (Vector2<f64>, Vector2<f64>) {
        let Rule::Scheduled(turns) = &self.rule else { return figure.at(ahead) };
        let first = turns.first().map(|(turn, _)| turn.auv);
        let turn = scheduled(turns, ahead).map(|(turn, _)| turn);
        if let Some(leg) = turn.and_then(|turn| turn.leg) {
            let (place, lasts) = (figure.at(leg.depart).0, leg.arrive - leg.depart);
            (place * ((leg.arrive - ahead) / lasts), -place / lasts)
        } else if turn.map(|turn| turn.auv) == first {
            figure.at(ahead)
        } else {
            (Vector2::zeros(), Vector2::zeros())
        }
    }

    /// Motion of the followed point, without the offset, `ahead` seconds after the snapshot.
    ///
    /// A mean moves with the mean velocity; headings are never averaged. Intervals of an
    /// intermittent goal are half-open, [k T, (k+1) T), also before the epoch. The point nearest to
    /// all moves with the weighted mean of the AUVs that determine it: exact for a rigid formation,
    /// never faster than the fastest, and continuous while they are the same.
    pub fn followed(&self, ahead: f64) -> Motion {
        self.followed_in_turn(ahead, ahead)
    }

    /// Last course of the followed point in motion, without the offset, for the next plan.
    pub fn course(&self) -> Course {
        self.course
    }

    /// Forecasts of the AUVs that the goal depends on, in its order, without those of weight 0.
    pub fn members(&self) -> impl ExactSizeIterator<Item = &AuvForecast> {
        self.members.iter().map(|member| &self.auvs[member.auv])
    }

    /// Indices of the AUVs that the goal needs now: the one in turn, else all members.
    pub(crate) fn needs_now(&self) -> impl Iterator<Item = usize> {
        let turn = self.member_in_turn(0.0);
        let members = self.members.iter().enumerate();
        members.filter(move |(i, _)| turn.is_none_or(|turn| turn == *i)).map(|(_, member)| member.auv)
    }

    /// Forecasts of all AUVs, in the snapshot's order.
    pub fn auvs(&self) -> &[AuvForecast] {
        &self.auvs
    }

    /// Motion `ahead` seconds after the snapshot of the point followed at the time `turn`.
    fn followed_in_turn(&self, turn: f64, ahead: f64) -> Motion {
        if let Rule::Scheduled(turns) = &self.rule
            && let Some(leg) = scheduled(turns, turn).and_then(|(turn, _)| turn.leg)
        {
            return leg.at(ahead);
        }
        match &self.rule {
            Rule::InTurn { .. } | Rule::Scheduled(_) => {
                let member = self.member_in_turn(turn).unwrap_or(0);
                self.auvs[self.members[member].auv].at(ahead)
            }
            Rule::Mean => {
                let shares = self.members.iter().map(|member| member.share);
                weighted_mean(self.members().map(|member| member.at(ahead)).zip(shares))
            }
            Rule::NearestToAll => {
                let motions: SmallVec<[Motion; AUVS_MAX]> =
                    self.members().map(|member| member.at(ahead)).collect();
                let below = motions.iter().zip(self.members()).map(|(motion, member)| Below {
                    position: motion.position,
                    depth: member.depth_at(ahead),
                });
                let nearest = nearest_to_all(&below.collect::<SmallVec<[_; AUVS_MAX]>>());
                Motion {
                    position: nearest.position,
                    velocity: weighted_mean(motions.into_iter().zip(nearest.weights)).velocity,
                }
            }
        }
    }

    /// The followed member `ahead` seconds after the snapshot, if members take turns.
    fn member_in_turn(&self, ahead: f64) -> Option<usize> {
        match &self.rule {
            Rule::InTurn { since_epoch, dwell } => {
                Some(in_turn(since_epoch + ahead, *dwell, self.members.len()))
            }
            Rule::Scheduled(turns) => scheduled(turns, ahead).map(|(_, member)| *member),
            Rule::Mean | Rule::NearestToAll => None,
        }
    }

    fn target_axes(&self, ahead: f64) -> Axes {
        let turn = self.member_in_turn(ahead);
        let held = match turn {
            Some(member) if turn != self.member_in_turn(0.0) => self.members[member].at_rest.course,
            Some(_) | None => self.course,
        };
        let velocity = |time| self.followed_in_turn(ahead, time).velocity;
        Axes::along_course(velocity, self.speed_at_rest(ahead), ahead, held)
    }

    /// Speed below which the point followed at the time `turn` is at rest, m/s.
    fn speed_at_rest(&self, turn: f64) -> f64 {
        let variances = || self.members().map(|member| member.velocity_variance);
        let variance = match (self.member_in_turn(turn), &self.rule) {
            (Some(member), _) => self.auvs[self.members[member].auv].velocity_variance,
            (None, Rule::NearestToAll) => variances().fold(0.0, f64::max),
            (None, Rule::Mean | Rule::InTurn { .. } | Rule::Scheduled(_)) => {
                let shares = self.members.iter().map(|member| member.share.powi(2));
                variances().zip(shares).map(|(variance, share)| variance * share).sum()
            }
        };
        SPEED_AT_REST.max(DEVIATIONS_AT_REST * variance.sqrt())
    }

    fn path_axes(&self, ahead: f64) -> Axes {
        // A checked goal with such an offset follows one AUV at a time.
        let member = &self.members[self.member_in_turn(ahead).unwrap_or(0)];
        let held = (member.at_rest.tangent, 0.0);
        let (angle, rate) = self.auvs[member.auv].tangent(ahead).unwrap_or(held);
        Axes { angle, rate }
    }
}

pub(crate) fn forecast_all(snapshot: &Snapshot) -> Vec<AuvForecast> {
    let current = snapshot.current();
    let forecast = |known: KnownAuv<'_>| {
        let (auv, state) = (known.auv, &known.estimate.state);
        let route = known.estimate.route.as_ref();
        let follows = snapshot.forecast == Forecast::Path || route.is_none_or(Route::is_followed);
        let current = route.filter(|route| route.is_followed()).map_or(current, |route| route.current);
        let repeats = known.estimate.repeats.as_ref();
        let trust = repeats.map_or(1.0, |repeats| repeats.trust);
        let intent = Intent {
            path: known.path.filter(|_| follows),
            fit: route.filter(|route| route.is_followed()).map(|route| &route.fit),
            doubt: 1.0 - trust,
            dive: auv.dive.or(known.estimate.dive),
            forgets_after: known.estimate.forgets_after,
            tuned: &snapshot.tuned().forecast,
        };
        match (&auv.state, snapshot.remembered(&auv.id)) {
            // A client's filter, shown by a covariance, and a fit include what they do not explain.
            (Some(AuvState { covariance: None, .. }), Some((earlier, reported))) if intent.fit.is_none() => {
                let between = snapshot.t_s - state.age_s - reported;
                AuvForecast::after(&earlier, between, state, (intent, snapshot.forecast, &current))
            }
            _ => AuvForecast::new(state, intent, snapshot.forecast, &current),
        }
    };
    snapshot.known_auvs().map(forecast).collect()
}

/// The AUVs that the goal depends on, in its order, with shares that sum to 1.
fn members(snapshot: &Snapshot, forecasts: &[AuvForecast]) -> Vec<GoalMember> {
    let member = |id: &VehicleId| {
        let mut auvs = snapshot.known_auvs().enumerate();
        let (auv, known) = auvs
            .find(|(_, known)| known.auv.id == *id)
            .expect("a snapshot's goal names only vehicles that are in it");
        let share = snapshot.goal.goal.weight(id);
        GoalMember { auv, share, at_rest: AtRest::of(&known, &forecasts[auv]) }
    };
    let mut members: Vec<_> = snapshot.goal.goal.vehicles().map(member).collect();
    let sum: f64 = members.iter().map(|member| member.share).sum();
    for member in &mut members {
        member.share /= sum;
    }
    members
}

impl Rule {
    fn of(snapshot: &Snapshot, members: &[GoalMember], turns: &[Turn], auvs: &[AuvForecast]) -> Self {
        match &snapshot.goal.goal {
            Goal::Track { .. } | Goal::Midpoint { .. } | Goal::Weighted { .. } | Goal::Localise(_) => {
                Self::Mean
            }
            Goal::Intermittent { dwell_s, epoch_s, .. } => {
                Self::InTurn { since_epoch: snapshot.t_s - epoch_s, dwell: *dwell_s }
            }
            Goal::Range { .. } => Self::NearestToAll,
            Goal::Visit(_) => {
                let member = |auv: usize| members.iter().position(|member| member.auv == auv);
                let turns = turns.iter();
                let mut turns: Vec<_> = turns.filter_map(|turn| Some((*turn, member(turn.auv)?))).collect();
                if turns.is_empty() {
                    let member = nearest(snapshot, members, auvs);
                    let auv = members[member].auv;
                    turns.push((Turn::only(auv), member));
                }
                Self::Scheduled(turns)
            }
        }
    }
}

/// The turn at the time `ahead`.
fn scheduled(turns: &[(Turn, usize)], ahead: f64) -> Option<&(Turn, usize)> {
    let now = turns.iter().find(|(turn, _)| ahead < turn.until);
    now.or(turns.last())
}

fn nearest(snapshot: &Snapshot, members: &[GoalMember], auvs: &[AuvForecast]) -> usize {
    let distance = |member: &GoalMember| (auvs[member.auv].at(0.0).position - snapshot.asc.position()).norm();
    let distances = members.iter().map(distance).enumerate();
    let nearest = distances.min_by(|a, b| a.1.total_cmp(&b.1));
    nearest.map_or(0, |(member, _)| member)
}

impl AtRest {
    fn of(known: &KnownAuv<'_>, member: &AuvForecast) -> Self {
        let closest = || {
            let path = &known.path?.path;
            Some(path.at(path.closest(&member.at(0.0).position)).tangent)
        };
        let tangent = member.tangent(0.0).map(|(angle, _)| angle).or_else(closest);
        Self { course: known.estimate.state.course(), tangent: tangent.unwrap_or(0.0) }
    }
}

fn weighted_mean(motions_and_shares: impl Iterator<Item = (Motion, f64)>) -> Motion {
    let still = Motion { position: Vector2::zeros(), velocity: Vector2::zeros() };
    motions_and_shares.fold(still, |sum, (motion, share)| Motion {
        position: sum.position + motion.position * share,
        velocity: sum.velocity + motion.velocity * share,
    })
}

/// The member, of `n`, in turn `elapsed` seconds after the epoch, also before it.
#[expect(clippy::cast_possible_truncation, reason = "rem_euclid by n <= 16 is an integer in 0..n")]
fn in_turn(elapsed: f64, dwell: f64, n: usize) -> usize {
    let turn = (elapsed / dwell).floor();
    (turn.rem_euclid(n as f64) as usize).min(n - 1)
}

#[cfg(test)]
mod tests;
