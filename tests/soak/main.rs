//! Claims that need real time, inside one process: `cargo test -p tests --test soak`. They are not part of the gate.

mod leases;
