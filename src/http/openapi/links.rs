//! Links: what can be asked next of a cloud that an answer names. A link holds for every answer that has it, so the next
//! page of a list is none.

use std::collections::BTreeMap;

use serde_json::json;
use utoipa::openapi::link::{Link, LinkBuilder};
use utoipa::openapi::{Ref, RefOr};

use super::{id_of, operations};

/// Where answers name a cloud: those about it, and those computed from it.
const CLOUD_ID: &str = "$response.body#/cloud_id";
const CLOUD_ID_USED: &str = "$response.body#/diagnostics/cloud_id";

/// Operations on a cloud of which only the id is needed.
const ON_PATH: [&str; 3] = ["get_cloud", "check_cloud", "delete_cloud"];
/// Operations whose request refers to the cloud. The other fields of the request are the client's.
const IN_BODY: [&str; 8] = [
    "compute_interpolation",
    "compute_posterior",
    "compute_normals",
    "compute_curvatures",
    "compute_surface_gradient",
    "assemble_surface_gradient_matrix",
    "compute_laplace_beltrami",
    "assemble_laplace_beltrami_matrix",
];
const CLOUD_USED: &str = "get_cloud_used";

/// Declares the links and refers to them from the answers that they start from.
pub fn add(document: &mut utoipa::openapi::OpenApi) {
    for operation in operations(document) {
        let links: Vec<&str> = match id_of(operation) {
            "create_cloud" => ON_PATH.into_iter().chain(IN_BODY).collect(),
            id if IN_BODY.contains(&id) => vec![CLOUD_USED],
            _ => continue,
        };
        for status in ["200", "201"] {
            let Some(RefOr::T(response)) = operation.responses.responses.get_mut(status) else { continue };
            let refer =
                |name: &str| (name.to_owned(), RefOr::Ref(Ref::new(format!("#/components/links/{name}"))));
            response.links = links.iter().copied().map(refer).collect();
        }
    }
    document.components.get_or_insert_default().links = components();
}

fn components() -> BTreeMap<String, RefOr<Link>> {
    let on_path = |id: &str| link(id, "The same cloud, by its id.").parameter("cloud_id", CLOUD_ID).build();
    let in_body = |id: &str| {
        let body = json!({"cloud": {"id": CLOUD_ID}});
        link(id, "The cloud, referred to by its id.").request_body(Some(body)).build()
    };
    let mut links: BTreeMap<String, Link> = BTreeMap::new();
    links.extend(ON_PATH.map(|id| (id.to_owned(), on_path(id))));
    links.extend(IN_BODY.map(|id| (id.to_owned(), in_body(id))));
    let used = link("get_cloud", "The cloud that the request named or registered.");
    links.insert(CLOUD_USED.to_owned(), used.parameter("cloud_id", CLOUD_ID_USED).build());
    links.into_iter().map(|(name, link)| (name, RefOr::T(link))).collect()
}

fn link(operation_id: &str, description: &str) -> LinkBuilder {
    LinkBuilder::new().operation_id(operation_id).description(description)
}
