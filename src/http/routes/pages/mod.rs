//! HTML pages for people: the page that shows clouds, the OpenAPI document in a browser, and explanations of
//! problems. No page needs a key.
//!
//! Links are relative, so that they work behind a proxy that serves everything below a path prefix.

pub mod documentation;
mod site;
pub mod viewer;

use std::fmt::Write;

use axum::extract::Path;
use axum::response::Html;

use crate::http::openapi::responses::{PageProblems, ProbeProblems};
use crate::http::problem::catalogue;
use crate::http::problem::{self, Problem};

/// List the problems
///
/// Returns a page with every type of problem, and a link to the page of each.
#[utoipa::path(
    get,
    path = "/problems",
    tag = "process",
    responses((status = 200, description = "The list", body = String, content_type = "text/html"), ProbeProblems)
)]
pub async fn list_problem_pages() -> Html<String> {
    let mut body = String::from("<dl>\n");
    for slug in problem::all() {
        let (name, status, title) = (slug.as_str(), slug.status().as_u16(), slug.title());
        let _ = writeln!(body, "<dt><a href=\"problems/{name}\">{name}</a> ({status})</dt><dd>{title}</dd>");
    }
    page("Problems", &(body + "</dl>"))
}

/// Explain a problem
///
/// Returns the page behind the `type` of a problem document: its meaning, and what to do.
#[utoipa::path(
    get,
    path = "/problems/{slug}",
    tag = "process",
    params(("slug" = String, Path, description = "The last segment of a problem's type", example = "duplicate-points")),
    responses((status = 200, description = "The explanation", body = String, content_type = "text/html"), PageProblems)
)]
pub async fn get_problem_page(Path(slug): Path<String>) -> Result<Html<String>, Problem> {
    let slug =
        problem::named(&slug).ok_or_else(|| Problem::new(catalogue::NOT_FOUND, "no such problem type"))?;
    let (name, status, explanation) = (slug.as_str(), slug.status(), slug.explanation());
    let body = format!("<p><code>{name}</code>, HTTP status {status}</p>\n<p>{explanation}</p>");
    Ok(page(slug.title(), &body))
}

fn page(title: &str, body: &str) -> Html<String> {
    Html(format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{title}</title></head>\n\
         <body><h1>{title}</h1>\n{body}</body></html>\n"
    ))
}
