//! The OpenAPI document: generated from the code, committed as openapi/openapi.json, tested against it.

use utoipa::openapi::schema::{KnownFormat, SchemaFormat, SchemaType, Type};
use utoipa::openapi::security::{HttpAuthScheme, HttpBuilder, SecurityScheme};
use utoipa::openapi::{Content, ContentBuilder, ObjectBuilder, RefOr};
use utoipa::{Modify, OpenApi};

use super::negotiation::Format;
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
                       is an RFC 9457 problem document. Request bodies may be compressed, by Content-Encoding gzip or zstd, and so \
                       are computed answers in JSON if Accept-Encoding asks for it.",
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

/// What requests and answers may be beside JSON, by operation id.
fn binary_formats(operation_id: &str) -> (&'static [Format], &'static [Format]) {
    match operation_id {
        "create_cloud" => (&[Format::Safetensors, Format::Npy], &[]),
        "assemble_surface_gradient_matrix" | "assemble_laplace_beltrami_matrix" => {
            (&[Format::Safetensors], &[Format::Safetensors, Format::Npy])
        }
        _ => (&[Format::Safetensors], &[Format::Safetensors]),
    }
}

/// Adds the binary media types of operations with a body. A test asks the service for every one.
pub fn add_binary_formats(document: &mut utoipa::openapi::OpenApi) {
    for operation in document.paths.paths.values_mut().filter_map(|item| item.post.as_mut()) {
        let (requests, answers) = binary_formats(operation.operation_id.as_deref().unwrap_or_default());
        if let Some(RefOr::T(body)) = operation.request_body.as_mut() {
            for &format in requests {
                let content = binary(match format {
                    Format::Npy => "The points, `[n, d]`, as little- or big-endian float64 or float32.",
                    Format::Json | Format::Safetensors => {
                        "F64 or F32 tensors named as the JSON arrays, those within objects as `cloud.points`; the other \
                         fields as JSON text in the metadata entry `request`."
                    }
                });
                body.content.insert(format.media_type().to_owned(), content);
            }
        }
        let Some(RefOr::T(answer)) = operation.responses.responses.get_mut("200") else { continue };
        for &format in answers {
            let content = binary(match format {
                Format::Npy => "The matrix as float64, row by row, NaN for null.",
                Format::Json | Format::Safetensors => {
                    "F64 tensors named as the JSON arrays, NaN for null; the other members as JSON text in the metadata \
                     entry `response`."
                }
            });
            answer.content.insert(format.media_type().to_owned(), content);
        }
    }
}

fn binary(description: &str) -> RefOr<Content> {
    let schema = ObjectBuilder::new()
        .schema_type(SchemaType::Type(Type::String))
        .format(Some(SchemaFormat::KnownFormat(KnownFormat::Binary)))
        .description(Some(description));
    RefOr::T(ContentBuilder::new().schema(Some(schema)).build())
}

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
