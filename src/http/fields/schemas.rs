//! Schemas of values that the code handles as plain text or numbers.

use utoipa::openapi::extensions::Extensions;
use utoipa::openapi::schema::{Schema, SchemaType, Type};
use utoipa::openapi::{ObjectBuilder, RefOr};
use utoipa::{PartialSchema, ToSchema};

use gramian_host::text_schema;

text_schema! {
    /// Schema of a cloud id. Text that is not an id is answered as an unknown cloud.
    CloudIdSchema: "CloudId", "^[0-9a-f]{64}$",
    "The id of a cloud, 64 hexadecimal digits: BLAKE3 of d, n, the points and the normals if given."
}

text_schema! {
    /// Schema of a page cursor.
    CursorSchema: "Cursor", "^[0-9a-f]{1,32}-[0-9a-f]{64}$",
    "Where a page of clouds ends, for the next one. What it is made of may change."
}

/// Schema of `smoothness`. Requests are read as numbers, so that a refusal can list the valid ones.
pub struct Smoothness;

impl PartialSchema for Smoothness {
    fn schema() -> RefOr<Schema> {
        let names = Extensions::builder().add("x-enum-varnames", ["C2", "C4", "C6"]).build();
        ObjectBuilder::new()
            .schema_type(SchemaType::Type(Type::Integer))
            .enum_values(Some([2, 4, 6]))
            .description(Some("How often a Wendland kernel is continuously differentiable."))
            .extensions(Some(names))
            .into()
    }
}

impl ToSchema for Smoothness {}
