//! A campaign as a client posts it: JSON of the shape of a campaign file, or the file's own TOML.

use axum::{
    extract::{FromRef, FromRequest, Request},
    http::header,
};
use lab::campaign::{Campaign, CampaignError, CampaignFile, Manifest, ScenarioFiles, Shard};
use serde_json::{Value, json};
use serde_path_to_error::Segment;
use sim::scenario::ScenarioError;
use wire::FieldError;

use super::limits::{self, FILE_BYTES_MAX};
use crate::{
    posted::{Bodies, PostedBytes},
    problem::Problem,
};

/// What errors call the file.
const FILE: &str = "campaign";

/// The content type of TOML. Source: IANA's list of media types.
pub(super) const TOML: &str = "application/toml";

/// A body that was announced as a campaign, not yet read.
#[derive(Debug)]
pub(crate) struct PostedCampaign {
    body: PostedBytes,
    is_toml: bool,
}

/// A campaign that the service flies.
#[derive(Debug)]
pub(super) struct NewCampaign {
    pub(super) campaign: Campaign,
    pub(super) manifest: Manifest,
}

impl<S: Send + Sync> FromRequest<S> for PostedCampaign
where
    Bodies: FromRef<S>,
{
    type Rejection = Problem;

    async fn from_request(request: Request, state: &S) -> Result<Self, Problem> {
        let announced = request.headers().get(header::CONTENT_TYPE);
        let announced = announced
            .and_then(|given| given.to_str().ok())
            .unwrap_or_default();
        let essence = announced.split(';').next().unwrap_or_default().trim();
        let is_toml = essence.eq_ignore_ascii_case(TOML);
        let body = if is_toml {
            PostedBytes::announced_as_text(request, state).await?
        } else {
            let body = PostedBytes::from_request(request, state).await;
            body.map_err(|problem| match problem {
                Problem::NotJson(given) => Problem::NoCampaignFormat(given),
                other => other,
            })?
        };
        Ok(Self { body, is_toml })
    }
}

impl PostedCampaign {
    /// What shows that it is sent again.
    pub(super) fn bytes(&self) -> &[u8] {
        &self.body.bytes
    }

    /// The campaign that it is, if the service flies it. Takes up to some seconds.
    pub(super) fn read(self) -> Result<NewCampaign, Problem> {
        let n = self.body.bytes.len();
        if FILE_BYTES_MAX < n {
            let detail = format!("must be at most {FILE_BYTES_MAX} bytes long, not {n}");
            let error = FieldError::new("", "too_long", detail).given(n);
            return Err(Problem::Invalid(vec![
                error.limit(json!({ "most": FILE_BYTES_MAX })),
            ]));
        }
        let text = if self.is_toml {
            let text = String::from_utf8(self.body.bytes);
            text.map_err(|_| invalid(FieldError::new("", "invalid", "must be UTF-8")))?
        } else {
            toml_of(&self.body.bytes)?
        };
        let with_line = self.is_toml;
        let file = CampaignFile::parse(&text, FILE).map_err(|error| refused(error, with_line))?;
        limits::check_file(&file).map_err(Problem::Invalid)?;
        let nothing_beside = ScenarioFiles::default();
        let campaign =
            Campaign::parse(&text, FILE, nothing_beside).map_err(|error| refused(error, with_line))?;
        limits::check_work(&campaign).map_err(Problem::Invalid)?;
        let manifest = Manifest::of(&campaign, Shard::WHOLE);
        Ok(NewCampaign { campaign, manifest })
    }
}

/// The TOML file that says what `json` says. JSON is read into the file's shape first, so that what is wrong is found where the
/// client wrote it.
fn toml_of(json: &[u8]) -> Result<String, Problem> {
    let value: Value = wire::read(json)?;
    let shape: Result<CampaignFile, _> = serde_path_to_error::deserialize(&value);
    if let Err(error) = shape {
        let pointer: String = error
            .path()
            .iter()
            .map(|segment| match segment {
                Segment::Seq { index } => format!("/{index}"),
                Segment::Map { key } => format!("/{}", step(key)),
                Segment::Enum { variant } => format!("/{variant}"),
                Segment::Unknown => String::new(),
            })
            .collect();
        return Err(invalid(FieldError::new(
            pointer,
            "invalid",
            error.into_inner().to_string(),
        )));
    }
    let value = without_nulls(value);
    toml::to_string(&value).map_err(|error| invalid(FieldError::new("", "invalid", error.to_string())))
}

