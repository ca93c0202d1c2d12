//! Names that were changed before the first publication: what they are called now.
//!
//! A request that uses an old name is refused with the new one. Answers never have an old name.

use axum::http::Uri;
use gramian_host::around::middleware;
use gramian_host::problem::Problem;
use gramian_host::wire::read::renamed::RenamedWord;

/// Words of requests.
pub const WORDS: [RenamedWord; 7] = [
    RenamedWord { old: "deviations", new: "std" },
    RenamedWord { old: "geometry", new: "surface" },
    RenamedWord { old: "surface", new: "surface_model" },
    RenamedWord { old: "surface", new: "model" },
    RenamedWord { old: "local", new: "regression" },
    RenamedWord { old: "variance", new: "variances" },
    RenamedWord { old: "observation_variance", new: "observation_variances" },
];

/// Paths, which stand below `/v1/tiles` now.
const TILES: [&str; 3] = ["coarse", "regions", "sides"];

/// 404 for a path that does not exist. Names the new path of an old one.
pub async fn not_found(uri: Uri) -> Problem {
    let below = uri.path().strip_prefix("/v1/");
    match below.filter(|name| TILES.contains(name)) {
        Some(name) => Problem::new(
            gramian_host::problem::catalogue::NOT_FOUND,
            format!("/v1/{name} is called /v1/tiles/{name}"),
        ),
        None => middleware::not_found().await,
    }
}
