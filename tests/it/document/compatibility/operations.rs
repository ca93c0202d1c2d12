//! Rules for operations: names, security, parameters, bodies and responses.

use serde_json::Value;

use super::schemas::{Direction, followed};
use super::{Comparison, below, members};

const METHODS: [&str; 8] = ["get", "put", "post", "delete", "options", "head", "patch", "trace"];

impl Comparison<'_> {
    pub fn compare_paths(&mut self) {
        let (released, current) = (self.released, self.current);
        for (path, item) in members(&released["paths"]) {
            for (method, old) in members(item).filter(|(name, _)| METHODS.contains(&name.as_str())) {
                let pointer = below(&below("/paths", path), method);
                match current["paths"].get(path).and_then(|item| item.get(method)) {
                    Some(new) => self.compare_operation(&pointer, old, new),
                    None => self.report(&pointer, "the operation was removed"),
                }
            }
        }
    }

    /// Compares the names of components, after which generated code names its types.
    pub fn compare_component_names(&mut self) {
        let (released, current) = (self.released, self.current);
        for (name, _) in members(&released["components"]["schemas"]) {
            if current["components"]["schemas"].get(name).is_none() {
                self.report(&below("/components/schemas", name), "the component was removed");
            }
        }
    }

    fn compare_operation(&mut self, pointer: &str, old: &Value, new: &Value) {
        self.compare_names(pointer, old, new);
        self.compare_security(pointer, old, new);
        self.compare_parameters(pointer, old, new);
        self.compare_request_body(pointer, old, new);
        self.compare_responses(pointer, old, new);
    }

    /// Compares the operation id, after which generated code names its functions, and the tags, which name
    /// its modules.
    fn compare_names(&mut self, pointer: &str, old: &Value, new: &Value) {
        for name in ["operationId", "tags"] {
            if old[name] != new[name] {
                self.report(&below(pointer, name), format!("{} became {}", old[name], new[name]));
            }
        }
    }

    /// Checks that every credential that was sufficient still is.
    fn compare_security(&mut self, pointer: &str, old: &Value, new: &Value) {
        let (old, new) = (ways_in(self.released, old), ways_in(self.current, new));
        for way in old.iter().filter(|way| !new.contains(way)) {
            self.report(&below(pointer, "security"), format!("{way} is not enough any more"));
        }
    }

    fn compare_parameters(&mut self, pointer: &str, old: &Value, new: &Value) {
        let is_same = |a: &Value, b: &Value| a["name"] == b["name"] && a["in"] == b["in"];
        let (old, new) = (parameters(self.released, old), parameters(self.current, new));
        let pointer = below(pointer, "parameters");
        for (index, old) in old.iter().enumerate() {
            let pointer = below(&pointer, &index.to_string());
            let Some(new) = new.iter().find(|new| is_same(old, new)) else {
                self.report(&pointer, format!("the parameter {} was removed", old["name"]));
                continue;
            };
            if new["required"] == true && old["required"] != true {
                self.report(&below(&pointer, "required"), "the parameter became required");
            }
            self.compare_schema(
                Direction::Request,
                &below(&pointer, "schema"),
                &old["schema"],
                &new["schema"],
            );
        }
        for new in new.iter().filter(|new| new["required"] == true) {
            if !old.iter().any(|old| is_same(old, new)) {
                self.report(&pointer, format!("a required parameter {} was added", new["name"]));
            }
        }
    }

    fn compare_request_body(&mut self, pointer: &str, old: &Value, new: &Value) {
        let pointer = below(pointer, "requestBody");
        let (pointer, old) = followed(self.released, &pointer, &old["requestBody"]);
        let (_, new) = followed(self.current, &pointer, &new["requestBody"]);
        if new["required"] == true && old["required"] != true {
            self.report(&pointer, "a body became required");
        }
        self.compare_content(Direction::Request, &pointer, old, new);
    }

    /// Compares the statuses. A new status from 400 on is compatible: clients treat an unknown one as the
    /// first of its hundred. Any other new status is breaking.
    fn compare_responses(&mut self, pointer: &str, old: &Value, new: &Value) {
        let pointer = below(pointer, "responses");
        let (old, new) = (&old["responses"], &new["responses"]);
        for (status, response) in members(old) {
            let pointer = below(&pointer, status);
            match new.get(status) {
                Some(new) => self.compare_response(&pointer, response, new),
                None => self.report(&pointer, "the status was removed"),
            }
        }
        for (status, _) in
            members(new).filter(|(status, _)| status.as_str() < "400" && old.get(status).is_none())
        {
            self.report(&pointer, format!("the status {status} was added"));
        }
    }

    fn compare_response(&mut self, pointer: &str, old: &Value, new: &Value) {
        let ((pointer, old), (_, new)) =
            (followed(self.released, pointer, old), followed(self.current, pointer, new));
        self.compare_content(Direction::Answer, &pointer, old, new);
        for (name, old) in members(&old["headers"]) {
            let pointer = below(&below(&pointer, "headers"), name);
            let is_same = |(found, _): &(&String, &Value)| found.eq_ignore_ascii_case(name);
            match members(&new["headers"]).find(is_same) {
                Some((_, new)) => self.compare_header(&pointer, old, new),
                None => self.report(&pointer, "the header was removed"),
            }
        }
    }

    fn compare_header(&mut self, pointer: &str, old: &Value, new: &Value) {
        let ((pointer, old), (_, new)) =
            (followed(self.released, pointer, old), followed(self.current, pointer, new));
        if old["required"] == true && new["required"] != true {
            self.report(&pointer, "the header became optional");
        }
        self.compare_schema(Direction::Answer, &below(&pointer, "schema"), &old["schema"], &new["schema"]);
    }

    /// Compares bodies by media type. New media types are compatible, since clients ask for the one they
    /// want.
    fn compare_content(&mut self, direction: Direction, pointer: &str, old: &Value, new: &Value) {
        for (media_type, content) in members(&old["content"]) {
            let pointer = below(&below(pointer, "content"), media_type);
            match new["content"].get(media_type) {
                Some(new) => {
                    self.compare_problems(&pointer, content, new);
                    let pointer = below(&pointer, "schema");
                    self.compare_schema(direction, &pointer, &content["schema"], &new["schema"]);
                }
                None => self.report(&pointer, "the media type was removed"),
            }
        }
    }

    /// Compares the types of problems, by which clients decide. They are the names of the examples of a
    /// response.
    fn compare_problems(&mut self, pointer: &str, old: &Value, new: &Value) {
        for (slug, _) in members(&old["examples"]) {
            if new["examples"].get(slug).is_none() {
                self.report(&below(&below(pointer, "examples"), slug), "the type of problem was removed");
            }
        }
    }
}

/// Returns the parameters of an operation, with references resolved.
fn parameters(document: &Value, operation: &Value) -> Vec<Value> {
    let listed = operation["parameters"].as_array().into_iter().flatten();
    listed.map(|parameter| followed(document, "", parameter).1.clone()).collect()
}

/// Returns the alternatives of an operation's security, its own or the document's default. If neither is
/// declared, the one alternative is the empty one, which everybody satisfies.
fn ways_in(document: &Value, operation: &Value) -> Vec<Value> {
    let declared = operation["security"].as_array().or(document["security"].as_array());
    declared.cloned().unwrap_or_else(|| vec![serde_json::json!({})])
}