/// TOML has no null: what is null is left out.
fn without_nulls(value: Value) -> Value {
    match value {
        Value::Object(members) => {
            let given = members.into_iter().filter(|(_, value)| !value.is_null());
            Value::Object(given.map(|(name, value)| (name, without_nulls(value))).collect())
        }
        Value::Array(items) => Value::Array(items.into_iter().map(without_nulls).collect()),
        other => other,
    }
}

/// What is wrong with the file, by the pointer of its member.
fn refused(error: CampaignError, with_line: bool) -> Problem {
    match error {
        CampaignError::Invalid {
            line, field, reason, ..
        } => {
            let detail = if with_line {
                format!("line {line}: {reason}")
            } else {
                reason
            };
            invalid(FieldError::new(pointer_of(&field), "invalid", detail))
        }
        CampaignError::Scenario(error) => {
            let pointer = match &error {
                ScenarioError::Invalid { file, .. } => format!("/scenario_files/{}", step(file)),
                ScenarioError::Unreadable { .. } => "/scenario_files".to_owned(),
            };
            invalid(FieldError::new(pointer, "invalid", error.to_string()))
        }
        error @ CampaignError::Unreadable { .. } => {
            invalid(FieldError::new("", "invalid", error.to_string()))
        }
    }
}

/// A member's name as a step of a pointer (RFC 6901).
pub(super) fn step(name: &str) -> String {
    name.replace('~', "~0").replace('/', "~1")
}

/// `controllers[2].law.name` as `/controllers/2/law/name`.
fn pointer_of(field: &str) -> String {
    if matches!(field, "file" | "syntax") {
        return String::new();
    }
    match field.split_once('.') {
        // What the client calls its files may have dots in it.
        Some(("scenario_files", name)) => format!("/scenario_files/{}", step(name)),
        _ => format!("/{}", field.replace(['.', '['], "/").replace(']', "")),
    }
}

fn invalid(error: FieldError) -> Problem {
    Problem::Invalid(vec![error])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_campaign_comes_of_json_and_of_toml() {
        let json = json!({ "schema_version": "1", "name": "a", "title": "a \"b\"", "replicates": 2, "duration_s": 60,
            "tuning": null, "scenarios": ["crowded"], "craft": ["otter", { "random": { "first": 1, "count": 2 } }],
            "parameters": [{ "key": "knowledge.acoustics.sigma_m", "uniform": [0.5, 5] }],
            "controllers": [{ "name": "p", "planner": { "steps_s": [1, 2.5] }, "variation": { "hull": 2 } },
                { "name": "q", "planner": {}, "variation": "no_surge_lag" }] });
        let toml = r#"
            schema_version = "1"
            name = "a"
            title = 'a "b"'
            replicates = 2
            duration_s = 60
            scenarios = ["crowded"]
            craft = ["otter", { random = { first = 1, count = 2 } }]
            parameters = [{ key = "knowledge.acoustics.sigma_m", uniform = [0.5, 5] }]
            [[controllers]]
            name = "p"
            planner = { steps_s = [1, 2.5] }
            variation = { hull = 2 }
            [[controllers]]
            name = "q"
            planner = {}
            variation = "no_surge_lag"
        "#;
        let text = toml_of(json.to_string().as_bytes()).expect("has the shape");
        let [a, b] = [text.as_str(), toml].map(|text| CampaignFile::parse(text, "test").expect("is read"));
        assert_eq!(a, b);
    }

    #[test]
    fn a_field_of_a_file_is_found_in_json() {
        assert_eq!(pointer_of("controllers[2].law.name"), "/controllers/2/law/name");
        assert_eq!(pointer_of("seed"), "/seed");
        assert_eq!(pointer_of("file"), "");
        assert_eq!(pointer_of("scenario_files.a/b.toml"), "/scenario_files/a~1b.toml");
    }
}
