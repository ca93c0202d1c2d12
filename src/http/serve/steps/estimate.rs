//! The cost of a request, from its plan.

use std::sync::Arc;
use std::time::Instant;

use super::received::Received;
use super::{Call, Step};
use crate::http::compute::Admission;
use crate::http::problem::Problem;
use crate::http::serve::durable::keep_all;
use crate::http::serve::fitting::Outlook;
use crate::http::serve::intake::ReceivedBody;
use crate::http::serve::operation::AnyOperation;
use crate::http::state::app::App;
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
    let call = Call { app, admission, operation: name, wanted: None, began: Instant::now() };
    let mut step = Received { body, parse: parse_named }.parse(&call).await?;
    let resolved = loop {
        step = match step {
            Step::Parsed(parsed) => parsed.plan(&call).await?,
            Step::Planned(planned) => planned.resolve(&call).await?,
            Step::Resolved(resolved) => break resolved,
            Step::Answer(_) => return Err(Problem::internal()),
        };
    };
    let Call { app, admission, operation, .. } = &call;
    keep_all(app, admission.owner, &resolved.fresh).await;
    let outlook = resolved.outlook(&call);
    let seconds = admission.expected_seconds(outlook.as_work(operation));
    let has_memory = outlook.n_bytes <= app.prepared.memory();
    Ok(Estimate {
        solver: resolved.fits.main.recipe.solver(),
        outlook,
        seconds,
        is_admissible: has_memory && seconds <= app.config.deadline_seconds,
    })
}
