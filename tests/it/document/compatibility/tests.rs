//! Tests of the rules: each by a change of the document that must be reported, or must not.

use serde_json::{Value, json};

use super::breaking_changes;
use crate::support::document;

const OPERATION: &str = "/paths/~1v1~1curvatures/post";
const REQUEST: &str = "/components/schemas/CurvaturesRequest";
const ANSWER: &str = "/components/schemas/CurvaturesResponse";

/// Returns the pointers of the breaking changes that `change` makes to the document.
fn broken(change: impl FnOnce(&mut Value)) -> Vec<String> {
    let (released, mut current) = (document(), document());
    change(&mut current);
    assert!(released != current, "the change changes nothing");
    breaking_changes(&released, &current).into_iter().map(|change| change.pointer).collect()
}

/// Returns the part of a document at a pointer.
fn at<'a>(document: &'a mut Value, pointer: &str) -> &'a mut Value {
    document.pointer_mut(pointer).unwrap_or_else(|| panic!("no {pointer}"))
}

fn set(pointer: &str, name: &str, value: Value) -> Vec<String> {
    broken(|document| at(document, pointer)[name] = value)
}

fn remove(pointer: &str, name: &str) -> Vec<String> {
    broken(|document| {
        at(document, pointer).as_object_mut().unwrap().remove(name).unwrap();
    })
}

/// Returns the pointers broken by adding `value` to the array at `pointer`.
fn push(pointer: &str, value: Value) -> Vec<String> {
    broken(|document| at(document, pointer).as_array_mut().unwrap().push(value))
}

/// Returns the pointers broken by removing `value` from the array at `pointer`.
fn take(pointer: &str, value: &str) -> Vec<String> {
    broken(|document| at(document, pointer).as_array_mut().unwrap().retain(|item| item != value))
}

/// Returns the pointers broken if the value at `pointer` was `released` and is now `current`.
fn became(pointer: &str, released: Value, current: Value) -> Vec<String> {
    let [released, current] = [released, current].map(|value| {
        let mut document = document();
        *at(&mut document, pointer) = value;
        document
    });
    breaking_changes(&released, &current).into_iter().map(|change| change.pointer).collect()
}

fn property(schema: &str, name: &str) -> String {
    format!("{schema}/properties/{name}")
}

const NOTHING: [&str; 0] = [];

#[test]
fn nothing_is_broken_by_nothing() {
    assert!(breaking_changes(&document(), &document()).is_empty());
}

#[test]
fn operations_stay_with_their_names() {
    assert_eq!(remove("/paths", "/v1/curvatures"), [OPERATION]);
    assert_eq!(remove("/paths/~1v1~1curvatures", "post"), [OPERATION]);
    let renamed = broken(|document| {
        let item = at(document, "/paths").as_object_mut().unwrap().remove("/v1/curvatures").unwrap();
        document["paths"]["/v1/curvature"] = item;
    });
    assert_eq!(renamed, [OPERATION]);
    assert_eq!(set(OPERATION, "operationId", json!("curvatures")), [format!("{OPERATION}/operationId")]);
    assert_eq!(set(OPERATION, "tags", json!(["curves"])), [format!("{OPERATION}/tags")]);
    assert_eq!(set(OPERATION, "security", json!([{"bearer": []}])), [format!("{OPERATION}/security")]);
    let live = "/paths/~1health~1live/get";
    assert_eq!(remove(live, "security"), NOTHING);
    assert_eq!(set(live, "security", json!([{"bearer": []}])), [format!("{live}/security")]);
    let spacing = "#/components/schemas/Spacing";
    let renamed = broken(|document| {
        *document =
            serde_json::from_str(&document.to_string().replace(spacing, &format!("{spacing}s"))).unwrap();
        let schema = document["components"]["schemas"]["Spacing"].take();
        at(document, "/components/schemas").as_object_mut().unwrap().remove("Spacing");
        document["components"]["schemas"]["Spacings"] = schema;
    });
    assert_eq!(renamed, ["/components/schemas/Spacing"]);
}

#[test]
fn parameters_stay() {
    let list = "/paths/~1v1~1clouds/get/parameters";
    let limit = format!("{list}/0");
    let removed = broken(|document| {
        at(document, list).as_array_mut().unwrap().remove(0);
    });
    assert_eq!(removed, [limit.as_str()]);
    assert_eq!(set(&limit, "name", json!("count")), [limit.as_str()]);
    assert_eq!(set(&limit, "required", json!(true)), [format!("{limit}/required")]);
    assert_eq!(set(&format!("{limit}/schema"), "maximum", json!(100)), [format!("{limit}/schema/maximum")]);
    assert_eq!(set(&format!("{limit}/schema"), "maximum", json!(10_000)), NOTHING);
    let added =
        |is_required: bool| json!({"name": "x", "in": "query", "required": is_required, "schema": {}});
    assert_eq!(push(list, added(true)), [list]);
    assert_eq!(push(list, added(false)), NOTHING);
    let id = "/paths/~1v1~1clouds~1{cloud_id}/get/parameters/0";
    assert_eq!(set(id, "name", json!("id")), ["/paths/~1v1~1clouds~1{cloud_id}/get/parameters", id]);
    let pattern = format!("{id}/schema/pattern");
    assert_eq!(set(&format!("{id}/schema"), "pattern", json!("^[0-9]+$")), [pattern]);
}

