# What CI runs, step by step; `just` alone lists the recipes.
set shell := ["bash", "-euo", "pipefail", "-c"]

_list:
    @just --list

# Everything that must be green before a change lands
check: fmt lint docs test deny

fmt:
    cargo fmt --all --check

lint:
    cargo clippy --workspace --all-targets -- -D warnings
    cargo clippy --workspace --test soak -- -D warnings

docs:
    RUSTDOCFLAGS="-D warnings" cargo doc --workspace --no-deps

test:
    cargo test --workspace

# What a change needs, in 90 s after the build: without voyages and the modules called `slow`, such as campaigns, trials and comparisons
test-fast:
    SNAPSHOTS=40 cargo test --workspace --lib --bins --test claims --test program -- --skip slow:: --skip voyages::

# What the gate leaves out: real processes, other servers, measurements. All of it, or steps such as `just soak failover`; `.ci/soak --list`
soak *steps:
    .ci/soak {{steps}}

# Voyages of so many seeds, of ten minutes each: every claim of service, store and bridge, under faults (see ARCHITECTURE.md)
voyages seeds="1000" *more:
    cargo run --release -p tests --bin voyages -- --seeds {{seeds}} --duration 600 {{more}}

# Records, opened in pandas, GeoPandas and the MCAP reader; not part of `check`, which needs Rust alone
python:
    .ci/python-tests

# The Python client as it lies here: types, lints, tests that need no waiting
python-client:
    .ci/python-client

# The Python package: wheel, all tests, notebook
python-package:
    .ci/python-package

# The ROS 2 package against rclpy and a real service
ros2:
    .ci/ros2

deny:
    .ci/deny

# The Python wheel with the program, into target/wheels: `pip install` of it needs no Rust
wheel:
    .ci/wheel

# The Debian package, into target/debian
deb:
    .ci/deb

# The program without shared libraries, into target/static
static:
    .ci/static

# What the release is made of, as CycloneDX, into target (needs cargo-sbom)
sbom:
    .ci/sbom

# Time of one plan, in the library and over HTTP
bench:
    cargo bench -p tests --bench plan

# Every controller in every scenario, into target/scoreboard/report.md: half an hour on two cores; resumes if interrupted
scoreboard:
    cargo run --release --features full -- campaign run examples/campaigns/scoreboard.toml --out target/scoreboard
    bin=$(.ci/downloads python python-client)/bin && "$bin/pip" --quiet install --no-deps --no-build-isolation ./api/python && \
        "$bin/python" -m pilotfish.analysis report target/scoreboard

# Versions, metadata, licences, links, changelog, first load; `just release-check --release` on the commit that is released
release-check *more:
    .ci/release-check {{more}}

# The source paper's figures and what it prints, beside what is flown here, into target/paper (docs/paper.md): half a minute
paper:
    python3 examples/paper.py --program "$(.ci/program)" --out target/paper

# The moving picture at the top of the README, docs/hand-over.webp: a minute
animation:
    .ci/page-test --animate

# The tables of figures in README.md and docs/, each by the commands in the comment above it: two minutes
figures-in-docs:
    UPDATE_DOCS=1 cargo test -p pilotfish --test program the_slow_figures

# docs/scenario-keys.md, from the schema of scenario files
scenario-keys:
    UPDATE_DOCS=1 cargo test -p pilotfish-sim the_reference_of_keys

# Hundreds of live missions on a service of their own, in release: ten minutes, or what the arguments say, such as
# `just load --step 50` (until it has too much to do)
load *more:
    #!/usr/bin/env bash
    set -euo pipefail
    cargo build --release -p pilotfish -p tests --bins --features pilotfish/full
    # Not in /tmp, which on some machines is no disk: a commit costs what it costs there.
    target="${CARGO_TARGET_DIR:-target}/release"
    data=$(mktemp -d -p "$target")
    "$target/pilotfish" serve --port 0 --data "$data/missions" > "$data/said" &
    service=$!
    trap 'kill $service && wait $service; rm -r "$data"' EXIT
    until grep -q "http://" "$data/said"; do sleep 0.1; kill -0 $service; done
    url=$(grep -o -m 1 "http://[^ ]*" "$data/said")
    "$target/load" --url "$url" --pid $service {{more}}

# Distances and forecasts on AUVs that do not sail what they plan, beside tuned line of sight: all of it, or less, such as
# `just tracks --patterns lanes,boxes --errors weave-4 --declared plan,unknown --seeds 200-202 --tuned-on 100-102`
tracks *more:
    cargo run --release -p pilotfish-sim --example tracks -- {{more}}

# Time of one convex program in the planner's solver and in others (needs tests/python/requirements.txt)
solvers:
    python3 tests/python/solvers.py

# The service and its page on http://127.0.0.1:8080
serve:
    cargo run --release
