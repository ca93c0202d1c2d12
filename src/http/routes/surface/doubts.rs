//! Which answers of operators on values are flagged.

use crate::http::compute::JobObserver;
use crate::http::fields::Degenerate;
use crate::http::problem::Problem;
use crate::http::serve::fitted::Fits;
use crate::http::serve::surface::SurfaceGeometry;
use gramian_numerics::error::NumericsError;
use gramian_numerics::surface::operators::Judged;

/// The queries that the surface flags, and those at which the values do not bear out what was found: by deviations, where they are known, and by
/// `judge` unless those say all of it.
///
/// # Errors
/// 503 and 504 where nobody waits any more.
pub fn degenerate(
    (fits, surface): (&Fits, &SurfaceGeometry),
    values: &[f64],
    judged: Judged<'_>,
    deviations: Option<&[f64]>,
    judge: impl Fn(Judged<'_>) -> Result<Vec<usize>, NumericsError>,
    observer: &JobObserver,
) -> Result<Vec<Degenerate>, Problem> {
    let refused = |error| fits.main.refused(error);
    let mut degenerate = surface.degenerate();
    if let Some(deviations) = deviations {
        let uncertain = judged.by_deviations(deviations);
        surface.flag_uncertain(uncertain, &mut degenerate).map_err(refused)?;
    }
    let learned = fits.learned_beside(values, observer);
    // Deviations of a kernel that was learned say all of it.
    if !matches!(learned, Ok(None)) || deviations.is_none() {
        let uncertain = learned.and_then(|learned| judge(Judged { learned: learned.as_ref(), ..judged }));
        surface.flag_uncertain(uncertain, &mut degenerate).map_err(refused)?;
    }
    Ok(degenerate)
}
