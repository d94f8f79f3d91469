# What CI runs, step by step; `just` alone lists the recipes.
set shell := ["bash", "-euo", "pipefail", "-c"]

_list:
    @just --list

# Everything that must be green before a change lands
check: fmt lint docs test deny

fmt:
    cargo fmt --all --check

lint:
    cargo clippy --workspace --all-targets --all-features -- -D warnings

docs:
    RUSTDOCFLAGS="-D warnings" cargo doc --workspace --no-deps

test:
    cargo test --workspace

# Records, opened in pandas, GeoPandas and the MCAP reader; not part of `check`, which needs Rust alone
python:
    .ci/python-tests

# The Python package: wheel, types, lints, tests, notebook
python-package:
    .ci/python-package

deny:
    .ci/deny

# The Debian package, into target/debian (needs cargo-deb)
deb:
    .ci/deb

# What the release is made of, as CycloneDX, into target (needs cargo-sbom)
sbom:
    .ci/sbom

# Time of one plan, in the library and over HTTP
bench:
    cargo bench -p tests --bench plan

# The scoreboard of every controller in every scenario: about half an hour on two cores; broken off, it goes on
scoreboard:
    cargo run --release -- campaign run examples/campaigns/scoreboard.toml --out target/scoreboard
    cargo run --release -- campaign report target/scoreboard
    cp target/scoreboard/report.md docs/scoreboard.md

# Hundreds of live missions on a service of their own, in release: ten minutes, or what the arguments say, such as
# `just load --step 50` (until it has too much to do) or `just load --readers 100` (event streams)
load *more:
    #!/usr/bin/env bash
    set -euo pipefail
    cargo build --release -p pilotfish -p tests --bins
    # Not in /tmp, which on some machines is no disk: a commit costs what it costs there.
    target="${CARGO_TARGET_DIR:-target}/release"
    data=$(mktemp -d -p "$target")
    "$target/pilotfish" serve --port 0 --data "$data/missions" > "$data/said" &
    service=$!
    trap 'kill $service && wait $service; rm -r "$data"' EXIT
    until grep -q "http://" "$data/said"; do sleep 0.1; kill -0 $service; done
    url=$(grep -o -m 1 "http://[^ ]*" "$data/said")
    "$target/load" --url "$url" --pid $service {{more}}

# Speed of the simulator and of the same vehicles in Python (needs tests/python/requirements.txt)
speed:
    python3 tests/python/speed.py

# Time of one convex program in the planner's solver and in others (needs tests/python/requirements.txt)
solvers:
    python3 tests/python/solvers.py

# The service and its page on http://127.0.0.1:8080
serve:
    cargo run --release
