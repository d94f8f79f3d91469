//! Interactive documentation of the API at `/docs`: Swagger UI, built in with the feature `docs`.

use axum::Router;

#[cfg(feature = "docs")]
pub(crate) fn router<S: Clone + Send + Sync + 'static>() -> Router<S> {
    use axum::{
        http::{HeaderValue, StatusCode, header},
        middleware,
        response::{IntoResponse, Response},
    };
    use utoipa_swagger_ui::{Config, SwaggerUi};

    use crate::problem::Problem;

    /// The policy of every answer, and what Swagger UI needs: style attributes, and icons in its style sheet.
    const POLICY: HeaderValue = HeaderValue::from_static(
        "default-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data:; base-uri 'none'; \
         form-action 'none'; frame-ancestors 'none'",
    );

    async fn finished(mut answer: Response) -> Response {
        if answer.status() == StatusCode::NOT_FOUND {
            return Problem::NoRoute.into_response();
        }
        answer
            .headers_mut()
            .insert(header::CONTENT_SECURITY_POLICY, POLICY);
        answer
    }

    // Nothing is sent to Swagger's online validator.
    let config = Config::from("/openapi.json")
        .validator_url("none")
        .try_it_out_enabled(true);
    let ui = Router::from(SwaggerUi::new("/docs").config(config));
    ui.layer(middleware::map_response(finished))
}

#[cfg(not(feature = "docs"))]
pub(crate) fn router<S: Clone + Send + Sync + 'static>() -> Router<S> {
    use axum::routing::get;

    use crate::problem::Problem;

    Router::new().route("/docs", get(async || Problem::NotBuiltIn("docs")))
}
