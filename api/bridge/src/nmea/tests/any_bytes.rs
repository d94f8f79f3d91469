//! Properties for any bytes in any pieces.

use proptest::prelude::*;

use super::*;

/// Bits of a byte.
const BITS: u32 = 8;

fn everything_in<'a>(pieces: impl IntoIterator<Item = &'a [u8]>) -> (Vec<Measurement>, Rejects) {
    let mut reader = NmeaReader::default();
    let read = pieces.into_iter().flat_map(|piece| reader.push(piece, RECEIVED_S)).collect();
    (read, reader.rejects().clone())
}

fn are_numbers(measurement: &Measurement) -> bool {
    let Measurement::Craft { t_s, measured, .. } = measurement else {
        return matches!(measurement, Measurement::Vessel(_));
    };
    let (first, second) = numbers_of(measured);
    t_s.is_finite() && first.is_finite() && second.is_finite()
}

/// Sentences with right checksums around any numbers and invalid text.
fn any_sentence() -> impl Strategy<Value = String> {
    let kind = prop::sample::select(vec![
        "GGA", "GLL", "RMC", "VTG", "HDT", "THS", "ROT", "VHW", "VBW", "HDG", "GSV",
    ]);
    let field = prop_oneof![
        "[-+]?[0-9]{0,5}(\\.[0-9]{0,5})?",
        prop::sample::select(vec![
            "", "A", "V", "N", "S", "E", "W", "T", "M", "K", "1", "nan", "inf", "1e400"
        ])
        .prop_map(str::to_owned),
        "[ -~&&[^*$!]]{0,9}",
    ];
    (kind, prop::collection::vec(field, 0..14))
        .prop_map(|(kind, fields)| with_checksum(&format!("GP{kind},{}", fields.join(","))))
}

/// Sentences that give measurements.
fn any_good_sentence() -> impl Strategy<Value = String> {
    let talker = prop::sample::select(vec!["GP", "GN", "HE", "II", "VW"]);
    let (angle, knots, rate) = (0.0..=360.0_f64, 0.0..=102.0_f64, -720.0..=720.0_f64);
    let minutes = || 0.0..59.99_f64;
    (talker, 0..8, (angle, knots, rate), (0..90_usize, minutes(), 0..180_usize, minutes())).prop_map(
        |(talker, kind, (angle, knots, rate), (lat, lat_min, lon, lon_min))| {
            let (south, west) = (["N", "S"][lat % 2], ["E", "W"][lon % 2]);
            let place = format!("{lat:02}{lat_min:07.4},{south},{lon:03}{lon_min:07.4},{west}");
            let sentence = match kind {
                0 => format!("GGA,123519.5,{place},4,12,0.7,1.0,M,2.0,M,,"),
                1 => format!("RMC,123519.5,A,{place},{knots:.2},{angle:.1},140326,,,A"),
                2 => format!("VTG,{angle:.2},T,,M,{knots:.2},N,,K,D"),
                3 => format!("HDT,{angle:.1},T"),
                4 => format!("THS,{angle:.2},A"),
                5 => format!("ROT,{rate:.1},A"),
                6 => format!("VHW,{angle:.1},T,,M,,N,{knots:.1},K"),
                _ => format!("VBW,{:.1},{knots:.1},A,,,V", -knots),
            };
            with_checksum(&format!("{talker}{sentence}"))
        },
    )
}

/// Wires: published sentences, damaged ones, and any bytes, with and without line ends.
fn any_wire() -> impl Strategy<Value = Vec<u8>> {
    let piece = prop_oneof![
        prop::sample::select(PUBLISHED.to_vec()).prop_map(|sentence| sentence.as_bytes().to_vec()),
        any_sentence().prop_map(String::into_bytes),
        any_good_sentence().prop_map(String::into_bytes),
        prop::sample::select(vec!["\r\n", "\n", "\r", "$", "!", "*"])
            .prop_map(|text| text.as_bytes().to_vec()),
        prop::collection::vec(any::<u8>(), 0..200),
    ];
    prop::collection::vec(piece, 0..12).prop_map(|pieces| pieces.concat())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2_000))]

    #[test]
    fn any_bytes_are_read_without_a_panic_and_give_numbers(wire in any_wire()) {
        let (read, _) = everything_in([wire.as_slice()]);
        prop_assert!(read.iter().all(are_numbers), "{read:?}");
    }

    #[test]
    fn every_good_sentence_is_read(sentence in any_good_sentence()) {
        let (read, rejected) = everything_in([sentence.as_bytes()]);
        prop_assert!(!read.is_empty() && rejected.total() == 0, "{rejected}");
    }

    #[test]
    fn splitting_a_stream_changes_nothing(
        wire in any_wire(),
        cuts in prop::collection::vec(any::<prop::sample::Index>(), 0..20),
    ) {
        let mut cuts: Vec<usize> = cuts.iter().map(|cut| cut.index(wire.len() + 1)).collect();
        cuts.extend([0, wire.len()]);
        cuts.sort_unstable();
        let pieces = cuts.windows(2).map(|ends| &wire[ends[0]..ends[1]]);
        prop_assert_eq!(everything_in(pieces), everything_in([wire.as_slice()]));
        let bytes = wire.chunks(1);
        prop_assert_eq!(everything_in(bytes), everything_in([wire.as_slice()]));
    }

    #[test]
    fn memory_is_bounded(wire in prop::collection::vec(any::<u8>(), 0..2_000)) {
        let mut reader = NmeaReader::default();
        reader.push(b"$", RECEIVED_S);
        reader.push(&wire, RECEIVED_S);
        prop_assert!(reader.line.len() <= LINE_MAX);
    }

}

#[test]
fn no_flipped_bit_in_a_published_sentence_gives_another_measurement() {
    for sentence in PUBLISHED {
        // Between two others, so that a lost line end joins sentences.
        let wire = format!("{HDT}\r\n{sentence}\r\n{ROT}\r\n").into_bytes();
        let right = everything_in([wire.as_slice()]).0;
        for byte in 0..wire.len() {
            for bit in 0..BITS {
                let mut damaged = wire.clone();
                damaged[byte] ^= 1 << bit;
                let read = everything_in([damaged.as_slice()]).0;
                assert!(
                    read.iter().all(|measurement| right.contains(measurement)),
                    "{:?}",
                    String::from_utf8_lossy(&damaged)
                );
            }
        }
    }
}
