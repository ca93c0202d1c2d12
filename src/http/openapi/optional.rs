//! Optional members of objects. They are present or absent but never null, while utoipa takes an `Option` for
//! a value that may be null.

use utoipa::openapi::RefOr;
use utoipa::openapi::schema::{Object, Schema, SchemaType, Type};

/// Optional members that may be null. They are always sent, null where a score has no value.
const NULLABLE: [(&str, &str); 2] = [("FamilyScore", "score"), ("AlphaScore", "score")];

/// Removes null from the types of all optional members.
pub fn refuse_null(document: &mut utoipa::openapi::OpenApi) {
    for (name, schema) in &mut document.components.get_or_insert_default().schemas {
        let RefOr::T(Schema::Object(Object { properties, required, .. })) = schema else { continue };
        for (member, property) in properties {
            if !required.contains(member) && !NULLABLE.contains(&(name.as_str(), member.as_str())) {
                remove_null(property);
            }
        }
    }
}

fn remove_null(property: &mut RefOr<Schema>) {
    match property {
        RefOr::T(Schema::Object(object)) => remove_null_type(&mut object.schema_type),
        RefOr::T(Schema::Array(array)) => remove_null_type(&mut array.schema_type),
        RefOr::T(Schema::OneOf(choice)) => {
            choice.items.retain(|item| !is_null(item));
            if choice.items.len() == 1 {
                *property = choice.items.remove(0);
            }
        }
        _ => {}
    }
}

fn remove_null_type(schema_type: &mut SchemaType) {
    if let SchemaType::Array(types) = schema_type {
        types.retain(|one| *one != Type::Null);
        if types.len() == 1 {
            *schema_type = SchemaType::Type(types.remove(0));
        }
    }
}

fn is_null(schema: &RefOr<Schema>) -> bool {
    matches!(schema, RefOr::T(Schema::Object(object)) if object.schema_type == SchemaType::Type(Type::Null))
}
