//! Serves compute requests that need no model: read, admit, parse, compute, encode.

use std::sync::Arc;

use axum::extract::Request;
use axum::http::header;
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use serde::de::DeserializeOwned;

use super::planner::Planner;
use crate::http::problem::Problem;
use crate::http::state::app::App;
use gramian_host::compute::{JobObserver, Work};
use gramian_host::memory::Owner;
use gramian_host::operation::REQUEST_FORMATS;
use gramian_host::operation::intake::read_body;
use gramian_host::wire::write::json::{HasNull, to_vec};
use gramian_numerics::machine::price::Price;

/// A request that needs no model.
pub trait DirectOperation: DeserializeOwned + Send + 'static {
    /// Operation id in the `OpenAPI` document.
    const NAME: &'static str;
    type Answer: Serialize + Send + 'static;

    /// Bytes and flops of the computation, known from the request alone.
    fn price(&self) -> Price;

    /// Checks the request and computes its answer on the pool.
    ///
    /// # Errors
    /// Returns the [`Problem`] for the client.
    fn compute(self, planner: &Planner<'_>, observer: &JobObserver) -> Result<Self::Answer, Problem>;
}

/// Serves one request.
///
/// # Errors
/// Returns the [`Problem`] for the client.
pub async fn serve<D: DirectOperation>(
    app: Arc<App>,
    owner: Owner,
    request: Request,
) -> Result<Response, Problem> {
    let (parts, body) = request.into_parts();
    let intake = read_body(&app, owner, &parts.headers, body, &REQUEST_FORMATS).await?;
    let admission = app.compute.admit(owner)?;
    let (shared, flops_to_parse) = (app.clone(), intake.body.flops_to_parse());
    let parse = move |observer: &JobObserver| intake.parse::<D>(&shared, observer);
    let (request, mut memory) = app.compute.run(&admission, flops_to_parse, parse).await?.0?;
    let Price { n_bytes, flops } = request.price();
    if !memory.try_grow(n_bytes) {
        return Err(app.compute.out_of_memory());
    }
    admission.set_work(Work { operation: D::NAME, is_cached: false, flops });
    let shared = app.clone();
    let compute = move |observer: &JobObserver| {
        let answer = request.compute(&Planner::new(&shared, owner), observer)?;
        // Request and working memory are freed. The answer is no larger than its request, and is not counted.
        drop(memory);
        // Encoded on the pool, since answers may be long. NaN would become null, which is a bug here.
        to_vec(&answer).map_err(|HasNull| Problem::internal())
    };
    let text = app.compute.run(&admission, flops, compute).await?.0?;
    admission.finish();
    Ok(([(header::CONTENT_TYPE, "application/json")], text).into_response())
}
