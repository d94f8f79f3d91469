//! Tests that take seconds each: fleets that are served for hours.

use super::*;

mod steady;
mod tours;
