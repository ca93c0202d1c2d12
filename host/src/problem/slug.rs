//! Types of problems. Each has an entry in a catalogue: that of the host, or that of a service over it.

use axum::http::StatusCode;

/// The catalogue entry of a problem type.
#[derive(Debug, PartialEq, Eq, Hash)]
pub struct Entry {
    /// The last segment of the problem's `type`.
    pub name: &'static str,
    pub status: StatusCode,
    pub title: &'static str,
    /// Meaning and remedy, for the page behind the `type`.
    pub explanation: &'static str,
}

/// A type of problem. Part of the contract of a service: types are added, never renamed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Slug(pub &'static Entry);

impl Slug {
    /// The last segment of the problem's `type`.
    pub fn as_str(self) -> &'static str {
        self.0.name
    }

    pub fn status(self) -> StatusCode {
        self.0.status
    }

    pub fn title(self) -> &'static str {
        self.0.title
    }

    /// Meaning and remedy, for the page behind the `type`.
    pub fn explanation(self) -> &'static str {
        self.0.explanation
    }
}

/// Declares a catalogue of problem types: constant, name, status, title, and explanation of each.
#[macro_export]
macro_rules! catalogue {
    ($($constant:ident $name:literal $status:ident $title:literal $explanation:literal;)*) => {
        $(
            #[doc = $title]
            pub const $constant: $crate::problem::slug::Slug =
                $crate::problem::slug::Slug(&$crate::problem::slug::Entry {
                    name: $name,
                    status: axum::http::StatusCode::$status,
                    title: $title,
                    explanation: $explanation,
                });
        )*

        /// All types of this catalogue.
        pub const ALL: [$crate::problem::slug::Slug; [$($name,)*].len()] = [$($constant,)*];
    };
}
