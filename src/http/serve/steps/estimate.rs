//! The cost of a request, from its plan.

use std::sync::Arc;

use super::parsed::ParsedRequest;
use super::{OnCall, Step};
use crate::http::problem::Problem;
use crate::http::serve::durable::keep_all;
use crate::http::serve::operation::AnyOperation;
use crate::http::state::app::App;
use gramian_host::compute::{Admission, JobObserver};
use gramian_host::operation::intake::ReceivedBody;
use gramian_host::operation::{self, Outlook};
use gramian_numerics::error::SolverKind;

/// Estimated needs of a request.
pub struct Estimate {
    pub solver: SolverKind,
    pub outlook: Outlook,
    /// Seconds of work, without the wait for a turn.
    pub seconds: f64,
    /// Whether memory and time are enough for the request, if nothing else runs.
    pub is_admissible: bool,
}

/// Plans a request without answering it. The body has the name of the operation as a further member.
///
/// Clouds and values are examined as for the request itself, which then finds the results.
///
/// # Errors
/// Returns the refusals that the request itself would get before anything is computed.
pub async fn estimate(
    app: Arc<App>,
    admission: Arc<Admission>,
    body: ReceivedBody,
    operation: AnyOperation,
) -> Result<Estimate, Problem> {
    let AnyOperation { name, parse_named, .. } = operation;
    let on = OnCall { call: operation::unanswered(app.host.clone(), admission, name), app };
    let flops = body.body.flops_to_parse();
    let parse = move |on: &OnCall, observer: &JobObserver| {
        let (body, memory) = body.unpack(&on.app, observer)?;
        let request = parse_named(&body, &on.app.context(observer))?;
        drop(body);
        ParsedRequest::begin(on, request, memory, observer)
    };
    let mut step = on.run(flops, parse).await?;
    let resolved = loop {
        step = match step {
            Step::Parsed(parsed) => parsed.plan(&on).await?,
            Step::Planned(planned) => planned.resolve(&on).await?,
            Step::Resolved(resolved) => break resolved,
            Step::Answer(_) => return Err(Problem::internal()),
        };
    };
    keep_all(&on.app, on.owner(), &resolved.fresh).await;
    let outlook = resolved.outlook(&on);
    let seconds = on.call.expected_seconds(outlook);
    let has_memory = outlook.n_bytes <= on.app.prepared.memory();
    Ok(Estimate {
        solver: resolved.fits.main.recipe.solver(),
        outlook,
        seconds,
        is_admissible: has_memory && seconds <= on.app.settings.deadline_seconds,
    })
}
