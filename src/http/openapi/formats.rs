//! The binary media types of operations with a body.

use utoipa::openapi::schema::{KnownFormat, SchemaFormat, SchemaType, Type};
use utoipa::openapi::{Content, ContentBuilder, ObjectBuilder, RefOr};

use super::{id_of, is_direct, operations};
use gramian_host::wire::negotiation::{BodyFormat, Format};

/// Returns the media types other than JSON that an operation accepts and answers with.
fn binary_formats(operation_id: &str) -> (&'static [BodyFormat], &'static [Format]) {
    let requests: &[BodyFormat] = match operation_id {
        "create_cloud" => &[BodyFormat::Safetensors, BodyFormat::Npy, BodyFormat::Ply],
        _ => &[BodyFormat::Safetensors],
    };
    let answers: &[Format] = match operation_id {
        "create_cloud" => &[],
        direct if is_direct(direct) => &[],
        "assemble_surface_gradient_matrix" | "assemble_laplace_beltrami_matrix" => {
            &[Format::Safetensors, Format::Npy]
        }
        "compute_level_set" => &[Format::Safetensors, Format::Ply, Format::Gltf, Format::Obj],
        "compute_normals" | "compute_curvatures" => &[Format::Safetensors, Format::Ply],
        _ => &[Format::Safetensors],
    };
    (requests, answers)
}

/// Adds the binary media types of operations with a body. A test requests each of them from the service.
pub fn add(document: &mut utoipa::openapi::OpenApi) {
    for operation in operations(document) {
        let (requests, answers) = binary_formats(id_of(operation));
        let Some(RefOr::T(body)) = operation.request_body.as_mut() else { continue };
        for &format in requests {
            let content = binary(match format {
                BodyFormat::Npy => "The points, `[n, d]`, as little- or big-endian float64 or float32.",
                BodyFormat::Ply => {
                    "PLY 1.0, ascii or binary of either byte order. The properties x, y, z of element vertex are the points, and \
                     nx, ny, nz their normals if all three are there, of any type of number; other properties and elements are ignored."
                }
                BodyFormat::Json | BodyFormat::Safetensors => {
                    "Safetensors. Each JSON array of numbers becomes an F64 or F32 tensor of the same name, with dots for \
                     nesting (`cloud.points`). All other fields are JSON text in the metadata entry `request`. At most 64 \
                     tensors; header at most 64 KiB."
                }
            });
            body.content.insert(format.media_type().to_owned(), content);
        }
        let Some(RefOr::T(answer)) = operation.responses.responses.get_mut("200") else { continue };
        for &format in answers {
            let content = binary(match format {
                Format::Npy => "The matrix as float64, row by row, NaN for null.",
                Format::Ply => {
                    "PLY 1.0, binary little-endian: vertices as double, normals and quantities as float properties, `quality` for \
                     MeshLab, `support` as 0, 1 or 2 for observed, bridged and extrapolated, and faces or edges."
                }
                Format::Gltf => {
                    "Binary glTF 2.0. Positions are float32 about the middle of the mesh, where the node stands; quantities are \
                     attributes of their own, such as `_MEAN_CURVATURE`."
                }
                Format::Obj => "Wavefront OBJ: vertices, normals, and faces or lines.",
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
