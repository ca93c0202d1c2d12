//! The request that the options of a subcommand make.

use serde_json::{Map, Value, json};

use super::command::{FitArguments, OfMesh};
use super::failure::Failure;

/// A request without its cloud, with the options that gave its members.
pub struct CloudRequest {
    pub operation: &'static str,
    members: Map<String, Value>,
}

impl CloudRequest {
    /// The request of normals or curvatures.
    ///
    /// # Errors
    /// [`Failure::Argument`] for an option that is not of its form.
    pub fn of_points(operation: &'static str, fit: &FitArguments) -> Result<Self, Failure> {
        let mut request = Self { operation, members: given_json(fit.with.as_deref())? };
        request.set("alpha", fit.alpha.map(Value::from));
        request.set("kernel", fit.kernel.as_deref().map(kernel).transpose()?);
        request.set("solver", fit.solver.as_ref().map(word));
        request.set("surface_model", fit.surface.as_ref().map(word));
        request.set("duplicates", fit.duplicates.as_ref().map(word));
        if fit.std {
            request.include("std")?;
        }
        Ok(request)
    }

    /// The request of a mesh.
    ///
    /// # Errors
    /// As [`CloudRequest::of_points`].
    pub fn of_mesh(of: &OfMesh) -> Result<Self, Failure> {
        let mut request = Self::of_points("level-set", &of.fit)?;
        request.set("open", of.open.then_some(Value::from(true)));
        request.set("step", of.step.map(Value::from));
        if of.curvatures {
            request.include("curvatures")?;
        }
        Ok(request)
    }

    /// The body of the request about a registered cloud.
    pub fn about(&self, cloud_id: &Value) -> String {
        let mut members = self.members.clone();
        members.insert("cloud".to_owned(), json!({"id": cloud_id}));
        Value::Object(members).to_string()
    }

    /// Options win over `--with`.
    fn set(&mut self, member: &str, value: Option<Value>) {
        self.members.extend(value.map(|value| (member.to_owned(), value)));
    }

    fn include(&mut self, part: &str) -> Result<(), Failure> {
        let include = self.members.entry("include").or_insert(json!([])).as_array_mut();
        let include = include.ok_or_else(|| Failure::Argument("--with: include is not a list".to_owned()))?;
        if !include.contains(&json!(part)) {
            include.push(json!(part));
        }
        Ok(())
    }
}

fn given_json(text: Option<&str>) -> Result<Map<String, Value>, Failure> {
    let parsed = text.map_or(Ok(Map::new()), serde_json::from_str);
    parsed.map_err(|error| Failure::Argument(format!("--with is not a JSON object: {error}")))
}

/// The word of an option, which is that of the request.
fn word(choice: &impl clap::ValueEnum) -> Value {
    choice.to_possible_value().map(|value| value.get_name().to_owned()).into()
}

/// A kernel written as `family[:length_scale][,parameter=number…]`.
fn kernel(text: &str) -> Result<Value, Failure> {
    let mut parts = text.split(',');
    let first = parts.next().unwrap_or_default();
    let (family, length) =
        first.split_once(':').map_or((first, None), |(family, length)| (family, Some(length)));
    let mut members = Map::from_iter([("family".to_owned(), json!(family.trim()))]);
    let parameters = parts.map(|part| part.split_once('=').unwrap_or((part, "")));
    for (name, number) in length.map(|length| ("length_scale", length)).into_iter().chain(parameters) {
        let number = number.trim().parse::<f64>().ok().filter(|number| number.is_finite());
        let number = number.ok_or_else(|| {
            let examples = "matern:0.5, or laplace:0.5,epsilon=0.01";
            Failure::Argument(format!("--kernel {text}: {name} has no number. Write it such as {examples}"))
        })?;
        members.insert(name.trim().to_owned(), number_of(number));
    }
    Ok(Value::Object(members))
}

/// A whole number is written without a point, since some parameters are integers.
fn number_of(number: f64) -> Value {
    if number.fract() == 0.0 && number.abs() < 1e15 { json!(number as i64) } else { json!(number) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kernels_are_a_family_a_length_and_parameters() {
        let of = |text: &str| kernel(text).map_err(|failure| failure.to_string());
        assert_eq!(of("gauss"), Ok(json!({"family": "gauss"})));
        assert_eq!(of("matern:0.5"), Ok(json!({"family": "matern", "length_scale": 0.5})));
        let expected = json!({"family": "wendland", "length_scale": 2, "smoothness": 6});
        assert_eq!(of("wendland:2, smoothness = 6"), Ok(expected));
        for bad in ["gauss:wide", "gauss,length_scale", "gauss:", "gauss:inf"] {
            assert!(of(bad).unwrap_err().contains("matern:0.5"), "{bad}");
        }
    }
}
