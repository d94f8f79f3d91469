//! The calls that campaigns answer.

use std::collections::BTreeMap;

use axum::{
    Json,
    extract::{FromRef, FromRequestParts, Path},
    http::{HeaderMap, HeaderValue, StatusCode, header, request::Parts},
    response::{IntoResponse, Response},
};
use serde::Deserialize;
use utoipa::{
    IntoParams, IntoResponses, ToSchema,
    openapi::{self, ContentBuilder, Object, RefOr, ResponseBuilder, Type},
};
use wire::campaign::{Campaign, CampaignList, CampaignStatus};

use super::{
    posted::PostedCampaign,
    registry::{Campaigns, Entry},
    stream,
};
use crate::{
    access::By,
    missions::{
        record::RecordFormat,
        routes::{Asked, IdempotencyKeyHeader, LastEventId, Page, binary, page_length},
    },
    problem::{CampaignRefusals, Problem},
};

/// What a page of a report may load and run: its own styles and pictures, and nothing else.
const REPORT_POLICY: HeaderValue = HeaderValue::from_static(
    "default-src 'none'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'; \
     frame-ancestors 'none'; sandbox",
);

/// The campaign of a path.
#[derive(IntoParams)]
#[into_params(names("id"), parameter_in = Path)]
pub(crate) struct Named(
    /// The campaign's `id`.
    String,
);

impl<S: Send + Sync> FromRequestParts<S> for Named {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Problem> {
        let named = Path::from_request_parts(parts, state).await;
        named.map(|Path(id)| Self(id)).map_err(|_| Problem::NoCampaign)
    }
}

impl<S: Send + Sync> FromRequestParts<S> for Campaigns
where
    Option<Campaigns>: FromRef<S>,
{
    type Rejection = Problem;

    async fn from_request_parts(_: &mut Parts, state: &S) -> Result<Self, Problem> {
        Option::from_ref(state).ok_or(Problem::NoMissions)
    }
}

/// Formats of reports.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, ToSchema)]
#[serde(rename_all = "lowercase")]
pub(crate) enum ReportFormat {
    /// One page that needs nothing else.
    Html,
    /// Markdown with GitHub's tables.
    Markdown,
    /// All numbers, for programs.
    Json,
}

impl ReportFormat {
    const ALL: [Self; 3] = [Self::Json, Self::Html, Self::Markdown];

    fn media_type(self) -> &'static str {
        match self {
            Self::Html => "text/html; charset=utf-8",
            Self::Markdown => "text/markdown; charset=utf-8",
            Self::Json => "application/json",
        }
    }

    fn essence(self) -> &'static str {
        self.media_type().split(';').next().unwrap_or_default()
    }

    fn file(self) -> &'static str {
        match self {
            Self::Html => "report.html",
            Self::Markdown => "report.md",
            Self::Json => "report.json",
        }
    }

    /// The one that is wanted most, by the names in an `Accept` header; JSON where none is named.
    /// Source: RFC 9110, section 12.5.1.
    fn accepted(headers: &HeaderMap) -> Self {
        let given = headers.get_all(header::ACCEPT).iter();
        let given = given.filter_map(|value| value.to_str().ok());
        let mut best = (0.0, Self::Json);
        for range in given.flat_map(|value| value.split(',')) {
            let mut parts = range.split(';').map(str::trim);
            let name = parts.next().unwrap_or_default().to_ascii_lowercase();
            let quality = parts.find_map(|part| part.strip_prefix("q=")?.parse().ok());
            let quality: f64 = quality.unwrap_or(1.0);
            let named = Self::ALL.into_iter().find(|format| format.essence() == name);
            if let Some(format) = named
                && best.0 < quality
            {
                best = (quality, format);
            }
        }
        best.1
    }
}

#[derive(Debug, Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub(crate) struct ReportIn {
    /// Which format. Default: the one that the `Accept` header names, else JSON.
    #[param(inline)]
    format: Option<ReportFormat>,
}

/// A report, by the format that was asked for.
struct Report;

impl IntoResponses for Report {
    fn responses() -> BTreeMap<String, RefOr<openapi::Response>> {
        let mut response = ResponseBuilder::new().description("The report.");
        for format in ReportFormat::ALL {
            let kind = match format {
                ReportFormat::Json => Type::Object,
                ReportFormat::Html | ReportFormat::Markdown => Type::String,
            };
            let content = ContentBuilder::new().schema(Some(Object::with_type(kind)));
            response = response.content(format.essence(), content.build());
        }
        [("200".to_owned(), RefOr::T(response.build()))].into()
    }
}

