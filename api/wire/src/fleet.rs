//! Requests and answers of fleets: several craft that share the AUVs.

use planner::fleet::{Assignment, CRAFT_MAX, Fleet, HAND_OVER, Member, SlotUse};
use planner::snapshot::AUVS_MAX;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};
use serde_with::skip_serializing_none;
use utoipa::ToSchema;

use super::check::{envelope_faults, origin_faults, with_defaults};
use super::json::{BodyError, Json, Node, ShapeError, parse};
use super::read::in_metres;
use super::response::{Outcome, PlanResponse};
use super::{
    Asc, CraftDescription, CraftFrame, DeclaredLimits, FieldError, PlanRequest, PreviousPlan, VehicleId,
};

/// A surface craft of a fleet.
#[skip_serializing_none]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct SurfaceCraft {
    /// Its name, unique among craft and `traffic`, 1 to 64 bytes.
    #[schema(value_type = String, example = "asc-1")]
    pub id: VehicleId,
    /// Its state, as in a request for one craft.
    pub asc: Asc,
    /// Its closed-loop response, as in a request for one craft. Default: unknown.
    pub craft: Option<CraftDescription>,
    /// Its limits, as in a request for one craft.
    pub limits: Option<DeclaredLimits>,
    /// The AUVs that it may serve, such as those whose modem it has; at most 16. Default: all.
    #[schema(value_type = Option<Vec<String>>)]
    pub serves: Option<Vec<VehicleId>>,
}

/// The last answer to a fleet. The whole answer is accepted; only these members are read.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct PreviousFleet {
    /// Who served whom.
    pub assignment: Assignment,
    /// The craft and their plans, at most 6.
    pub surface_craft: Vec<PreviousOfCraft>,
}

/// A craft in the last answer to a fleet.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct PreviousOfCraft {
    /// Its name.
    #[schema(value_type = String)]
    pub id: VehicleId,
    /// Its plan. Without it, learning restarts.
    pub plan: Option<PreviousPlan>,
}

/// A plan for each craft of a fleet.
#[skip_serializing_none]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct FleetResponse {
    /// Version of this shape: `"1.0"`.
    pub schema_version: String,
    /// `degraded` if that of any craft is.
    pub outcome: Outcome,
    /// Who serves whom.
    pub assignment: Assignment,
    /// The craft, in the order of the request. Each gives way to those before it.
    pub surface_craft: Vec<CraftPlan>,
    /// Slots of the acoustic network, one after the other: transmissions in one slot do not disturb
    /// each other, with twice `acoustics.range_max_m` between all ends. Without that, each has its
    /// own.
    pub slots: Vec<Vec<SlotUse>>,
    /// The request's metadata.
    #[serde(default)]
    #[schema(value_type = Object)]
    pub metadata: Map<String, Value>,
}

/// What one craft of a fleet is to do.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CraftPlan {
    /// Its name.
    #[schema(value_type = String)]
    pub id: VehicleId,
    /// Its plan, with those AUVs in `targets` that it serves; of the method `hold`, a stop, for a
    /// spare craft.
    pub plan: PlanResponse,
}

impl CraftPlan {
    /// The plan of the craft at an index, by `assignment`.
    pub fn new(craft: usize, assignment: &Assignment, mut plan: PlanResponse) -> Self {
        plan.targets.retain(|target| Fleet::tells_of(craft, assignment, &target.id));
        Self { id: assignment.craft[craft].id.clone(), plan }
    }
}

/// A request to plan for a fleet.
#[derive(Clone, Debug)]
pub struct FleetRequest {
    craft: Vec<Member>,
    before: Option<Assignment>,
    /// Craft with a previous plan that are no longer there.
    gone: Vec<Member>,
    /// Time for which a craft still serves an AUV that it hands over, s.
    hand_over_s: f64,
}

impl FleetRequest {
    /// The request of `craft`, at least one, with the previous assignment. Of those that are `gone`
    /// only the previous plan counts.
    pub fn new(craft: Vec<Member>, before: Option<Assignment>, gone: Vec<Member>) -> Self {
        Self { craft, before, gone, hand_over_s: 0.0 }
    }

