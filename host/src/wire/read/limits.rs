//! Limits of the lists of a request, which are enforced while it is parsed.
//!
//! Parsing stops where a list is longer than any request may have. So no body takes more memory than requests
//! within the limits need. Which lists there are is up to the service.

use super::renamed::RenamedWord;
use crate::problem::{Problem, catalogue};
use crate::wire::negotiation::BodyFormat;
use gramian_observer::Observer;

/// Limits and observer of one parse.
#[derive(Clone, Copy)]
pub struct ParseContext<'a> {
    pub lists: &'a Lists,
    /// Words of requests that have another name now.
    pub renamed: &'a [RenamedWord],
    /// Tells when the request is cancelled because nobody waits for it.
    pub observer: &'a dyn Observer,
}

/// A kind of list: its position among those of [`Lists`], after the two kinds that every service has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct List(pub u8);

impl List {
    /// Strings, or not a list at all.
    pub const OTHER: Self = Self(0);
    /// The numbers of a row of a table.
    pub const ROW: Self = Self(1);
}

/// A kind of list, and how long it may be.
#[derive(Debug, Clone, Copy)]
pub struct ListRule {
    /// Names of members that are such lists.
    pub names: &'static [&'static str],
    /// Name of a type that marks such lists, whatever the names of their members.
    pub of_type: Option<&'static str>,
    /// Kind of the entries.
    pub entries: List,
    /// Most entries.
    pub most: usize,
    /// What the entries are, in refusals.
    pub what: &'static str,
    pub remedy: &'static str,
}

/// The lists of the requests of a service.
#[derive(Debug, Clone)]
pub struct Lists {
    /// Rules of [`List::OTHER`], [`List::ROW`] and the kinds of the service.
    rules: Vec<ListRule>,
    /// 413 for rows that are too long: the limit, the length of the first such row, and the number of rows.
    too_wide: fn(usize, usize, usize) -> Problem,
    /// Most numbers of a request in PLY, and in any other format.
    n_numbers_of_ply: usize,
    n_numbers: usize,
}

const UNBOUNDED: ListRule = ListRule {
    names: &[],
    of_type: None,
    entries: List::OTHER,
    most: usize::MAX,
    what: "entries",
    remedy: "",
};

impl Lists {
    /// The lists of a service: rows with at most `max_width` numbers, refused by `too_wide`, and further
    /// kinds in the order of their [`List`]s from 2 on.
    pub fn new(
        max_width: usize,
        too_wide: fn(usize, usize, usize) -> Problem,
        kinds: impl IntoIterator<Item = ListRule>,
    ) -> Self {
        let row = ListRule { most: max_width, ..UNBOUNDED };
        let rules = [UNBOUNDED, row].into_iter().chain(kinds).collect();
        Self { rules, too_wide, n_numbers_of_ply: usize::MAX, n_numbers: usize::MAX }
    }

    /// Bounds the numbers of a request in PLY, and in any other format.
    pub fn with_numbers(self, n_numbers_of_ply: usize, n_numbers: usize) -> Self {
        Self { n_numbers_of_ply, n_numbers, ..self }
    }

    /// Most numbers of a request in a format.
    pub fn n_numbers(&self, format: BodyFormat) -> usize {
        if format == BodyFormat::Ply { self.n_numbers_of_ply } else { self.n_numbers }
    }

    /// The kind of list that a member with this name is.
    pub fn named(&self, name: &str) -> List {
        self.find(|rule| rule.names.contains(&name)).unwrap_or(List::OTHER)
    }

    /// The kind of list marked by the name of its type.
    pub fn of_type(&self, name: &str) -> Option<List> {
        self.find(|rule| rule.of_type == Some(name))
    }

    fn find(&self, is_meant: impl Fn(&ListRule) -> bool) -> Option<List> {
        self.rules.iter().position(is_meant).map(|at| List(at as u8))
    }

    #[inline(always)]
    fn rule(&self, list: List) -> &ListRule {
        self.rules.get(usize::from(list.0)).unwrap_or(&UNBOUNDED)
    }

    /// The kind of the entries of a list.
    #[inline(always)]
    pub fn of_entries(&self, list: List) -> List {
        self.rule(list).entries
    }

    /// Most entries that a list may have.
    #[inline(always)]
    pub fn max_entries(&self, list: List) -> usize {
        self.rule(list).most
    }

    /// The 413 problem for a list that is too long.
    pub(super) fn too_large(&self, excess: Excess, pointer: &str) -> Problem {
        let Excess { list, length, width } = excess;
        let ListRule { most, what, remedy, .. } = *self.rule(list);
        let problem = match width {
            Some(width) if length <= most => (self.too_wide)(self.max_entries(List::ROW), width, length),
            _ => too_many(what, most, length, remedy),
        };
        problem.at(pointer)
    }
}

/// A list that is too long, or that has a row that is too long.
#[derive(Debug, Clone, Copy)]
pub(super) struct Excess {
    pub(super) list: List,
    /// Entries of the list.
    pub(super) length: usize,
    /// Entries of the first row that is too long.
    pub(super) width: Option<usize>,
}

/// 413 for more of something than there may be.
pub fn too_many(what: &str, limit: usize, required: usize, remedy: &str) -> Problem {
    Problem::too_large(catalogue::PROBLEM_TOO_LARGE, what, limit, Some(required)).with_remedy(remedy)
}
