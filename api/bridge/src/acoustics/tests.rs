//! Properties of every modem, for any bytes.

mod positions;

use proptest::prelude::*;

use super::mounting::Mounting;
use super::{CraftPose, Frame, KnownDepth, Modem, ModemKind, PoseHistory, Settings, sentences};
use crate::{AuvFix, on_earth};

const RECEIVED_S: f64 = 1_779_500_000.0;

const LONG: &str = "+++AT:124:USBLLONG,10446.991981,10446.534643,3,-0.0604,-1.0888,-0.5851,-0.4233,-1.0020,-0.5901,0.0063,0.0269,-0.3295,825,-36,77,1.2375\r\n";
const ANGLES: &str = "+++AT:116:USBLANGLES,1325377475.019626,1325377474.170448,2,-2.2959,-0.4586,-1.7643,-0.4293,0.0307,0.0766,0.5695,-16,296,0.0114\r\n";
const PING: &str = "$42020F07020101010101010101010101010101010101010101010101010101010101010101010101010101010101010101B0\r\n";

fn kinds() -> Vec<ModemKind> {
    let pattern = r"^(?<id>\S+) (?<range_m>\S+) (?<bearing_deg>\S+) (?<elevation_deg>\S+)( (?<t_s>\S+))?$";
    let mut kinds = vec![ModemKind::Sentences, ModemKind::Pattern { pattern: pattern.to_owned() }];
    for frame in [Frame::Body, Frame::Earth] {
        kinds.extend([ModemKind::Evologics { frame }, ModemKind::Seatrac { frame }]);
    }
    kinds
}

fn depth_at(t_s: f64) -> KnownDepth {
    KnownDepth { t_s, depth_m: 20.0, sigma_m: 0.2 }
}

fn modem(kind: ModemKind) -> Modem {
    let settings = Settings {
        modem: kind,
        names: [("3".to_owned(), "auv-c".to_owned())].into(),
        mounting: Some(Mounting {
            forward_m: 1.0,
            starboard_m: 0.5,
            down_m: 2.0,
            heading_offset_rad: 0.3,
            pitch_offset_rad: 0.0,
            roll_offset_rad: 0.0,
            depth_m: Some(1.5),
        }),
        sound_speed_mps: 1500.0,
        sigma_m: None,
        magnetic_declination_rad: 0.0,
    };
    let mut modem = Modem::new(&settings).expect("is usable");
    modem.note_depth("usbl-2", depth_at(RECEIVED_S));
    modem
}

fn poses() -> PoseHistory {
    let position = on_earth(60.0, 179.9999).expect("is on Earth");
    let mut poses = PoseHistory::default();
    poses.push(RECEIVED_S, CraftPose { position, heading: 1.0, roll: 0.0, pitch: 0.0 });
    poses
}

/// Lines that one of the modems reads.
fn samples() -> Vec<String> {
    let day_s = RECEIVED_S.rem_euclid(86_400.0);
    let (hours, minutes) = ((day_s / 3600.0).floor(), (day_s / 60.0).floor() % 60.0);
    let time = format!("{hours:02.0}{minutes:02.0}{:05.2}", day_s % 60.0);
    vec![
        LONG.to_owned(),
        ANGLES.to_owned(),
        PING.to_owned(),
        sentences::line(&format!(
            "PSONLLD,{time},2401,A,51.3315406,-0.83563975,999.916,5.33,5.33,0.00,0.62,,,,"
        )),
        sentences::line(&format!("PSIMSSB,{time},M17,A,,C,H,F,46.649,1.632,24.829,1.414,T,0.033681,")),
        "beacon-4 120.5 31.0 -20.0\n".to_owned(),
    ]
}

/// Pieces of a stream: samples whole, truncated or with one byte changed, and any bytes.
fn stream() -> impl Strategy<Value = Vec<u8>> {
    let sample = prop::sample::select(samples()).prop_map(String::into_bytes);
    let piece = prop_oneof![
        sample.clone(),
        (sample.clone(), any::<prop::sample::Index>())
            .prop_map(|(bytes, end)| bytes[..end.index(bytes.len())].to_vec()),
        (sample, any::<prop::sample::Index>(), any::<u8>()).prop_map(|(mut bytes, place, byte)| {
            let place = place.index(bytes.len());
            bytes[place] = byte;
            bytes
        }),
        prop::collection::vec(any::<u8>(), 0..40),
        r"[$*,:.0-9A-Fa-z+\r\n-]{0,60}".prop_map(String::into_bytes),
    ];
    prop::collection::vec(piece, 0..12).prop_map(|pieces| pieces.concat())
}