    /// The request whose craft still serve AUVs for that time, s, after these were given to another.
    #[must_use]
    pub fn handing_over(self, hand_over_s: f64) -> Self {
        Self { hand_over_s, ..self }
    }

    /// The same without what any craft remembers.
    #[must_use]
    pub fn without_previous_plans(mut self) -> Self {
        self.craft.iter_mut().chain(&mut self.gone).for_each(|member| member.request.previous_plan = None);
        self
    }

    /// Reads `body`, an object with `surface_craft`.
    pub fn read(body: &[u8]) -> Result<Self, BodyError> {
        in_metres(parse(body)?, None, Self::of)
    }

    fn of(json: &mut Json<'_>) -> Result<Self, ShapeError> {
        let Json::Object(members) = json else {
            return Err(ShapeError::new(String::new(), "wrong_type", "must be an object"));
        };
        for name in ["asc", "craft", "limits"] {
            if members.iter().any(|(given, _)| given == name) {
                let detail = "each of `surface_craft` has its own: leave this one out";
                return Err(ShapeError::new(format!("/{name}"), "contradicts", detail));
            }
        }
        let mut take = |name: &str| {
            let place = members.iter().position(|(given, _)| given == name);
            place.map(|place| members.remove(place).1)
        };
        let (craft, previous) = (take("surface_craft"), take("previous_plan"));
        let hand_over_s = take("hand_over_s").unwrap_or(Json::Null);
        let hand_over_s = Option::<f64>::deserialize(Node::whole(&hand_over_s))
            .map_err(|wrong| wrong.within("hand_over_s"))?
            .unwrap_or(0.0);
        if let Some(fault) = FieldError::outside("/hand_over_s", hand_over_s, &HAND_OVER) {
            return Err(ShapeError(Box::new(fault)));
        }
        let craft = craft.unwrap_or(Json::Null);
        let craft = Vec::<SurfaceCraft>::deserialize(Node::whole(&craft))
            .map_err(|wrong| wrong.within("surface_craft"))?;
        if let Some(length) = FieldError::of_length("/surface_craft", craft.len(), &(1..=CRAFT_MAX), "items")
        {
            return Err(ShapeError(Box::new(length)));
        }
        let previous = previous.unwrap_or(Json::Null);
        let previous = Option::<PreviousFleet>::deserialize(Node::whole(&previous))
            .map_err(|wrong| wrong.within("previous_plan"))?;
        // The shape of a request for one craft has one.
        let nowhere = ["north_m", "east_m", "heading_rad", "speed_mps"];
        let nowhere = nowhere.map(|name| (name.into(), Json::Number(0.into())));
        members.push(("asc".into(), Json::Object(nowhere.into())));
        let shared = PlanRequest::deserialize(Node::whole(json))?;
        let (before, plans) = previous.map(|fleet| (fleet.assignment, fleet.surface_craft)).unzip();
        let plans = plans.unwrap_or_default();
        let of = |length: fn(&Assignment) -> usize| before.as_ref().map_or(0, length);
        let lists = before.iter().flat_map(|before| &before.craft).map(|craft| craft.auvs.len());
        let longest = lists.max().unwrap_or(0);
        let lengths = [
            ("surface_craft", plans.len(), CRAFT_MAX),
            ("assignment/craft", of(|before| before.craft.len()), CRAFT_MAX),
            ("assignment/craft", longest, AUVS_MAX),
            ("assignment/hand_overs", of(|before| before.hand_overs.len()), CRAFT_MAX * AUVS_MAX),
            ("assignment/unserved", of(|before| before.unserved.len()), AUVS_MAX),
        ];
        for (list, n, most) in lengths {
            let place = format!("/previous_plan/{list}");
            if let Some(length) = FieldError::of_length(place, n, &(0..=most), "items") {
                return Err(ShapeError(Box::new(length)));
            }
        }
        let mut plans: Vec<_> = plans.into_iter().enumerate().collect();
        let member = |SurfaceCraft { id, asc, craft, limits, serves }: SurfaceCraft| {
            let before = plans.iter_mut().find(|(_, before)| before.id == id);
            let (place_before, previous_plan) =
                before.map_or((0, None), |(place, before)| (*place, before.plan.take()));
            let request = PlanRequest { asc, craft, limits, previous_plan, ..shared.clone() };
            Member { id, serves, is_away: false, place_before, request }
        };
        let craft: Vec<_> = craft.into_iter().map(member).collect();
        let gone = plans.into_iter().filter_map(|(place_before, PreviousOfCraft { id, plan })| {
            let request = PlanRequest { previous_plan: Some(plan?), ..craft[0].request.clone() };
            Some(Member { id, serves: Some(Vec::new()), is_away: true, place_before, request })
        });
        Ok(Self { gone: gone.collect(), craft, before, hand_over_s })
    }

