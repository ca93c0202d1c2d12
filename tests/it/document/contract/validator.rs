//! A compiled schema.

use boon::{Compiler, Draft, SchemaIndex, Schemas, ValidationError};
use serde_json::Value;

/// Name of the schema among those that it may refer to. It refers to its own parts only.
const NAME: &str = "https://gramian.example/schema";

pub struct Validator {
    schemas: Schemas,
    root: SchemaIndex,
}

impl Validator {
    /// Compiles a schema of draft 2020-12. Fails if it is no schema, or refers to nothing.
    pub fn new(schema: Value) -> Result<Self, String> {
        let mut schemas = Schemas::new();
        let mut compiler = Compiler::new();
        compiler.set_default_draft(Draft::V2020_12);
        compiler.enable_format_assertions();
        compiler.add_resource(NAME, schema).map_err(|error| error.to_string())?;
        let root = compiler.compile(NAME, &mut schemas).map_err(|error| format!("{error:#}"))?;
        Ok(Self { schemas, root })
    }

    /// Returns what is wrong with a value, each with its JSON pointer.
    pub fn errors(&self, value: &Value) -> Vec<String> {
        let mut errors = Vec::new();
        if let Err(error) = self.schemas.validate(value, self.root) {
            collect(&error, value, &mut errors);
        }
        errors
    }
}

/// Adds the errors that have no further cause.
fn collect(error: &ValidationError<'_, '_>, value: &Value, errors: &mut Vec<String>) {
    if error.causes.is_empty() {
        let place = error.instance_location.to_string();
        let found = value.pointer(&place).map_or_else(String::new, Value::to_string);
        errors.push(format!("{place}: {found:.200}: {}", error.kind));
    }
    error.causes.iter().for_each(|cause| collect(cause, value, errors));
}