#[test]
fn statuses_media_types_and_headers_stay() {
    let responses = format!("{OPERATION}/responses");
    assert_eq!(remove(&responses, "413"), [format!("{responses}/413")]);
    let moved = broken(|document| {
        let answer = at(document, &responses).as_object_mut().unwrap().remove("200").unwrap();
        at(document, &responses)["202"] = answer;
    });
    assert_eq!(moved, [responses.clone(), format!("{responses}/200")]);
    assert_eq!(set(&responses, "418", json!({"description": "a teapot"})), NOTHING);
    for content in [format!("{responses}/200/content"), format!("{OPERATION}/requestBody/content")] {
        let removed = remove(&content, "application/x-safetensors");
        assert_eq!(removed, [format!("{content}/application~1x-safetensors")]);
        assert_eq!(set(&content, "text/csv", json!({})), NOTHING);
    }
    let body = format!("{OPERATION}/requestBody");
    assert_eq!(became(&format!("{body}/required"), json!(false), json!(true)), [body.as_str()]);
    assert_eq!(became(&format!("{body}/required"), json!(true), json!(false)), NOTHING);
    let created = "/paths/~1v1~1clouds/post/responses/201/headers";
    assert_eq!(remove(created, "Location"), [format!("{created}/Location")]);
    let renamed = broken(|document| {
        let header = at(document, created).as_object_mut().unwrap().remove("Location").unwrap();
        at(document, created)["location"] = header;
    });
    assert_eq!(renamed, NOTHING);
    assert_eq!(set(created, "X-New", json!({"schema": {}})), NOTHING);
}

#[test]
fn a_header_that_was_promised_is_required() {
    let header = "/paths/~1v1~1clouds/post/responses/201/headers/Location";
    let always = || json!({"required": true, "schema": {"type": "string"}});
    let sometimes = || json!({"schema": {"type": "string"}});
    assert_eq!(became(header, always(), sometimes()), [header]);
    assert_eq!(became(header, sometimes(), always()), NOTHING);
    let number = json!({"schema": {"type": "integer"}});
    assert_eq!(became(header, sometimes(), number), [format!("{header}/schema/type")]);
    // A change of a shared component is reported once, however many answers use it.
    let shared = "/components/headers/X-Request-Id/schema";
    assert_eq!(set(shared, "type", json!("integer")), [format!("{shared}/type")]);
}

#[test]
fn members_of_answers_stay_and_may_grow() {
    let (properties, required) = (format!("{ANSWER}/properties"), format!("{ANSWER}/required"));
    assert_eq!(remove(&properties, "normals"), [property(ANSWER, "normals")]);
    assert_eq!(take(&required, "normals"), [property(ANSWER, "normals")]);
    assert_eq!(set(&properties, "radii", json!({"type": "array"})), NOTHING);
    assert_eq!(push(&required, json!("radii")), NOTHING);
    let curvatures = property(ANSWER, "mean_curvatures");
    assert_eq!(set(&curvatures, "type", json!("object")), [format!("{curvatures}/type")]);
    // A value becomes nullable.
    let norms = format!("{}/items", property(ANSWER, "gradient_norms"));
    assert_eq!(set(&norms, "type", json!(["number", "null"])), [format!("{norms}/type")]);
    assert_eq!(set(&format!("{curvatures}/items"), "type", json!("number")), NOTHING);
    assert_eq!(set(&norms, "type", json!("integer")), NOTHING);
    assert_eq!(
        remove(&property(ANSWER, "gradient_norms"), "items"),
        [format!("{norms}/format"), format!("{norms}/type")]
    );
    let rank = property("/components/schemas/Diagnostics", "rank");
    assert_eq!(remove(&rank, "minimum"), [format!("{rank}/minimum")]);
    assert_eq!(set(&rank, "minimum", json!(1)), NOTHING);
    let surfaces = "/components/schemas/SurfaceModelUsed/enum";
    assert_eq!(push(surfaces, json!("plane")), [surfaces]);
    assert_eq!(take(surfaces, "offset"), NOTHING);
}

#[test]
fn members_of_requests_stay_and_stay_optional() {
    let (properties, required) = (format!("{REQUEST}/properties"), format!("{REQUEST}/required"));
    assert_eq!(remove(&properties, "surface_model"), [property(REQUEST, "surface_model")]);
    assert_eq!(push(&required, json!("surface_model")), [property(REQUEST, "surface_model")]);
    assert_eq!(take(&required, "cloud"), NOTHING);
    assert_eq!(set(&properties, "radius", json!({"type": "number"})), NOTHING);
    let surfaces = "/components/schemas/SurfaceModelChoice/enum";
    assert_eq!(take(surfaces, "offset"), [surfaces]);
    assert_eq!(push(surfaces, json!("plane")), NOTHING);
    assert_eq!(remove(REQUEST, "additionalProperties"), NOTHING);
}