    /// What all craft share, with the members of the first one.
    pub fn shared(&self) -> &PlanRequest {
        &self.craft[0].request
    }

    /// The request as a body, with the defaults of its `fleet`.
    pub fn with_defaults(self, fleet: &Fleet) -> Map<String, Value> {
        let json = |value: Value| if let Value::Object(members) = value { members } else { Map::new() };
        let mut members = json(json!(self.shared()));
        let plans = self.craft.iter().chain(&self.gone).filter_map(|member| {
            let plan = Some(member.request.previous_plan.clone()?);
            Some(PreviousOfCraft { id: member.id.clone(), plan })
        });
        let surface_craft = plans.collect();
        let previous = self.before.map(|assignment| PreviousFleet { assignment, surface_craft });
        let craft = self.craft.into_iter().zip(fleet.snapshots()).map(|(member, snapshot)| {
            let PlanRequest { asc, craft, limits, .. } = with_defaults(member.request, snapshot);
            SurfaceCraft { id: member.id, asc, craft, limits, serves: member.serves }
        });
        members.retain(|name, _| !["asc", "craft", "limits", "previous_plan"].contains(&name.as_str()));
        members.extend(json(json!({
            "surface_craft": craft.collect::<Vec<_>>(), "hand_over_s": self.hand_over_s, "previous_plan": previous,
        })));
        members
    }

    /// The checked fleet, in the frame at its first craft if it has an origin. Once `due`,
    /// estimates use the newest reports alone.
    ///
    /// # Errors
    /// All faults of the request.
    pub fn fleet(mut self, due: &dyn Fn() -> bool) -> Result<Fleet, Vec<FieldError>> {
        let first = &mut self.craft[0].request;
        let plan = first.previous_plan.take();
        let mut faults = envelope_faults(first);
        first.previous_plan = plan;
        let origin = first.origin;
        for Member { request, place_before, .. } in self.craft.iter().chain(&self.gone) {
            let place = format!("/previous_plan/surface_craft/{place_before}/plan/origin");
            let before = request.previous_plan.as_ref().and_then(|plan| plan.origin);
            faults.extend(before.iter().flat_map(|before| origin_faults(before, origin.as_ref(), &place)));
        }
        faults.extend(Member::faults(&self.craft, &self.gone));
        if !faults.is_empty() {
            return Err(faults);
        }
        let at = self.shared().asc.position();
        for member in self.craft.iter_mut().chain(&mut self.gone) {
            CraftFrame::enter(&mut member.request, at);
        }
        let fleet = Fleet::new(self.craft, (self.before.as_ref(), &self.gone), due)?;
        Ok(fleet.handing_over(self.hand_over_s))
    }
}

/// `true` if a body is one of a fleet: it has the member `surface_craft`.
pub fn is_of_fleet(body: &[u8]) -> bool {
    const MEMBER: &[u8] = b"\"surface_craft\"";
    let may_be = body.windows(MEMBER.len()).any(|part| part == MEMBER);
    may_be && parse(body).is_ok_and(|json| json.member("surface_craft").is_some())
}