/// A table, as Parquet.
struct Table;

impl IntoResponses for Table {
    fn responses() -> BTreeMap<String, RefOr<openapi::Response>> {
        let content = ContentBuilder::new().schema(Some(binary())).build();
        let response = ResponseBuilder::new()
            .description("All rows, one a run, to be saved as a file.")
            .content(RecordFormat::Parquet.media_type(), content);
        [("200".to_owned(), RefOr::T(response.build()))].into()
    }
}

/// Has a campaign flown: many missions of many controllers in worlds drawn from one seed.
///
/// The body is a campaign file, as JSON with the same keys or as its own TOML. Its scenarios are built-in ones or stand in
/// `scenario_files`, at most 10; paths are refused. A campaign has at most 64 KiB, 10,000 runs of 2,500 h in all, 100,000 missions that find gains, 1,000 scenarios times craft, 50 drawn craft and 200 controllers. The answer comes when the
/// campaign is on the disk. One thread flies all campaigns, in the order in which they were posted, and steps aside for missions and plans.
#[utoipa::path(post, path = "/v1/campaigns", tag = "campaigns",
    request_body(content((Object = "application/json"), (String = "application/toml"))),
    params(IdempotencyKeyHeader),
    responses((status = 202, description = "It is on the disk, and will be flown.", body = Campaign), CampaignRefusals))]
pub(crate) async fn create_campaign(
    campaigns: Campaigns,
    by: By,
    key: IdempotencyKeyHeader,
    posted: PostedCampaign,
) -> Result<Response, Problem> {
    let key = key.of(&by, "campaign", &posted.bytes())?;
    let campaign = campaigns.create(posted, by.name(), key).await?;
    let location = [(header::LOCATION, format!("/v1/campaigns/{}", campaign.id))];
    Ok((StatusCode::ACCEPTED, location, Json(campaign)).into_response())
}

/// Lists campaigns in the order in which they were posted.
#[utoipa::path(get, path = "/v1/campaigns", tag = "campaigns", params(Page),
    responses((status = 200, description = "Some of them, and where the next ones begin.", body = CampaignList),
        CampaignRefusals))]
pub(crate) async fn list_campaigns(
    campaigns: Campaigns,
    Asked(Page { after, limit }): Asked<Page>,
) -> Result<Json<CampaignList>, Problem> {
    let most = page_length(limit)?;
    let mut listed = campaigns.list(after, most + 1);
    let more = most < listed.len();
    listed.truncate(most);
    Ok(Json(CampaignList {
        next: listed.last().filter(|_| more).map(|(number, _)| *number),
        campaigns: listed.into_iter().map(|(_, campaign)| campaign).collect(),
    }))
}

/// A campaign.
#[utoipa::path(get, path = "/v1/campaigns/{id}", tag = "campaigns", params(Named),
    responses((status = 200, description = "How far it is.", body = Campaign), CampaignRefusals))]
pub(crate) async fn get_campaign(campaigns: Campaigns, Named(id): Named) -> Result<Json<Campaign>, Problem> {
    Ok(Json(campaigns.find(&id)?.seen.borrow().clone()))
}

/// Stops a campaign and forgets it, its rows and its report too.
#[utoipa::path(delete, path = "/v1/campaigns/{id}", tag = "campaigns", params(Named),
    responses((status = 204, description = "It is gone."), CampaignRefusals))]
pub(crate) async fn delete_campaign(campaigns: Campaigns, Named(id): Named) -> Result<StatusCode, Problem> {
    campaigns.delete(&id).await?;
    Ok(StatusCode::NO_CONTENT)
}

/// Stops a campaign, between two plans of the mission that is in the air. One that was stopped before is answered the same.
#[utoipa::path(post, path = "/v1/campaigns/{id}/cancel", tag = "campaigns", params(Named),
    responses((status = 200, description = "It is stopped, for good.", body = Campaign), CampaignRefusals))]
pub(crate) async fn cancel_campaign(
    campaigns: Campaigns,
    Named(id): Named,
) -> Result<Json<Campaign>, Problem> {
    campaigns.cancel(&id).await.map(Json)
}

