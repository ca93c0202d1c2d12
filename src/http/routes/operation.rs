//! Declaration of operations that compute.

/// Declares an operation that computes: its handler, its name, its answer, and its entry in the `OpenAPI`
/// document.
///
/// The documentation is that of the document: a line as summary, and the description. Invocations are not
/// indented, because the document has the line breaks of the description.
macro_rules! operation {
    (
        $(#[$doc:meta])*
        pub async fn $name:ident($request:ident) -> $answer:ident;
        path: $path:literal, tag: $tag:literal, answer: $description:literal
    ) => {
        $(#[$doc])*
        #[utoipa::path(
            post,
            path = $path,
            tag = $tag,
            request_body = $request,
            responses(
                (status = 200, description = $description, body = $answer),
                $crate::http::openapi::responses::ComputeProblems
            )
        )]
        pub async fn $name(
            axum::extract::State(app): axum::extract::State<std::sync::Arc<$crate::http::state::app::App>>,
            axum::Extension(owner): axum::Extension<gramian_host::memory::Owner>,
            request: axum::extract::Request,
        ) -> Result<axum::response::Response, $crate::http::problem::Problem> {
            let operation = $crate::http::serve::operation::AnyOperation::of::<$request>();
            $crate::http::serve::steps::serve(app, owner, request, operation).await
        }

        impl $crate::http::serve::operation::Declared for $request {
            const NAME: &'static str = stringify!($name);
            type Answer = $answer;
        }
    };
}
pub(crate) use operation;
