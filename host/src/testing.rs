//! A host and limits of lists for the unit tests.

use std::sync::{Arc, LazyLock};

use clap::Parser;

use crate::problem::catalogue;
use crate::state::host::{Guest, Host, Shares};
use crate::state::settings::Settings;
use crate::store::Objects;
use crate::wire::read::limits::{List, ListRule, Lists, ParseContext, too_many};
use gramian_observer::Unobserved;

/// Lists of numbers and tables with at most so many rows and columns. Tables are `points` and `queries`.
pub fn lists(max_points: usize, max_queries: usize, max_width: usize) -> Lists {
    let rule = |names, entries, most| ListRule {
        names,
        of_type: None,
        entries,
        most,
        what: "entries",
        remedy: "send fewer",
    };
    let kinds = [
        rule(&["values", "noise_variances"], List::OTHER, max_points),
        rule(&["points", "normals"], List::ROW, max_points),
        rule(&["queries"], List::ROW, max_queries),
    ];
    let too_wide =
        |limit, width, n_rows| too_many("columns", limit, width, &format!("{n_rows} rows are too wide"));
    Lists::new(max_width, too_wide, kinds)
}

/// Parses without limits and without an observer.
pub fn unlimited() -> ParseContext<'static> {
    static LISTS: LazyLock<Lists> = LazyLock::new(|| lists(usize::MAX, usize::MAX, usize::MAX));
    ParseContext { lists: &LISTS, renamed: &[], observer: &Unobserved }
}

/// A host with these settings, which keeps jobs in memory.
pub fn host(flags: &[&str]) -> Arc<Host> {
    host_on(flags, None)
}

/// A host with these settings over a store.
pub fn host_on(flags: &[&str], store: Option<Arc<Objects>>) -> Arc<Host> {
    #[derive(Parser)]
    struct Flags {
        #[command(flatten)]
        settings: Settings,
    }
    let settings = Flags::parse_from([&["host", "--threads", "1"], flags].concat()).settings;
    let shares = Shares { intake: 32 << 20, body: 1 << 20, jobs: 8 << 20, work: 32 << 20 };
    let problems = catalogue::ALL.to_vec();
    let guest = Guest { shares, lists: lists(100_000, 100, 16), renamed: &[], problems, subject: None };
    Host::new(settings, guest, store).unwrap()
}
