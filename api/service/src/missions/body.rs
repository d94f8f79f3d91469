//! JSON bodies of calls about missions.

use axum::extract::{FromRef, FromRequest, Request};
use http_body::Body as _;
use serde::de::DeserializeOwned;

use crate::{
    edge::{
        body::{Bodies, BodyBytes},
        problem::Problem,
    },
    planning::{planners::Planners, pool::Priority},
};

/// A JSON body of the shape `T`, of a call about a mission.
#[derive(Debug)]
pub(crate) struct JsonBody<T>(pub(crate) T);

impl<T, S> FromRequest<S> for JsonBody<T>
where
    T: DeserializeOwned + Send + 'static,
    S: Send + Sync,
    Bodies: FromRef<S>,
    Planners: FromRef<S>,
{
    type Rejection = Problem;

    async fn from_request(request: Request, state: &S) -> Result<Self, Problem> {
        let body = BodyBytes::from_request(request, state).await?;
        let (planners, bytes) = (Planners::from_ref(state), body.bytes.len());
        let read = planners.read_body_for_mission(Priority::Long, bytes, || body.read());
        read.await?.map(Self)
    }
}

/// A JSON body of the shape `T`; without a body, the default.
#[derive(Debug)]
pub(crate) struct OptionalJsonBody<T>(pub(crate) T);

impl<T, S> FromRequest<S> for OptionalJsonBody<T>
where
    T: DeserializeOwned + Default + Send + 'static,
    S: Send + Sync,
    Bodies: FromRef<S>,
    Planners: FromRef<S>,
{
    type Rejection = Problem;

    async fn from_request(request: Request, state: &S) -> Result<Self, Problem> {
        if request.body().is_end_stream() {
            return Ok(Self(T::default()));
        }
        let JsonBody(body) = JsonBody::from_request(request, state).await?;
        Ok(Self(body))
    }
}
