//! The examples of the `OpenAPI` document: files in openapi/examples/, whose requests a test sends and
//! compares.

use std::collections::{BTreeMap, BTreeSet};

use serde::Deserialize;
use serde_json::Value;
use utoipa::openapi::example::{Example, ExampleBuilder};
use utoipa::openapi::path::Operation;
use utoipa::openapi::{Content, Ref, RefOr};

use super::{id_of, operations};
use crate::http::problem;
use gramian_host::problem::slug::Slug;

/// The name and text of an example file.
macro_rules! example_file {
    ($name:literal) => {
        ($name, include_str!(concat!("../../../openapi/examples/", $name, ".json")))
    };
}

/// A request and its answer for each operation that answers with a body, by operation id.
///
/// A test sends the requests in this order and compares the answers.
pub const EXAMPLES: [(&str, &str); 27] = [
    example_file!("create_cloud"),
    example_file!("get_cloud"),
    example_file!("list_clouds"),
    example_file!("estimate"),
    example_file!("list_kernels"),
    example_file!("compute_interpolation"),
    example_file!("compute_interpolation_batch"),
    example_file!("compute_posterior"),
    example_file!("compute_posterior_batch"),
    example_file!("select_model"),
    example_file!("choose_coarse_cloud"),
    example_file!("compute_regions"),
    example_file!("choose_sides"),
    example_file!("compute_normals"),
    example_file!("compute_curvatures"),
    example_file!("compute_level_set"),
    example_file!("compute_surface_gradient"),
    example_file!("assemble_surface_gradient_matrix"),
    example_file!("assemble_surface_gradient_sparse_matrix"),
    example_file!("compute_laplace_beltrami"),
    example_file!("assemble_laplace_beltrami_matrix"),
    example_file!("assemble_laplace_beltrami_sparse_matrix"),
    example_file!("check_live"),
    example_file!("check_ready"),
    example_file!("get_version"),
    example_file!("list_problem_pages"),
    example_file!("get_problem_page"),
];

/// A problem document of every type, with a request that provokes it.
pub const PROBLEMS: &str = include_str!("../../../openapi/examples/problems.json");

/// The content of an example file.
#[derive(Deserialize)]
struct Sample {
    request: Option<Value>,
    response: Value,
}

/// Adds the examples to the operations, where readers and generators look for them.
pub fn add(document: &mut utoipa::openapi::OpenApi) {
    for operation in operations(document) {
        let Some((_, text)) = EXAMPLES.iter().find(|(name, _)| *name == id_of(operation)) else { continue };
        // The files are compiled in and read by a test. An unreadable file would leave its operation without
        // an example.
        if let Ok(sample) = serde_json::from_str::<Sample>(text) {
            add_sample(operation, sample);
        }
    }
    let mut problems = problem_examples();
    let answered: BTreeSet<String> =
        operations(document).flat_map(|operation| examples_of(operation)).collect();
    problems.retain(|slug, _| answered.contains(slug));
    document.components.get_or_insert_default().examples = problems;
}

/// Returns the names of the examples that the answers of an operation refer to.
fn examples_of(operation: &Operation) -> Vec<String> {
    let responses = operation.responses.responses.values().filter_map(|response| match response {
        RefOr::T(response) => Some(response.content.values()),
        RefOr::Ref(_) => None,
    });
    let contents = responses.flatten().filter_map(|content| match content {
        RefOr::T(content) => Some(content.examples.keys().cloned()),
        RefOr::Ref(_) => None,
    });
    contents.flatten().collect()
}

fn add_sample(operation: &mut Operation, sample: Sample) {
    for media_type in ["application/json", "text/html"] {
        if let Some(RefOr::T(body)) = operation.request_body.as_mut() {
            set_example(body.content.get_mut(media_type), sample.request.as_ref());
        }
        for status in ["200", "201"] {
            if let Some(RefOr::T(answer)) = operation.responses.responses.get_mut(status) {
                set_example(answer.content.get_mut(media_type), Some(&sample.response));
            }
        }
    }
}

fn set_example(content: Option<&mut RefOr<Content>>, example: Option<&Value>) {
    if let Some(RefOr::T(content)) = content {
        content.example = example.cloned();
    }
}

/// Returns the example problem documents by slug.
fn problem_examples() -> BTreeMap<String, RefOr<Example>> {
    let samples: BTreeMap<String, Sample> = serde_json::from_str(PROBLEMS).unwrap_or_default();
    let example = |(slug, sample): (String, Sample)| {
        let title = problem::named(&slug)?.title();
        let example = ExampleBuilder::new().summary(title).value(Some(sample.response)).build();
        Some((slug, RefOr::T(example)))
    };
    samples.into_iter().filter_map(example).collect()
}

/// Returns a reference to the example of a problem.
pub fn problem_example(slug: Slug) -> RefOr<Example> {
    RefOr::Ref(Ref::new(format!("#/components/examples/{}", slug.as_str())))
}