#[test]
fn a_value_of_a_request_is_still_accepted() {
    let nu = property("/components/schemas/Kernel", "nu");
    let number = |keyword: &str, value: Value| json!({"type": "number", keyword: value});
    for (keyword, released, stricter) in
        [("maximum", 8.5, 3.5), ("minimum", 0.5, 1.5), ("multipleOf", 0.5, 1.0)]
    {
        let [released, stricter] = [released, stricter].map(|value| number(keyword, json!(value)));
        assert_eq!(became(&nu, released.clone(), stricter), [format!("{nu}/{keyword}")]);
        assert_eq!(became(&nu, json!({"type": "number"}), released.clone()), [format!("{nu}/{keyword}")]);
        assert_eq!(became(&nu, released, json!({"type": "number"})), NOTHING);
    }
    assert_eq!(became(&nu, number("maximum", json!(8.5)), number("maximum", json!(9.5))), NOTHING);
    for (released, current) in [("number", "integer"), ("number", "string"), ("integer", "boolean")] {
        let found = became(&nu, json!({"type": released}), json!({"type": current}));
        assert_eq!(found, [format!("{nu}/type")], "{released} {current}");
    }
    assert_eq!(became(&nu, json!({"type": "integer"}), json!({"type": "number"})), NOTHING);
    assert_eq!(became(&nu, json!({"type": "number"}), json!({"type": ["number", "string"]})), NOTHING);
    assert_eq!(became(&nu, json!({}), json!({"enum": [0.5, 1.5]})), [format!("{nu}/enum")]);
    assert_eq!(became(&nu, json!({"enum": [0.5, 1.5]}), json!({})), NOTHING);
    // A default defines what an absent member means, so changing it is breaking.
    let defaults = [2.5, 1.5].map(|value| number("default", json!(value)));
    let [released, current] = defaults;
    assert_eq!(became(&nu, released, current), [format!("{nu}/default")]);
}

/// Follows a reference that now names another component. The change inside that component must be found.
#[test]
fn a_reference_may_not_change_what_it_means() {
    let (diagnostics, answer) = ("/components/schemas/Diagnostics", "/components/schemas/PosteriorResponse");
    let found = broken(|document| {
        let mut other = at(document, diagnostics).clone();
        other["properties"]["rank"]["type"] = json!("string");
        at(document, "/components/schemas")["OtherDiagnostics"] = other;
        at(document, &property(answer, "diagnostics"))["$ref"] =
            json!("#/components/schemas/OtherDiagnostics");
    });
    assert_eq!(found, [format!("{}/type", property(diagnostics, "rank"))]);
}

#[test]
fn types_of_problems_stay() {
    let examples = format!("{OPERATION}/responses/422/content/application~1problem+json/examples");
    assert_eq!(remove(&examples, "kernel-not-smooth"), [format!("{examples}/kernel-not-smooth")]);
    assert_eq!(set(&examples, "cloud-too-flat", json!({})), NOTHING);
}

/// Checks a component of both requests and answers, which may neither grow nor shrink.
#[test]
fn what_is_both_sent_and_answered_stays_as_it_is() {
    let families = "/components/schemas/KernelFamily/enum";
    assert_eq!(push(families, json!("cubic")), [families]);
    assert_eq!(take(families, "gauss"), [families]);
}

#[test]
fn what_the_rules_do_not_know_counts_as_breaking() {
    assert_eq!(
        set(REQUEST, "unevaluatedProperties", json!(false)),
        [format!("{REQUEST}/unevaluatedProperties")]
    );
    assert_eq!(set(ANSWER, "propertyNames", json!({})), NOTHING);
    let cloud = property(REQUEST, "cloud");
    assert_eq!(set(&cloud, "minProperties", json!(2)), [format!("{cloud}/minProperties")]);
    assert_eq!(set(REQUEST, "oneOf", json!([{}])), [format!("{REQUEST}/oneOf")]);
}

#[test]
fn additions_and_words_are_compatible() {
    assert_eq!(set("/paths", "/v1/spectra", json!({"post": {"operationId": "compute_spectra"}})), NOTHING);
    assert_eq!(set(ANSWER, "description", json!("In other words.")), NOTHING);
    assert_eq!(set(OPERATION, "summary", json!("In other words")), NOTHING);
    assert_eq!(set(OPERATION, "deprecated", json!(true)), NOTHING);
    assert_eq!(
        set(&format!("{OPERATION}/requestBody/content/application~1json"), "example", json!({})),
        NOTHING
    );
    assert_eq!(set("/components/schemas", "Spectrum", json!({"type": "object"})), NOTHING);
    // The same schema, written inline where it is used.
    let inline = broken(|document| {
        let schema = at(document, "/components/schemas/SurfaceModelUsed").clone();
        *at(document, &format!("{}/items", property(ANSWER, "surface_models"))) = schema;
    });
    assert_eq!(inline, NOTHING);
}
