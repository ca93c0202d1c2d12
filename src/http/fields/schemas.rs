//! Schemas of values that the code handles as plain text or numbers.

use std::borrow::Cow;

use utoipa::openapi::extensions::Extensions;
use utoipa::openapi::schema::{Schema, SchemaType, Type};
use utoipa::openapi::{ObjectBuilder, RefOr};
use utoipa::{PartialSchema, ToSchema};

/// Declares the schema of a text with a pattern. Requests are read as any text, so that a refusal is an
/// ordinary problem document.
macro_rules! text_schema {
    ($(#[$meta:meta])* $type:ident: $name:literal, $pattern:literal, $text:literal) => {
        $(#[$meta])*
        pub struct $type;

        impl PartialSchema for $type {
            fn schema() -> RefOr<Schema> {
                let text = ObjectBuilder::new().schema_type(SchemaType::Type(Type::String));
                text.pattern(Some($pattern)).description(Some($text)).into()
            }
        }

        impl ToSchema for $type {
            fn name() -> Cow<'static, str> {
                $name.into()
            }
        }
    };
}

text_schema! {
    /// Schema of a cloud id. Text that is not an id is answered as an unknown cloud.
    CloudIdSchema: "CloudId", "^[0-9a-f]{64}$",
    "The id of a cloud, 64 hexadecimal digits: BLAKE3 of d, n, the points and the normals if given."
}

text_schema! {
    /// Schema of a job id. Text that is not an id is answered as an unknown job.
    JobIdSchema: "JobId", "^[0-9a-f]{8}-[0-9a-f]{4}-7[0-9a-f]{3}-[89ab][0-9a-f]{3}-[0-9a-f]{12}$",
    "The id of a job: a UUID of version 7, in lower case."
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
