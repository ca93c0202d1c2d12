//! Generates the client from the `OpenAPI` document of the service into `client.rs` of `OUT_DIR`.
//!
//! openapi.json and `version_3_0.rs` are links to files of the service. A package has the files themselves.

mod version_3_0;

use std::error::Error;
use std::path::Path;
use std::{env, fs};

use progenitor_impl::{GenerationSettings, Generator, InterfaceStyle};

/// Timeout of the client in seconds.
///
/// It exceeds the deadline of the service, 120 seconds by default, so that the service gives up first.
const SECONDS: u64 = 150;

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=openapi.json");
    let document = serde_json::from_str(&fs::read_to_string("openapi.json")?)?;
    // progenitor does not read version 3.1.
    let document = serde_json::from_value(version_3_0::derive(document))?;
    let mut settings = GenerationSettings::new();
    // Most fields of requests are optional. Without builders, callers would have to write all of them.
    settings.with_interface(InterfaceStyle::Builder).with_timeout(SECONDS);
    let tokens = Generator::new(&settings).generate_tokens(&document)?;
    let client = Path::new(&env::var("OUT_DIR")?).join("client.rs");
    fs::write(client, prettyplease::unparse(&syn::parse2(tokens)?))?;
    Ok(())
}