/// How far a campaign is, as it happens: server-sent events `progress`, and in the end `done`, `cancelled` or `failed`. The data of each is
/// the campaign.
///
/// The first event says how far it is now. A client that reads too slowly misses some, and never the last. Comments in between say that the
/// stream lives.
#[utoipa::path(get, path = "/v1/campaigns/{id}/events", tag = "campaigns", params(Named, LastEventId),
    responses((status = 200, description = "Until the campaign is over.", content_type = "text/event-stream", body = Campaign),
        (status = 204, description = "The campaign is over, and the reader has its last event."), CampaignRefusals))]
pub(crate) async fn stream_campaign(
    campaigns: Campaigns,
    by: By,
    Named(id): Named,
    LastEventId(last): LastEventId,
) -> Result<Response, Problem> {
    let entry = campaigns.find(&id)?;
    stream::events(&campaigns, &entry, by.name(), last)
}

/// The report of a campaign that is done.
#[utoipa::path(
    get,
    path = "/v1/campaigns/{id}/report",
    tag = "campaigns",
    params(Named, ReportIn),
    responses(Report, CampaignRefusals)
)]
pub(crate) async fn get_campaign_report(
    campaigns: Campaigns,
    by: By,
    Named(id): Named,
    Asked(ReportIn { format }): Asked<ReportIn>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    let format = format.unwrap_or_else(|| ReportFormat::accepted(&headers));
    let mut response = sent(&campaigns, &by, &id, format.file(), format.media_type()).await?;
    let headers = response.headers_mut();
    headers.insert(header::CONTENT_SECURITY_POLICY, REPORT_POLICY);
    headers.insert(header::VARY, HeaderValue::from_static("accept"));
    Ok(response)
}

/// All rows of a campaign that is done, one a run, as Apache Parquet.
#[utoipa::path(
    get,
    path = "/v1/campaigns/{id}/runs",
    tag = "campaigns",
    params(Named),
    responses(Table, CampaignRefusals)
)]
pub(crate) async fn get_campaign_runs(
    campaigns: Campaigns,
    by: By,
    Named(id): Named,
) -> Result<Response, Problem> {
    let media_type = RecordFormat::Parquet.media_type();
    let response = sent(&campaigns, &by, &id, "runs.parquet", media_type).await?;
    let name = format!("attachment; filename=\"{id}.parquet\"");
    Ok(([(header::CONTENT_DISPOSITION, name)], response).into_response())
}

/// A file of the campaign called `id`, once it is done.
async fn sent(
    campaigns: &Campaigns,
    by: &By,
    id: &str,
    name: &str,
    media_type: &'static str,
) -> Result<Response, Problem> {
    let entry = campaigns.find(id)?;
    check_done(&entry)?;
    let slot = campaigns.files.take(by.name());
    let slot = slot.map_err(|none| campaigns.no_slot(none, "reports and tables"))?;
    let (length, body) = stream::file(entry.file(name), slot).await?;
    let headers = [
        (header::CONTENT_TYPE, media_type.to_owned()),
        (header::CONTENT_LENGTH, length.to_string()),
    ];
    Ok((headers, body).into_response())
}

fn check_done(entry: &Entry) -> Result<(), Problem> {
    let (status, progress) = {
        let seen = entry.seen.borrow();
        (seen.status, seen.progress)
    };
    let why = match status {
        CampaignStatus::Done => return Ok(()),
        CampaignStatus::Queued => {
            "it waits for the campaigns before it: wait for the event done of …/events".to_owned()
        }
        CampaignStatus::Running => format!(
            "{} of {} runs are done: wait for the event done of …/events",
            progress.runs_done, progress.runs
        ),
        CampaignStatus::Cancelled | CampaignStatus::Failed => {
            format!("it is {}: there is none", status.name())
        }
    };
    Err(Problem::CampaignConflict(why))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_format_that_is_wanted_most_counts() {
        for (accept, wanted) in [
            ("text/html,application/xhtml+xml,*/*;q=0.8", ReportFormat::Html),
            ("*/*", ReportFormat::Json),
            ("text/markdown", ReportFormat::Markdown),
            ("text/html;q=0.2, text/markdown;q=0.9", ReportFormat::Markdown),
            ("image/png", ReportFormat::Json),
        ] {
            let mut headers = HeaderMap::new();
            headers.insert(header::ACCEPT, HeaderValue::from_static(accept));
            assert_eq!(ReportFormat::accepted(&headers), wanted, "{accept}");
        }
    }
}
