//! The `OpenAPI` document, `/openapi.json`.

use std::sync::LazyLock;

use axum::{body::Bytes, http::header, response::IntoResponse};
use planner::fleet::{CRAFT_MAX, HAND_OVER};
use serde_json::{Map, Value, json};
use utoipa::OpenApi;
use utoipa_axum::{router::OpenApiRouter, routes};

use crate::app_state::AppState;
use crate::edge::access::{self, is_public};
use crate::examples::{self, EXAMPLES};
use crate::missions::routes as calls;
use crate::planning::{batch, batch::FleetValidation, plan, route_files};
use crate::{crafts, health, metrics};
use wire::{FleetResponse, PreviousFleet, SurfaceCraft};

mod limits;
mod rules;

/// Serves the document, whose text is written once.
pub(crate) async fn get_document() -> impl IntoResponse {
    static TEXT: LazyLock<Bytes> =
        LazyLock::new(|| serde_json::to_vec(document()).expect("names, texts and numbers only").into());
    ([(header::CONTENT_TYPE, "application/json")], TEXT.clone())
}

/// The document, which depends on the program only.
pub(crate) fn document() -> &'static Value {
    static DOCUMENT: LazyLock<Value> = LazyLock::new(|| {
        let document = documented().into_openapi();
        let mut document = serde_json::to_value(document).expect("names, texts and numbers only");
        let paths = document["paths"].as_object_mut();
        for call in paths.into_iter().flat_map(Map::values_mut) {
            if let Some(body) = call.pointer_mut("/post/requestBody/content/application~1json/schema") {
                never_null(body);
            }
        }
        rules::name_kinds(&mut document);
        limits::write(&mut document);
        rules::write(&mut document);
        describe_fleets(&mut document);
        link_missions(&mut document);
        describe_events(&mut document);
        describe_tokens(&mut document);
        write_examples(&mut document);
        document
    });
    &DOCUMENT
}

/// Describes the token that calls need when tokens exist, and the refusals without one.
fn describe_tokens(document: &mut Value) {
    document["components"]["securitySchemes"] = json!({ "token": {
        "type": "http",
        "scheme": "bearer",
        "description": "Required as soon as a token exists: `pilotfish token add`.",
    } });
    let refusals = ["401", "403"].map(|status| {
        let refusal = document["paths"]["/v1/plan"]["post"]["responses"][status].clone();
        (status, refusal)
    });
    let paths = document["paths"].as_object_mut().into_iter().flatten();
    for (_, item) in paths.filter(|(path, _)| !is_public(path)) {
        for call in item.as_object_mut().into_iter().flat_map(Map::values_mut) {
            call["security"] = json!([{}, { "token": [] }]);
            if let Some(responses) = call["responses"].as_object_mut() {
                for (status, refusal) in &refusals {
                    responses.entry(*status).or_insert_with(|| refusal.clone());
                }
            }
        }
    }
}

pub(crate) fn documented() -> OpenApiRouter<AppState> {
    #[derive(OpenApi)]
    #[openapi(
        info(
            title = "Pilotfish",
            description = "Formation planner: snapshots of underwater vehicles in, speed and heading references for \
            a surface craft out. Values are in SI units and radians, with the unit in every name. Positions are local \
            north-east-down; headings and courses are 0 at north and positive clockwise. Every refusal is a problem \
            document, except what the HTTP library refuses without a body: malformed HTTP (400), and a head that is \
            longer than 16 KiB or has over 100 headers (431)."
        ),
        components(schemas(SurfaceCraft, PreviousFleet, FleetResponse, FleetValidation))
    )]
    struct Document;

    OpenApiRouter::with_openapi(Document::openapi())
        .routes(routes!(plan::plan))
        .routes(routes!(plan::compare))
        .routes(routes!(batch::plan_batch))
        .routes(routes!(batch::validate_plan))
        .routes(routes!(batch::get_limits))
        .routes(routes!(examples::list_examples))
        .routes(routes!(examples::get_example))
        .routes(routes!(crafts::list_crafts))
        .routes(routes!(calls::create_mission, calls::list_missions))
        .routes(routes!(calls::get_mission, calls::patch_mission, calls::delete_mission))
        .routes(routes!(calls::run_mission))
        .routes(routes!(calls::pause_mission))
        .routes(routes!(calls::finish_mission))
        .routes(routes!(calls::step_mission))
        .routes(routes!(calls::post_reports))
        .routes(routes!(calls::get_reference))
        .routes(routes!(calls::stream_events))
        .routes(routes!(calls::get_record))
        .routes(routes!(calls::get_scene))
        .routes(routes!(route_files::read_route))
        .routes(routes!(access::get_access))
        .routes(routes!(calls::list_orders))
        .routes(routes!(health::livez))
        .routes(routes!(health::readyz))
        .routes(routes!(health::version))
        .routes(routes!(metrics::get_metrics))
}