fn is_sound(fix: &AuvFix) -> bool {
    let numbers = [fix.t_s, fix.depth_m.unwrap_or(0.0)];
    let sigma_is_one = fix.sigma_m.is_none_or(|sigma| sigma.is_finite() && sigma > 0.0);
    let is_on_earth = on_earth(fix.position.lat_deg, fix.position.lon_deg).is_some();
    numbers.iter().all(|number| number.is_finite()) && sigma_is_one && is_on_earth && !fix.auv.is_empty()
}

fn lines_in(bytes: &[u8]) -> usize {
    bytes.iter().filter(|byte| b"\r\n".contains(byte)).count()
}

proptest! {
    #[test]
    fn any_bytes_give_valid_fixes_or_counted_rejects(bytes in stream(), received_s in any::<f64>()) {
        for kind in kinds() {
            for received_s in [RECEIVED_S, received_s] {
                let mut modem = modem(kind.clone());
                let fixes = modem.push(&bytes, received_s, &poses());
                prop_assert!(fixes.iter().all(is_sound), "{kind:?}: {fixes:?}");
                let n_lines = u64::try_from(fixes.len()).expect("are few") + modem.rejects.total();
                prop_assert!(n_lines <= u64::try_from(lines_in(&bytes)).expect("are few"));
            }
        }
    }

    #[test]
    fn splitting_the_stream_changes_nothing(bytes in stream(), cuts in prop::collection::vec(1_usize..30, 1..20)) {
        for kind in kinds() {
            let (mut whole, mut split) = (modem(kind.clone()), modem(kind.clone()));
            let expected = whole.push(&bytes, RECEIVED_S, &poses());
            let mut fixes = Vec::new();
            let mut rest = &bytes[..];
            for cut in cuts.iter().cycle() {
                let (piece, after) = rest.split_at((*cut).min(rest.len()));
                fixes.extend(split.push(piece, RECEIVED_S, &poses()));
                rest = after;
                if rest.is_empty() {
                    break;
                }
            }
            prop_assert_eq!(&fixes, &expected, "{:?}", kind);
            prop_assert_eq!(split.rejects, whole.rejects);
        }
    }

    #[test]
    fn a_damaged_line_with_a_checksum_is_never_a_fix(
        place in any::<prop::sample::Index>(), byte in any::<u8>(),
    ) {
        for sample in &samples()[2..5] {
            let mut bytes = sample.clone().into_bytes();
            let place = place.index(bytes.len() - 2);
            // Checksums ignore the case of hexadecimal digits, and a line's beginning and end.
            prop_assume!(!bytes[place].eq_ignore_ascii_case(&byte) && !b"\r\n".contains(&byte));
            bytes[place] = byte;
            for kind in kinds() {
                let checked = !matches!(kind, ModemKind::Pattern { .. });
                let fixes = modem(kind).push(&bytes, RECEIVED_S, &poses());
                prop_assert!(!checked || fixes.is_empty(), "{}", String::from_utf8_lossy(&bytes));
            }
        }
    }
}

#[test]
fn every_sample_is_a_fix_of_its_own_modem_only() {
    let samples = samples();
    for kind in kinds() {
        let mut modem = modem(kind.clone());
        let fixes = modem.push(samples.concat().as_bytes(), RECEIVED_S, &poses());
        let expected = match kind {
            ModemKind::Seatrac { .. } | ModemKind::Pattern { .. } => 1,
            ModemKind::Evologics { .. } | ModemKind::Sentences => 2,
        };
        assert_eq!(fixes.len(), expected, "{kind:?}: {}", modem.rejects);
        assert_eq!(modem.rejects.total(), 6 - u64::try_from(expected).expect("is small"));
    }
}

fn pattern(pattern: &str) -> Modem {
    modem(ModemKind::Pattern { pattern: pattern.to_owned() })
}

/// Claims that all lines of `text` are rejected, with these counts.
fn assert_rejected(modem: &mut Modem, text: &str, rejects: &str) {
    assert_eq!(modem.push(text.as_bytes(), RECEIVED_S, &poses()), [], "{text}");
    assert_eq!(modem.rejects.to_string(), rejects, "{text}");
}

const AT_TIME: &str = r"^(?<id>\w+) (?<lat_deg>\S+) (?<lon_deg>\S+) (?<t_s>\S+)$";
const CLOCKS_DIFFER: &str = "the modem's clock and ours differ";

