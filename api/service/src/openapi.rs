//! What `/openapi.json` says of the service.

use std::sync::LazyLock;

use serde_json::{Map, Value, json};
use utoipa::OpenApi;
use utoipa_axum::{router::OpenApiRouter, routes};

use crate::{
    Shared,
    access::{self, is_public},
    batch, campaigns, crafts, examples, health, metrics, missions, planning,
};

mod campaign_file;
mod limits;
mod rules;

/// The document, which is the same as long as the program is.
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
        campaign_file::write(&mut document);
        limits::write(&mut document);
        rules::write(&mut document);
        link(&mut document, "/v1/missions", "201");
        link(&mut document, "/v1/campaigns", "202");
        describe_events(&mut document);
        describe_tokens(&mut document);
        document
    });
    &DOCUMENT
}

/// Says which calls need a token where the service asks for tokens, and how they are refused without one.
fn describe_tokens(document: &mut Value) {
    document["components"]["securitySchemes"] = json!({ "token": {
        "type": "http",
        "scheme": "bearer",
        "description": "Needed once a token was made: `pilotfish token add`.",
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

/// The routes that the document lists.
pub(crate) fn documented() -> OpenApiRouter<Shared> {
    #[derive(OpenApi)]
    #[openapi(info(
        title = "Pilotfish",
        description = "Formation planner: snapshots of underwater vehicles in, speed and heading references for \
            a surface craft out. SI units and radians, named in every field; positions are local north-east-down; \
            headings and courses are 0 at north, positive clockwise. Every refusal is a problem document, but for \
            what the HTTP library refuses before the service sees it, with no body: malformed HTTP (400), a path over \
            64 KiB (414), and a head that is too long or has over 100 headers (431)."
    ))]
    struct Document;

    OpenApiRouter::with_openapi(Document::openapi())
        .routes(routes!(planning::plan))
        .routes(routes!(planning::compare))
        .routes(routes!(batch::plan_batch))
        .routes(routes!(batch::validate_plan))
        .routes(routes!(batch::get_limits))
        .routes(routes!(examples::list_examples))
        .routes(routes!(examples::get_example))
        .routes(routes!(crafts::list_crafts))
        .routes(routes!(
            missions::routes::create_mission,
            missions::routes::list_missions
        ))
        .routes(routes!(
            missions::routes::get_mission,
            missions::routes::patch_mission,
            missions::routes::delete_mission
        ))
        .routes(routes!(missions::routes::run_mission))
        .routes(routes!(missions::routes::pause_mission))
        .routes(routes!(missions::routes::finish_mission))
        .routes(routes!(missions::routes::step_mission))
        .routes(routes!(missions::routes::post_reports))
        .routes(routes!(missions::routes::get_reference))
        .routes(routes!(missions::routes::stream_events))
        .routes(routes!(missions::routes::get_record))
        .routes(routes!(missions::routes::get_scene))
        .routes(routes!(
            campaigns::routes::create_campaign,
            campaigns::routes::list_campaigns
        ))
        .routes(routes!(
            campaigns::routes::get_campaign,
            campaigns::routes::delete_campaign
        ))
        .routes(routes!(campaigns::routes::cancel_campaign))
        .routes(routes!(campaigns::routes::stream_campaign))
        .routes(routes!(campaigns::routes::get_campaign_report))
        .routes(routes!(campaigns::routes::get_campaign_runs))
        .routes(routes!(access::get_access))
        .routes(routes!(missions::routes::list_orders))
        .routes(routes!(health::livez))
        .routes(routes!(health::readyz))
        .routes(routes!(health::version))
        .routes(routes!(metrics::get_metrics))
}

/// Where what is answered, with `status`, about something that was made at `path` is used.
fn link(document: &mut Value, made_at: &str, status: &str) {
    let calls = document["paths"].as_object().into_iter().flatten();
    let of_one = format!("{made_at}/{{id}}");
    let about_one = calls.filter(|(path, _)| path.starts_with(&of_one));
    let links: Map<_, _> = about_one
        .flat_map(|(_, calls)| calls.as_object().into_iter().flatten())
        .filter_map(|(_, call)| {
            let id = call["operationId"].as_str()?;
            let link = json!({ "operationId": id, "parameters": { "id": "$response.body#/id" } });
            Some((id.to_owned(), link))
        })
        .collect();
    document["paths"][made_at]["post"]["responses"][status]["links"] = Value::Object(links);
}

/// A server-sent event by its fields, as OpenAPI 3.2 has them.
fn describe_events(document: &mut Value) {
    document["components"]["schemas"]["SentEvent"] = json!({
        "type": "object", "required": ["event", "data"],
        "description": "A server-sent event. The `data` of a `gap` are the numbers `from` and `to` of the events missed.",
        "properties": {
            "id": { "type": "string", "description": "The event's number in the mission." },
            "event": { "type": "string", "description": "The event's `kind`, or `gap`." },
            "retry": { "type": "integer", "description": "When to come again after a break, ms." },
            "data": { "type": "string", "contentMediaType": "application/json",
                "contentSchema": { "anyOf": [{ "$ref": "#/components/schemas/Event" }, { "type": "object" }] } },
        },
    });
    document["components"]["schemas"]["SentProgress"] = json!({
        "type": "object", "required": ["event", "data"],
        "description": "A server-sent event of a campaign.",
        "properties": {
            "id": { "type": "string", "description": "A number that grows with what is done." },
            "event": { "type": "string", "enum": ["progress", "done", "cancelled", "failed"] },
            "retry": { "type": "integer", "description": "When to come again after a break, ms." },
            "data": { "type": "string", "contentMediaType": "application/json",
                "contentSchema": { "$ref": "#/components/schemas/Campaign" } },
        },
    });
    for (path, shape) in [
        ("/v1/missions/{id}/events", "SentEvent"),
        ("/v1/campaigns/{id}/events", "SentProgress"),
    ] {
        let events = &mut document["paths"][path]["get"]["responses"]["200"];
        let shape = format!("#/components/schemas/{shape}");
        events["content"]["text/event-stream"]["schema"] = json!({ "$ref": shape });
    }
}

/// A body may be left out where utoipa takes it for null, which is refused.
fn never_null(schema: &mut Value) {
    let shape = schema.get_mut("oneOf").and_then(Value::as_array_mut);
    let shape = shape.and_then(|shapes| shapes.iter_mut().find(|shape| shape["$ref"].is_string()));
    if let Some(shape) = shape.map(Value::take) {
        *schema = shape;
    }
}
