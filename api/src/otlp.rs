//! Traces to an OpenTelemetry collector: OTLP over HTTP, by the standard `OTEL_…` variables.

use std::{env, fmt, io, time::Duration};

use async_trait::async_trait;
use bridge::mission_client::proxy_of;
use opentelemetry::trace::{
    SpanContext, SpanId, TraceContextExt as _, TraceFlags, TraceId, TraceState, TracerProvider as _,
};
use opentelemetry_http::{Bytes, HttpClient, HttpError, Request, Response};
use opentelemetry_otlp::{SpanExporter, WithHttpConfig as _};
use opentelemetry_sdk::{Resource, trace::SdkTracerProvider};
use service::TraceContext;
use tracing::{Span, Subscriber};
use tracing_opentelemetry::{OpenTelemetryLayer, OpenTelemetrySpanExt as _};
use tracing_subscriber::registry::LookupSpan;

/// Variables that name a collector. Without one there is no tracer.
const ENDPOINTS: [&str; 2] = ["OTEL_EXPORTER_OTLP_ENDPOINT", "OTEL_EXPORTER_OTLP_TRACES_ENDPOINT"];

/// Longest answer of a collector, bytes.
const ANSWER_BYTES_MAX: u64 = 4 << 20;

/// Time limit of a batch.
const EXPORT_TIME: Duration = Duration::from_secs(10);

/// Sends spans to the collector; the last ones when it is dropped.
pub(crate) struct Tracer(SdkTracerProvider);

impl Tracer {
    /// The tracer, if the environment names a collector and does not disable tracing.
    pub(crate) fn from_environment() -> Option<Self> {
        let off = env::var("OTEL_SDK_DISABLED").is_ok_and(|off| off.eq_ignore_ascii_case("true"))
            || env::var("OTEL_TRACES_EXPORTER").is_ok_and(|exporter| exporter == "none");
        if off || ENDPOINTS.iter().all(|name| env::var_os(name).is_none()) {
            return None;
        }
        let exporter = SpanExporter::builder().with_http().with_http_client(Client::new()).build();
        // The log is not set up yet.
        let exporter = exporter.inspect_err(|error| eprintln!("pilotfish: cannot send traces: {error}"));
        let mut resource = Resource::builder();
        if env::var_os("OTEL_SERVICE_NAME").is_none() {
            resource = resource.with_service_name("pilotfish");
        }
        let provider =
            SdkTracerProvider::builder().with_resource(resource.build()).with_batch_exporter(exporter.ok()?);
        Some(Self(provider.build()))
    }

    pub(crate) fn layer<S>(&self) -> OpenTelemetryLayer<S, opentelemetry_sdk::trace::SdkTracer>
    where
        S: Subscriber + for<'a> LookupSpan<'a>,
    {
        let tracer = self.0.tracer("pilotfish");
        tracing_opentelemetry::layer().with_tracer(tracer).with_location(false).with_threads(false)
    }
}

impl Drop for Tracer {
    fn drop(&mut self) {
        if let Err(error) = self.0.shutdown() {
            tracing::warn!(%error, "cannot send the last traces");
        }
    }
}

/// Names a request's span, puts it into its client's trace, and returns its place there.
pub(crate) fn place(
    span: &Span,
    name: fmt::Arguments<'_>,
    client: Option<TraceContext>,
) -> Option<TraceContext> {
    // Set before the tracer begins the span, which happens when the context is requested.
    span.record("otel.name", name);
    span.record("otel.kind", "server");
    if let Some(TraceContext { trace, span: parent, sampled }) = client {
        let parent = SpanContext::new(
            TraceId::from(trace),
            SpanId::from(parent),
            TraceFlags::default().with_sampled(sampled),
            true,
            TraceState::default(),
        );
        let parent = opentelemetry::Context::new().with_remote_span_context(parent);
        span.set_parent(parent).ok()?;
    }
    let context = span.context();
    let placed = context.span().span_context().clone();
    placed.is_valid().then(|| TraceContext {
        trace: u128::from_be_bytes(placed.trace_id().to_bytes()),
        span: u64::from_be_bytes(placed.span_id().to_bytes()),
        sampled: placed.is_sampled(),
    })
}

/// Sends batches on the tracer's own thread, which may block.
#[derive(Debug)]
struct Client(ureq::Agent);

impl Client {
    fn new() -> Self {
        let config =
            ureq::Agent::config_builder().timeout_global(Some(EXPORT_TIME)).http_status_as_error(false);
        Self(config.build().into())
    }
}

#[async_trait]
impl HttpClient for Client {
    async fn send_bytes(&self, request: Request<Bytes>) -> Result<Response<Bytes>, HttpError> {
        let (head, body) = request.into_parts();
        let proxy = proxy_of(&head.uri.to_string());
        let request = self.0.configure_request(Request::from_parts(head, body.to_vec()));
        let answer = self.0.run(request.proxy(proxy).build())?;
        let (head, mut body) = answer.into_parts();
        let body = body.with_config().limit(ANSWER_BYTES_MAX).read_to_vec();
        let body = body.map_err(io::Error::other)?;
        Ok(Response::from_parts(head, body.into()))
    }
}