#[test]
fn age_and_travel_time_are_subtracted_to_a_microsecond() {
    let mut modem = modem(ModemKind::Evologics { frame: Frame::Earth });
    let fixes = modem.push(LONG.as_bytes(), RECEIVED_S, &poses());
    let expected = RECEIVED_S - (10_446.991_981 - 10_446.534_643) - 825e-6;
    assert!((fixes[0].t_s - expected).abs() < 1e-6);
    assert_eq!((fixes[0].auv.as_str(), fixes[0].sigma_m), ("auv-c", Some(1.2375)));
    // The poses end 20 s before.
    let stale = modem.push(LONG.as_bytes(), RECEIVED_S + 20.0, &poses());
    assert_eq!(stale, []);
    assert_eq!(modem.rejects.to_string(), "no pose of the craft at that time: 1");
}

#[test]
fn times_that_set_clocks_cannot_have_are_rejected_by_name() {
    let age = r"^(?<id>\w+) (?<lat_deg>\S+) (?<lon_deg>\S+) (?<age_s>\S+)$";
    let travel = r"^(?<id>\w+) (?<lat_deg>\S+) (?<lon_deg>\S+) (?<travel_time_s>\S+)$";
    for (of, lines) in [
        (AT_TIME, "3 60 5 1e300\n3 60 5 1779500002\n"),
        (age, "3 60 5 61\n3 60 5 1e300\n"),
        (travel, "3 60 5 61\n3 60 5 1e9\n"),
    ] {
        assert_rejected(&mut pattern(of), lines, &format!("{CLOCKS_DIFFER}: 2"));
    }
    let noon_or_so = sentences::line("PSONLLD,000000,2401,A,51.3,-0.8,9,5,5,0,0.6,,,,");
    let mut modem = modem(ModemKind::Sentences);
    assert_rejected(&mut modem, &noon_or_so, &format!("{CLOCKS_DIFFER}: 1"));
}

#[test]
fn local_time_of_a_modem_is_named() {
    let local = "the modem's clock is on local time, not UTC";
    for of in [r"^(?<id>\w+) (?<north_m>\S+) (?<east_m>\S+) (?<t_s>\S+)$", AT_TIME] {
        for (ahead_s, expected) in [
            (7_200.0, local),
            (-18_000.0, local),
            (20_700.0, local),
            // GPS time, a lost hour and a half minute, another week.
            (18.0, CLOCKS_DIFFER),
            (-3_630.0, CLOCKS_DIFFER),
            (-619_315_200.0, CLOCKS_DIFFER),
        ] {
            // The line comes 0.4 s after the fix.
            let line = format!("3 60 5 {}\n", RECEIVED_S - 0.4 + ahead_s);
            assert_rejected(&mut pattern(of), &line, &format!("{expected}: 1"));
        }
    }
}

#[test]
fn a_fix_that_is_sent_again_counts_once() {
    let mut modem = pattern(AT_TIME);
    for (sent, received, n_fixes) in [(0.0, 0.0, 1), (0.0, 1.0, 0), (0.0, 2.0, 0), (5.0, 5.0, 1)] {
        let line = format!("3 60 5 {}\n", RECEIVED_S + sent);
        assert_eq!(modem.push(line.as_bytes(), RECEIVED_S + received, &poses()).len(), n_fixes);
    }
    assert_eq!(modem.rejects.to_string(), "repeated fix: 2");
}

#[test]
fn impossible_numbers_are_rejected_by_name() {
    let mut modem = pattern(r"^(?<id>\w+) (?<north_m>\S+) (?<east_m>\S+) (?<depth_m>\S+) (?<sigma_m>\S+)$");
    let lines = "3 1e300 0 1 1\n3 -1e160 1e160 1 1\n3 1 1 1e9 1\n3 1 1 1 1e200\n";
    assert_rejected(&mut modem, lines, "farther than sound carries: 4");
    let fixes = modem.push(b"3 0 0 1 1\n3 1 1 1 0\n", RECEIVED_S, &poses());
    assert_eq!(fixes.iter().map(|fix| fix.sigma_m).collect::<Vec<_>>(), [None]);
}

#[test]
fn angles_without_a_fresh_depth_are_rejected_by_name() {
    let mut modem = modem(ModemKind::Evologics { frame: Frame::Earth });
    modem.note_depth("usbl-2", depth_at(RECEIVED_S - 20.0));
    assert_rejected(&mut modem, ANGLES, "angles without a depth: 1");
    modem.note_depth("usbl-2", depth_at(RECEIVED_S));
    assert_eq!(modem.push(ANGLES.as_bytes(), RECEIVED_S, &poses()).len(), 1);
}
