//! The OpenAPI document: generated from the code, committed as openapi/openapi.json, tested against it.

use utoipa::openapi::security::{HttpAuthScheme, HttpBuilder, SecurityScheme};
use utoipa::openapi::{Content, RefOr};
use utoipa::{Modify, OpenApi};

use super::problem::ProblemDocument;

/// The parts of the document that no operation declares.
#[derive(OpenApi)]
#[openapi(
    info(
        title = "gramian",
        description = "Geometric kernel interpolation and regression on point clouds, after Guidotti. Post points once; the \
                       factorization of their Gram matrix K + αI is kept, and interpolation, normals, curvatures, surface \
                       operators and Gaussian-process posteriors are served from it. Arrays keep the order of the request, \
                       lengths are in the client's unit, a null marks an entry without a meaningful value, and every error \
                       is an RFC 9457 problem document.",
        license(name = "MIT OR Apache-2.0", identifier = "MIT OR Apache-2.0")
    ),
    servers((url = "/", description = "This server")),
    tags(
        (name = "clouds", description = "Register point clouds and refer to them by id."),
        (name = "values", description = "Functions through values: interpolation, regression, Gaussian processes."),
        (name = "geometry", description = "Normals and curvatures of the surface that a cloud samples."),
        (name = "operators", description = "Surface gradient and Laplace–Beltrami, applied and as matrices."),
        (name = "process", description = "Health, version and problem pages; no key needed."),
    ),
    components(schemas(ProblemDocument<'static>)),
    modifiers(&BearerKeys)
)]
pub struct Document;

struct BearerKeys;

impl Modify for BearerKeys {
    fn modify(&self, document: &mut utoipa::openapi::OpenApi) {
        let scheme = HttpBuilder::new()
            .scheme(HttpAuthScheme::Bearer)
            .description(Some("One of the configured API keys; needed only where keys are configured."));
        let components = document.components.get_or_insert_default();
        components.add_security_scheme("bearer", SecurityScheme::Http(scheme.build()));
    }
}

/// A request and its answer for each operation with a body, by operation id. A test sends the one and compares the other.
pub const EXAMPLES: [(&str, &str); 9] = [
    ("create_cloud", include_str!("../../openapi/examples/create_cloud.json")),
    ("compute_interpolation", include_str!("../../openapi/examples/compute_interpolation.json")),
    ("compute_posterior", include_str!("../../openapi/examples/compute_posterior.json")),
    ("compute_normals", include_str!("../../openapi/examples/compute_normals.json")),
    ("compute_curvatures", include_str!("../../openapi/examples/compute_curvatures.json")),
    ("compute_surface_gradient", include_str!("../../openapi/examples/compute_surface_gradient.json")),
    (
        "assemble_surface_gradient_matrix",
        include_str!("../../openapi/examples/assemble_surface_gradient_matrix.json"),
    ),
    ("compute_laplace_beltrami", include_str!("../../openapi/examples/compute_laplace_beltrami.json")),
    (
        "assemble_laplace_beltrami_matrix",
        include_str!("../../openapi/examples/assemble_laplace_beltrami_matrix.json"),
    ),
];

/// Puts the examples where readers and generators look for them.
pub fn add_examples(document: &mut utoipa::openapi::OpenApi) {
    for item in document.paths.paths.values_mut() {
        let Some(operation) = item.post.as_mut() else { continue };
        let id = operation.operation_id.as_deref().unwrap_or_default();
        let Some((_, text)) = EXAMPLES.iter().find(|(name, _)| *name == id) else { continue };
        // The files are part of the build and read by a test; an unreadable one leaves the operation without an example.
        let Ok(Example { request, response }) = serde_json::from_str(text) else { continue };
        if let Some(RefOr::T(body)) = operation.request_body.as_mut() {
            set_example(body.content.get_mut("application/json"), request);
        }
        for status in ["200", "201"] {
            if let Some(RefOr::T(answer)) = operation.responses.responses.get_mut(status) {
                set_example(answer.content.get_mut("application/json"), response.clone());
            }
        }
    }
}

fn set_example(content: Option<&mut RefOr<Content>>, example: serde_json::Value) {
    if let Some(RefOr::T(content)) = content {
        content.example = Some(example);
    }
}

#[derive(serde::Deserialize)]
struct Example {
    request: serde_json::Value,
    response: serde_json::Value,
}
