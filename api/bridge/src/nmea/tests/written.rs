//! Sentences for an autopilot.

use std::f64::consts::PI;

use super::*;
use crate::reference::Reference;

#[test]
fn headings_are_written_in_degrees_from_0_to_less_than_360() {
    for (heading, written) in [
        (0.0, "000.0"),
        (PI / 4.0, "045.0"),
        (PI, "180.0"),
        (-PI, "180.0"),
        (-PI / 2.0, "270.0"),
        (-0.0, "000.0"),
        (-1e-9, "000.0"),
        (-0.0009, "359.9"),
    ] {
        let sentences = heading_and_speed_sentences(&Reference { heading, speed: 1.5 });
        let own = sentences.lines().last().expect("there are four");
        assert!(own.starts_with(&format!("$PPLTF,{written},T,1.50,M*")), "{own}");
    }
}

#[test]
fn four_sentences_carry_heading_and_speed() {
    let reference = Reference { heading: -PI / 2.0, speed: 0.756 };
    let sentences = heading_and_speed_sentences(&reference);
    let without_checksums: Vec<&str> = sentences.lines().filter_map(|line| line.split('*').next()).collect();
    assert_eq!(
        without_checksums,
        [
            "$INHTC,V,,,H,N,,,,,270.0,,,T,C",
            "$INHTD,V,,,H,N,,,,,270.0,,,T,,,,",
            "$INAPB,A,A,0.00,R,N,V,V,270.0,T,PLAN,270.0,T,270.0,T,A",
            "$PPLTF,270.0,T,0.76,M",
        ]
    );
    // Well formed, and never read as a measurement.
    assert_eq!(read_at(&sentences, RECEIVED_S), (vec![], vec!["unused sentence"]));
}

#[test]
fn written_speeds_have_no_sign() {
    for speed in [0.0, -0.0, 0.004] {
        let sentences = heading_and_speed_sentences(&Reference { heading: 0.0, speed });
        assert!(sentences.contains("$PPLTF,000.0,T,0.00,M*"), "{sentences}");
    }
}
