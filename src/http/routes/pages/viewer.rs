//! The page at `/`, which shows clouds and what the service says about them.

use axum::extract::Path;
use axum::http::HeaderMap;
use axum::response::Response;

use super::site::{File, INDEX, Site, files, packed};
use crate::http::openapi::responses::ProbeProblems;
use crate::http::problem::Problem;

/// What the page may do: scripts, workers, styles and requests of its own origin, and pictures that it makes.
const POLICY: &str = "default-src 'none'; script-src 'self'; worker-src 'self'; style-src 'self'; \
     img-src 'self' blob: data:; connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

static FILES: &[File] = files!["page":
    "index.html" HTML,
    "style.css" STYLE,
    "icon.svg" PICTURE,
    "main.js" SCRIPT,
    "data/dragon.bin" NUMBERS,
    "control/asking.js" SCRIPT,
    "control/clouds.js" SCRIPT,
    "control/elements.js" SCRIPT,
    "control/leaving/request.js" SCRIPT,
    "control/leaving/saving.js" SCRIPT,
    "control/measuring.js" SCRIPT,
    "control/overlay.js" SCRIPT,
    "control/page.js" SCRIPT,
    "control/picture.js" SCRIPT,
    "control/pointer.js" SCRIPT,
    "control/range.js" SCRIPT,
    "control/registered.js" SCRIPT,
    "control/settings.js" SCRIPT,
    "model/examples.js" SCRIPT,
    "model/files.js" SCRIPT,
    "model/formats/arrays.js" SCRIPT,
    "model/formats/columns.js" SCRIPT,
    "model/formats/formats.js" SCRIPT,
    "model/formats/las.js" SCRIPT,
    "model/formats/lzf.js" SCRIPT,
    "model/formats/meshes.js" SCRIPT,
    "model/formats/pcd.js" SCRIPT,
    "model/formats/ply.js" SCRIPT,
    "model/formats/records.js" SCRIPT,
    "model/leaving/export.js" SCRIPT,
    "model/leaving/snippets.js" SCRIPT,
    "model/operations.js" SCRIPT,
    "model/section.js" SCRIPT,
    "model/service.js" SCRIPT,
    "model/spacings.js" SCRIPT,
    "model/state.js" SCRIPT,
    "model/tables.js" SCRIPT,
    "model/tensors.js" SCRIPT,
    "model/turns.js" SCRIPT,
    "reading/cleaning.js" SCRIPT,
    "reading/client.js" SCRIPT,
    "reading/worker.js" SCRIPT,
    "view/body.js" SCRIPT,
    "view/colours.js" SCRIPT,
    "view/extras.js" SCRIPT,
    "view/frame.js" SCRIPT,
    "view/histogram.js" SCRIPT,
    "view/levels.js" SCRIPT,
    "view/material.js" SCRIPT,
    "view/picker.js" SCRIPT,
    "view/readout.js" SCRIPT,
    "view/scene.js" SCRIPT,
    "view/shading.js" SCRIPT,
    "words/effects.js" SCRIPT,
    "words/problems.js" SCRIPT,
    "words/refusal.js" SCRIPT,
    "words/warnings.js" SCRIPT,
    "vendor/three/OrbitControls.js" SCRIPT,
    "vendor/three/three.core.min.js" SCRIPT,
    "vendor/three/three.module.min.js" SCRIPT,
];

static PAGE: Site = Site::new(POLICY, || packed(FILES));

/// See a cloud
///
/// Returns a page that shows clouds in three dimensions with normals, curvatures, meshes and their error
/// bars. It asks this service, and loads nothing from elsewhere.
#[utoipa::path(
    get,
    path = "/",
    tag = "process",
    responses(
        (status = 200, description = "The page", body = String, content_type = "text/html"),
        (status = 304, description = "The client has it already"),
        ProbeProblems
    )
)]
pub async fn get_start_page(headers: HeaderMap) -> Result<Response, Problem> {
    PAGE.answer(INDEX, &headers)
}

/// Returns a file that the page loads.
pub async fn get_page_file(Path(path): Path<String>, headers: HeaderMap) -> Result<Response, Problem> {
    PAGE.answer(&path, &headers)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_file_of_the_page_is_served() {
        PAGE.assert_complete("page", &["data/make_dragon", "vendor/three/LICENSE"]);
    }

    #[test]
    fn the_page_arrives_in_less_than_500_kb() {
        let n_bytes = PAGE.n_compressed_bytes();
        assert!(n_bytes < 500_000, "{n_bytes}");
    }

    #[test]
    fn nothing_is_inline_or_from_elsewhere() {
        for forbidden in ["style=", "<style", "<script>", "onclick", "http://", "https://"] {
            assert!(!PAGE.text(INDEX).contains(forbidden), "{forbidden}");
        }
        for forbidden in ["@import", "url("] {
            assert!(!PAGE.text("style.css").contains(forbidden), "{forbidden}");
        }
    }

    #[test]
    fn vendored_files_are_those_of_three_0_184_0() {
        PAGE.assert_hashes(&VENDORED);
    }

    /// BLAKE3 of the files. In `OrbitControls.js`, the import of three names its file.
    const VENDORED: [(&str, &str); 3] = [
        (
            "vendor/three/three.core.min.js",
            "ea9bce76382aa29701ff54bf518d39eab41df6eee28bfaa35b026073f27bcf42",
        ),
        (
            "vendor/three/three.module.min.js",
            "fbe28e0101f059d49e8921dc6c76daf4ec129eb40c5f418d1c8f88496f309fd6",
        ),
        ("vendor/three/OrbitControls.js", "351d7fb1fdea4fe0df367272ae5ed89d18abf624e28e05b542777aa145dd4726"),
    ];
}
