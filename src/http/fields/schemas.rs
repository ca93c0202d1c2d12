//! Schemas of values that the code handles as plain text or numbers.

use std::borrow::Cow;

use utoipa::openapi::extensions::Extensions;
use utoipa::openapi::schema::{Schema, SchemaType, Type};
use utoipa::openapi::{ObjectBuilder, RefOr};
use utoipa::{PartialSchema, ToSchema};

/// Schema of a cloud id. Requests are read as text, because text that is not an id is answered as an unknown
/// cloud.
pub struct CloudIdSchema;

impl PartialSchema for CloudIdSchema {
    fn schema() -> RefOr<Schema> {
        let text =
            "The id of a cloud, 64 hexadecimal digits: BLAKE3 of d, n, the points and the normals if given.";
        let schema =
            ObjectBuilder::new().schema_type(SchemaType::Type(Type::String)).pattern(Some("^[0-9a-f]{64}$"));
        schema.description(Some(text)).into()
    }
}

impl ToSchema for CloudIdSchema {
    fn name() -> Cow<'static, str> {
        "CloudId".into()
    }
}

/// Schema of a job id. Requests are read as text, because text that is not an id is answered as an unknown
/// job.
pub struct JobIdSchema;

impl PartialSchema for JobIdSchema {
    fn schema() -> RefOr<Schema> {
        let text = "The id of a job: a UUID of version 7, in lower case.";
        let schema = ObjectBuilder::new()
            .schema_type(SchemaType::Type(Type::String))
            .pattern(Some("^[0-9a-f]{8}-[0-9a-f]{4}-7[0-9a-f]{3}-[89ab][0-9a-f]{3}-[0-9a-f]{12}$"));
        schema.description(Some(text)).into()
    }
}

impl ToSchema for JobIdSchema {
    fn name() -> Cow<'static, str> {
        "JobId".into()
    }
}

/// Schema of a page cursor. Requests are read as text, so that a refusal is an ordinary problem document.
pub struct CursorSchema;

impl PartialSchema for CursorSchema {
    fn schema() -> RefOr<Schema> {
        let text = "Where a page of clouds ends, for the next one. What it is made of may change.";
        let schema = ObjectBuilder::new()
            .schema_type(SchemaType::Type(Type::String))
            .pattern(Some("^[0-9a-f]{1,32}-[0-9a-f]{64}$"));
        schema.description(Some(text)).into()
    }
}

impl ToSchema for CursorSchema {
    fn name() -> Cow<'static, str> {
        "Cursor".into()
    }
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
