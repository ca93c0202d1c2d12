//! The pages below `/docs`, which show the OpenAPI document by means of Swagger UI.

use axum::extract::Path;
use axum::http::HeaderMap;
use axum::response::{Redirect, Response};

use super::site::{File, INDEX, Site, files, packed};
use crate::http::problem::Problem;

/// What the pages may do. Swagger UI writes inline styles, and its style sheet contains icons.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data:; \
     font-src 'self' data:; connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

static FILES: &[File] = files!["openapi/browser":
    "index.html" HTML,
    "initializer.js" SCRIPT,
    "vendor/swagger-ui-bundle.js" SCRIPT,
    "vendor/swagger-ui.css" STYLE,
];

static DOCUMENTATION: Site = Site::new(POLICY, || packed(FILES));

/// Leads to the folder, in which the links of its page are resolved.
pub async fn get_documentation() -> Redirect {
    Redirect::permanent("docs/")
}

/// Returns the page that shows the document.
pub async fn get_documentation_page(headers: HeaderMap) -> Result<Response, Problem> {
    DOCUMENTATION.answer(INDEX, &headers)
}

/// Returns a file that the page loads.
pub async fn get_documentation_file(
    Path(path): Path<String>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    DOCUMENTATION.answer(&path, &headers)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Licences of the files beside them.
    const NOT_SERVED: [&str; 3] =
        ["vendor/LICENSE", "vendor/NOTICE", "vendor/swagger-ui-bundle.js.LICENSE.txt"];

    #[test]
    fn every_file_of_the_documentation_is_served() {
        DOCUMENTATION.assert_complete("openapi/browser", &NOT_SERVED);
    }

    #[test]
    fn vendored_files_are_those_of_swagger_ui_dist_5_32_6() {
        DOCUMENTATION.assert_hashes(&VENDORED);
    }

    /// BLAKE3 of the files.
    const VENDORED: [(&str, &str); 2] = [
        ("vendor/swagger-ui-bundle.js", "00fd09d74bc45f5456263d466d70281e8e648e255bb0c83cacef098bf6c64c7f"),
        ("vendor/swagger-ui.css", "a3842c9e4fbd73fe81c04e480d1a597b30d184a71cf88fec969fb0b8b4bd8b5e"),
    ];
}
