//! Flags for doubtful answers of operators on values.

use crate::http::fields::Flag;
use crate::http::problem::Problem;
use crate::http::serve::answers::surface::SurfaceGeometry;
use crate::http::serve::fitted::Fits;
use gramian_host::compute::JobObserver;
use gramian_numerics::operators::{Operator, OperatorAnswers};

/// Answers of an operator that may be doubtful.
pub struct DoubtfulAnswers<'a> {
    pub operator: Operator,
    pub judged: OperatorAnswers<'a>,
    /// Values at the points of the client's cloud.
    pub values: &'a [f64],
    /// Standard deviations of the answers, if they are known.
    pub deviations: Option<&'a [f64]>,
}

/// Returns the queries that the surface flags, and those at which the values do not support the answers.
///
/// Support is judged by the deviations, if they are known, and by a process learned from the values.
/// Deviations alone suffice if their kernel was learned from the values.
///
/// # Errors
/// 503 or 504 if the computation is cancelled because nobody waits for it any more.
pub fn flags(
    doubted: DoubtfulAnswers<'_>,
    fits: &Fits,
    surface: &SurfaceGeometry,
    observer: &JobObserver,
) -> Result<Vec<Flag>, Problem> {
    let DoubtfulAnswers { operator, judged, values, deviations } = doubted;
    let refused = |error| fits.main.refused(error);
    let mut flags = surface.flags();
    if let Some(deviations) = deviations {
        let uncertain = judged.by_deviations(deviations);
        surface.flag_uncertain(uncertain, &mut flags).map_err(refused)?;
    }
    let learned = fits.learned_beside(values, observer);
    // `Ok(None)` means that the kernel was learned, so its deviations already express what the values say.
    if !matches!(learned, Ok(None)) || deviations.is_none() {
        let judge = |learned: &Option<_>| {
            OperatorAnswers { learned: learned.as_ref(), ..judged }.judge(operator, observer)
        };
        let uncertain = learned.and_then(|learned| judge(&learned));
        surface.flag_uncertain(uncertain, &mut flags).map_err(refused)?;
    }
    Ok(flags)
}
