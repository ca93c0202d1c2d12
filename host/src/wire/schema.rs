//! Schemas of values that the code handles as plain text.

/// Declares the schema of a text with a pattern. Requests are read as any text, so that a refusal is an
/// ordinary problem document.
#[macro_export]
macro_rules! text_schema {
    ($(#[$meta:meta])* $type:ident: $name:literal, $pattern:literal, $text:literal) => {
        $(#[$meta])*
        pub struct $type;

        impl utoipa::PartialSchema for $type {
            fn schema() -> utoipa::openapi::RefOr<utoipa::openapi::schema::Schema> {
                let text = utoipa::openapi::schema::Type::String;
                let text = utoipa::openapi::ObjectBuilder::new().schema_type(utoipa::openapi::schema::SchemaType::Type(text));
                text.pattern(Some($pattern)).description(Some($text)).into()
            }
        }

        impl utoipa::ToSchema for $type {
            fn name() -> std::borrow::Cow<'static, str> {
                $name.into()
            }
        }
    };
}
