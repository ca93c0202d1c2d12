//! The formats of answers: endings, what each can hold, and who writes it.

use gramian_host::wire::negotiation::Format as ServiceFormat;

/// What a file is to hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Content {
    /// Numbers at the points of a cloud.
    Points,
    /// A mesh with numbers at its vertices.
    Mesh,
    /// The answer to any request, as the service gives it.
    Answer,
}

/// Who writes a format.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Writer {
    /// The service: members by their names.
    Service,
    /// The writer of the service, for an answer that came as members.
    Model(ServiceFormat),
    Csv,
    Npy,
    Vtp,
    Stl,
}

/// A format of answers.
#[derive(Debug, PartialEq, Eq)]
pub struct Format {
    pub ending: &'static str,
    pub(super) writer: Writer,
    /// The format in which the service answers, if it has this one.
    service: Option<ServiceFormat>,
    holds: &'static [Content],
}

use Content::{Answer, Mesh, Points};

/// All formats, the preferred one first.
pub const FORMATS: [Format; 9] = [
    of("ply", Writer::Model(ServiceFormat::Ply), Some(ServiceFormat::Ply), &[Points, Mesh, Answer]),
    of("vtp", Writer::Vtp, None, &[Points, Mesh]),
    of("csv", Writer::Csv, None, &[Points]),
    of("json", Writer::Service, Some(ServiceFormat::Json), &[Points, Mesh, Answer]),
    of("safetensors", Writer::Service, Some(ServiceFormat::Safetensors), &[Points, Mesh, Answer]),
    of("npy", Writer::Npy, Some(ServiceFormat::Npy), &[Points, Answer]),
    of("stl", Writer::Stl, None, &[Mesh]),
    of("glb", Writer::Model(ServiceFormat::Gltf), Some(ServiceFormat::Gltf), &[Mesh, Answer]),
    of("obj", Writer::Model(ServiceFormat::Obj), Some(ServiceFormat::Obj), &[Mesh, Answer]),
];

const fn of(
    ending: &'static str,
    writer: Writer,
    service: Option<ServiceFormat>,
    holds: &'static [Content],
) -> Format {
    Format { ending, writer, service, holds }
}

impl Format {
    /// Finds the format of an ending that can hold a content.
    ///
    /// # Errors
    /// Names the endings that can.
    pub fn named(ending: &str, content: Content) -> Result<&'static Self, String> {
        let ending = ending.trim_start_matches('.').to_lowercase();
        let found = FORMATS.iter().find(|format| format.ending == ending);
        found.filter(|format| format.holds.contains(&content)).ok_or_else(|| {
            let (what, among) = (content.name(), endings(content));
            match found {
                Some(_) => format!(".{ending} cannot hold {what}. These can: {among}"),
                None if ending.is_empty() => {
                    format!("the name of the file of {what} ends with one of {among}")
                }
                None => format!(".{ending} is no format of {what}. These are: {among}"),
            }
        })
    }

    /// The media type in which the service is asked for an answer about a cloud: JSON as it is, and members
    /// for all others.
    pub fn asked_for(&self) -> &'static str {
        let is_json = self.service == Some(ServiceFormat::Json);
        if is_json { ServiceFormat::Json.media_type() } else { ServiceFormat::Safetensors.media_type() }
    }

    /// The media type of a format of the service. JSON for others, which hold no answer of the service.
    pub fn media_type(&self) -> &'static str {
        self.service.unwrap_or(ServiceFormat::Json).media_type()
    }

    /// Whether a terminal can show it.
    pub fn is_text(&self) -> bool {
        matches!(self.ending, "csv" | "json" | "obj")
    }
}

impl Content {
    fn name(self) -> &'static str {
        match self {
            Self::Points => "numbers at points",
            Self::Mesh => "a mesh",
            Self::Answer => "an answer of the service",
        }
    }
}

/// The endings that can hold a content: ".ply, .vtp, …".
pub fn endings(content: Content) -> String {
    let able = FORMATS.iter().filter(|format| format.holds.contains(&content));
    able.map(|format| format!(".{}", format.ending)).collect::<Vec<_>>().join(", ")
}

/// A text with endings instead of media types.
pub fn as_endings(text: &str) -> String {
    let replaced = |text: String, format: &Format| match format.service {
        Some(service) => text.replace(service.media_type(), &format!(".{}", format.ending)),
        None => text,
    };
    FORMATS.iter().fold(text.to_owned(), replaced)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_hold_an_answer_is_told_with_what_can() {
        assert_eq!(Format::named(".PLY", Content::Points).map(|format| format.ending), Ok("ply"));
        let refused = |ending, content| Format::named(ending, content).unwrap_err();
        assert!(
            refused("stl", Content::Points)
                .contains("cannot hold numbers at points. These can: .ply, .vtp, .csv")
        );
        assert!(refused("csv", Content::Mesh).contains(".stl"));
        assert!(refused("docx", Content::Mesh).contains("no format of a mesh"));
        assert!(refused("", Content::Answer).contains(".safetensors"));
        assert_eq!(
            as_endings("answers come as model/ply or model/gltf-binary"),
            "answers come as .ply or .glb"
        );
    }
}
