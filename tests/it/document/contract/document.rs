//! The OpenAPI document, prepared for checking answers: paths as templates, schemas compiled.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::sync::Arc;

use serde_json::{Map, Value};

use super::closed::{close_parts, closed};
use super::validator::Validator;

pub struct Contract {
    paths: Vec<Path>,
    /// Schema of every problem.
    pub problem: Arc<Validator>,
}

/// A path with its operations by method.
struct Path {
    template: String,
    operations: BTreeMap<String, Operation>,
}

/// The declared answers of an operation, by status.
pub type Operation = BTreeMap<String, Response>;

#[derive(Default)]
pub struct Response {
    /// Schemas of bodies by media type.
    pub content: BTreeMap<String, Arc<Validator>>,
    /// Headers by name in lower case.
    pub headers: BTreeMap<String, Header>,
    /// Slugs of the declared problems.
    pub problems: BTreeSet<String>,
}

pub struct Header {
    pub is_required: bool,
    pub schema: Arc<Validator>,
}

/// The result of looking up a request in the document.
pub enum Lookup<'a> {
    By(&'a Operation),
    /// The path exists, with these methods instead.
    OtherMethods(Vec<String>),
    Nowhere,
}

impl Contract {
    pub fn new(document: &Value) -> Self {
        let mut schemas = Schemas::new(document);
        let problem = schemas.compile(&serde_json::json!({"$ref": "#/components/schemas/Problem"}));
        let paths = members(&document["paths"]).map(|(template, item)| Path {
            template: template.clone(),
            operations: schemas.operations(item),
        });
        Self { paths: paths.collect(), problem }
    }

    /// Finds the operation for a request. A literal path takes precedence over one with parameters.
    pub fn find(&self, method: &str, path: &str) -> Lookup<'_> {
        let literal = self.paths.iter().find(|known| known.template == path);
        let Some(known) = literal.or_else(|| self.paths.iter().find(|known| fits(&known.template, path)))
        else {
            return Lookup::Nowhere;
        };
        // HEAD is GET without its body, unless it is an operation itself.
        let by_get = || known.operations.get("GET").filter(|_| method == "HEAD");
        match known.operations.get(method).or_else(by_get) {
            Some(operation) => Lookup::By(operation),
            None => Lookup::OtherMethods(known.methods()),
        }
    }
}

impl Path {
    /// Returns all methods of the path, sorted.
    fn methods(&self) -> Vec<String> {
        let mut methods: Vec<_> = self.operations.keys().cloned().collect();
        if self.operations.contains_key("GET") && !self.operations.contains_key("HEAD") {
            methods.push("HEAD".to_owned());
        }
        methods.sort();
        methods
    }
}

/// Checks whether a path matches a template. A parameter matches one non-empty segment.
fn fits(template: &str, path: &str) -> bool {
    let (template, path): (Vec<_>, Vec<_>) = (template.split('/').collect(), path.split('/').collect());
    let is_same = |(known, found): (&&str, &&str)| {
        known == found || known.starts_with('{') && known.ends_with('}') && !found.is_empty()
    };
    template.len() == path.len() && template.iter().zip(&path).all(is_same)
}

/// The schemas of a document, each compiled once however often it is used.
struct Schemas<'a> {
    document: &'a Value,
    components: Value,
    compiled: HashMap<String, Arc<Validator>>,
}

impl<'a> Schemas<'a> {
    fn new(document: &'a Value) -> Self {
        let mut components = document["components"].clone();
        for schema in components["schemas"].as_object_mut().unwrap().values_mut() {
            // A component is closed where it is used, because there it may be a part of a composition.
            close_parts(schema);
        }
        Self { document, components, compiled: HashMap::new() }
    }

    fn operations(&mut self, item: &Value) -> BTreeMap<String, Operation> {
        let methods = members(item).filter(|(_, operation)| operation["responses"].is_object());
        let operation = |operation: &Value, schemas: &mut Self| {
            let responses = members(&operation["responses"]);
            responses.map(|(status, response)| (status.clone(), schemas.response(response))).collect()
        };
        methods.map(|(method, found)| (method.to_ascii_uppercase(), operation(found, self))).collect()
    }

    fn response(&mut self, response: &Value) -> Response {
        let response = self.resolve(response);
        let content = members(&response["content"])
            .map(|(media_type, content)| (media_type.clone(), self.compile(&content["schema"])));
        let content = content.collect();
        let headers = members(&response["headers"]).map(|(name, header)| {
            let header = self.resolve(header);
            let is_required = header["required"] == true;
            (name.to_ascii_lowercase(), Header { is_required, schema: self.compile(&header["schema"]) })
        });
        let headers = headers.collect();
        let problems = members(&response["content"]["application/problem+json"]["examples"]);
        Response { content, headers, problems: problems.map(|(slug, _)| slug.clone()).collect() }
    }

    /// Returns the target of a reference to a response or header, or the value itself.
    fn resolve(&self, value: &'a Value) -> &'a Value {
        let target = value["$ref"].as_str().and_then(|target| target.strip_prefix('#'));
        target.map_or(value, |target| self.document.pointer(target).unwrap())
    }

    fn compile(&mut self, schema: &Value) -> Arc<Validator> {
        if let Some(validator) = self.compiled.get(&schema.to_string()) {
            return validator.clone();
        }
        // The components are placed where the document's references point. Without a schema, anything is
        // valid.
        let mut used = if schema.is_null() { Value::Bool(true) } else { schema.clone() };
        closed(&mut used);
        let root = serde_json::json!({"allOf": [used], "components": self.components});
        let validator = Arc::new(Validator::new(root).unwrap_or_else(|error| panic!("{error}: {schema}")));
        self.compiled.insert(schema.to_string(), validator.clone());
        validator
    }
}

/// Iterates over the members of an object. Empty for any other value.
fn members(value: &Value) -> impl Iterator<Item = (&String, &Value)> {
    value.as_object().into_iter().flat_map(Map::iter)
}
