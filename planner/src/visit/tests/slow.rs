//! Tests of several seconds: fleets served for hours.

use super::*;

mod steady;
mod tours;
