//! Links: the operations that make sense next for a cloud named in an answer.
//!
//! A link holds for every answer that has it, so the next page of a list cannot be one.
//!
//! Where the id goes into the body, the link says so in words. The `requestBody` of a link may be an object
//! that contains the expression for the id. But openapi-generator, whose parser only knows bare expressions
//! there, refuses documents with such an object. The tests of the document insert it for Schemathesis
//! (openapi/schemathesis_hooks.py).

use std::collections::BTreeMap;

use utoipa::openapi::link::{Link, LinkBuilder};
use utoipa::openapi::{Ref, RefOr};

use super::{id_of, is_computed, operations};

/// Expressions for the cloud id in answers about a cloud, and in answers computed from a cloud.
const CLOUD_ID: &str = "$response.body#/cloud_id";
const CLOUD_ID_USED: &str = "$response.body#/diagnostics/cloud_id";

/// Operations on a cloud that only need its id, in the path.
const ON_PATH: [&str; 3] = ["get_cloud", "check_cloud", "delete_cloud"];
const CLOUD_USED: &str = "get_cloud_used";
/// Description of links whose operation refers to the cloud in the body.
const IN_BODY: &str = "The cloud, referred to in the body by its id, the `cloud_id` of this answer: `{\"cloud\": {\"id\": cloud_id}}`.";

/// Declares the links, and refers to them from the answers that they start from.
///
/// Every request that computes refers to a cloud. The client chooses its other members.
pub fn add(document: &mut utoipa::openapi::OpenApi) {
    let computed: Vec<String> = operations(document)
        .filter(|operation| is_computed(operation))
        .map(|operation| id_of(operation).to_owned())
        .collect();
    let of_a_cloud: Vec<&str> = ON_PATH.into_iter().chain(computed.iter().map(String::as_str)).collect();
    for operation in operations(document) {
        let links = match id_of(operation) {
            "create_cloud" => &of_a_cloud[..],
            _ if is_computed(operation) => &[CLOUD_USED],
            _ => continue,
        };
        for status in ["200", "201"] {
            let Some(RefOr::T(response)) = operation.responses.responses.get_mut(status) else { continue };
            let refer =
                |name: &str| (name.to_owned(), RefOr::Ref(Ref::new(format!("#/components/links/{name}"))));
            response.links = links.iter().copied().map(refer).collect();
        }
    }
    document.components.get_or_insert_default().links = components(&computed);
}

fn components(computed: &[String]) -> BTreeMap<String, RefOr<Link>> {
    let on_path = |id: &str| link(id, "The same cloud, by its id.").parameter("cloud_id", CLOUD_ID).build();
    let in_body = |id: &str| link(id, IN_BODY).build();
    let mut links: BTreeMap<String, Link> = BTreeMap::new();
    links.extend(ON_PATH.map(|id| (id.to_owned(), on_path(id))));
    links.extend(computed.iter().map(|id| (id.clone(), in_body(id))));
    let used = link("get_cloud", "The cloud that the request named or registered.");
    links.insert(CLOUD_USED.to_owned(), used.parameter("cloud_id", CLOUD_ID_USED).build());
    links.into_iter().map(|(name, link)| (name, RefOr::T(link))).collect()
}

fn link(operation_id: &str, description: &str) -> LinkBuilder {
    LinkBuilder::new().operation_id(operation_id).description(description)
}
