//! Claims that need real time, in one process: `cargo test -p tests --test soak`. Not in the gate.

mod leases;