/// Describes requests and answers of fleets, which have `surface_craft` instead of one craft.
fn describe_fleets(document: &mut Value) {
    let reference = |name: &str| json!({ "$ref": format!("#/components/schemas/{name}") });
    let mut request = document["components"]["schemas"]["PlanRequest"].clone();
    request["description"] =
        json!("The facts of a moment for a fleet: several surface craft that share the AUVs.");
    let members = request["properties"].as_object_mut().expect("are by name");
    members.retain(|name, _| !["asc", "craft", "limits", "previous_plan"].contains(&name.as_str()));
    let craft = json!({ "type": "array", "items": reference("SurfaceCraft"), "minItems": 1, "maxItems": CRAFT_MAX,
        "description": "The surface craft. Each gives way to those before it." });
    let previous = json!({ "oneOf": [reference("PreviousFleet"), { "type": "null" }],
        "description": "The last answer, whole. The service does not store it." });
    members.insert("surface_craft".to_owned(), craft);
    let hand_over = json!({ "type": "number", "minimum": HAND_OVER.start(), "maximum": HAND_OVER.end(),
        "description": "Time for which a craft still serves an AUV that was given to another, s. Default: 0." });
    members.insert("hand_over_s".to_owned(), hand_over);
    members.insert("previous_plan".to_owned(), previous);
    let required = request["required"].as_array_mut().expect("some are");
    required.iter_mut().filter(|name| *name == "asc").for_each(|name| *name = json!("surface_craft"));
    document["components"]["schemas"]["FleetRequest"] = request;
    document["components"]["schemas"]["FleetValidation"]["properties"]["request"] = reference("FleetRequest");
    for (path, answer) in [("/v1/plan", "FleetResponse"), ("/v1/plan/validate", "FleetValidation")] {
        let call = &mut document["paths"][path]["post"];
        for (place, fleet) in [("/requestBody", "FleetRequest"), ("/responses/200", answer)] {
            let schema = call.pointer_mut(&format!("{place}/content/application~1json/schema"));
            let schema = schema.expect("is described");
            *schema = json!({ "oneOf": [schema.take(), reference(fleet)] });
        }
    }
}

/// Links the id of a created mission to the calls about one mission.
fn link_missions(document: &mut Value) {
    let calls = document["paths"].as_object().into_iter().flatten();
    let about_one = calls.filter(|(path, _)| path.starts_with("/v1/missions/{id}"));
    let links: Map<_, _> = about_one
        .flat_map(|(_, calls)| calls.as_object().into_iter().flatten())
        .filter_map(|(_, call)| {
            let id = call["operationId"].as_str()?;
            let link = json!({ "operationId": id, "parameters": { "id": "$response.body#/id" } });
            Some((id.to_owned(), link))
        })
        .collect();
    document["paths"]["/v1/missions"]["post"]["responses"]["201"]["links"] = Value::Object(links);
}

/// Describes a server-sent event by its fields, as in OpenAPI 3.2.
fn describe_events(document: &mut Value) {
    document["components"]["schemas"]["SentEvent"] = json!({
        "type": "object", "required": ["event", "data"],
        "description": "A server-sent event. The `data` of a `gap` holds the numbers `from` and `to` of the missed events.",
        "properties": {
            "id": { "type": "string", "description": "The event's number in the mission." },
            "event": { "type": "string", "description": "The event's `kind`, or `gap`." },
            "retry": { "type": "integer", "description": "When to reconnect after a break, ms." },
            "data": { "type": "string", "contentMediaType": "application/json",
                "contentSchema": { "anyOf": [{ "$ref": "#/components/schemas/Event" }, { "type": "object" }] } },
        },
    });
    let events = &mut document["paths"]["/v1/missions/{id}/events"]["get"]["responses"]["200"];
    events["content"]["text/event-stream"]["schema"] = json!({ "$ref": "#/components/schemas/SentEvent" });
}

/// Describes an optional body that may be absent but not null, unlike utoipa.
fn never_null(schema: &mut Value) {
    let shape = schema.get_mut("oneOf").and_then(Value::as_array_mut);
    let shape = shape.and_then(|shapes| shapes.iter_mut().find(|shape| shape["$ref"].is_string()));
    if let Some(shape) = shape.map(Value::take) {
        *schema = shape;
    }
}

/// Writes an example of each body. A time 0 stands for now.
fn write_examples(document: &mut Value) {
    let snapshot: Value = serde_json::from_str(EXAMPLES[0].body).expect("is a snapshot");
    let track = json!({ "kind": "track", "auv": "auv-1", "offset": { "frame": "polar", "range_m": 10, "bearing_deg": 90 } });
    let fix = json!({ "t_s": 0, "north_m": 10, "east_m": 5, "depth_m": 12, "sigma_m": 1.5 });
    let state = json!({ "north_m": 0, "east_m": 0, "heading_deg": 30, "speed_mps": 0.4 });
    let reports = json!({ "auvs": { "auv-1": [fix] }, "asc": [{ "t_s": 0, "state": state }] });
    let mission = json!({ "schema_version": "1.0", "simulated": { "scenario": "calm", "seed": 1 } });
    for (path, method, example) in [
        ("/v1/plan", "post", snapshot.clone()),
        ("/v1/plan/compare", "post", snapshot.clone()),
        ("/v1/plan/validate", "post", snapshot.clone()),
        ("/v1/plan/batch", "post", json!({ "requests": [snapshot] })),
        ("/v1/missions", "post", mission),
        ("/v1/missions/{id}", "patch", json!({ "goal": track })),
        ("/v1/missions/{id}/run", "post", json!({ "speed_factor": 10 })),
        ("/v1/missions/{id}/step", "post", json!({ "ticks": 1 })),
        ("/v1/missions/{id}/reports", "post", reports),
    ] {
        let content = document["paths"][path][method]["requestBody"]["content"].as_object_mut();
        for body in content.into_iter().flat_map(Map::values_mut) {
            body["example"] = example.clone();
        }
    }
}
