//! The wire of a MOOSDB.

mod craft;
mod packets;
mod steering;

use super::client::MoosClient;
use super::packet::{Message, NOTIFY, WELCOME, packet};
use crate::mavlink::AutopilotEvent;
use crate::{Measurement, Origin};

/// Unix time of arrival at 10 s of the bridge's clock, s.
const NOW_S: f64 = 1.7e9;
/// The datum of the examples of MOOS-IvP.
const DATUM: Origin = Origin { lat_deg: 43.8253, lon_deg: -70.3304 };

/// A number or a text.
#[derive(Clone, Copy)]
enum Value<'a> {
    Number(f64),
    Text(&'a str),
}
use Value::{Number, Text};

/// A client with a welcome from the database of `craft`, and one AUV.
fn client(datum: Option<Origin>, is_raw: bool) -> MoosClient {
    let mut client = MoosClient::new(&["auv-1".to_owned()], datum, is_raw);
    client.connect(10.0, NOW_S);
    let welcome = Message { kind: WELCOME, ..message("", Text("asynchronous"), NOW_S) };
    let welcome = Message { number: 0.25, ..welcome };
    assert_eq!(client.push(&packet(&[welcome]), 10.0, NOW_S), [AutopilotEvent::Time(NOW_S + 0.25)]);
    client
}

fn message(key: &str, value: Value, t_s: f64) -> Message {
    let (number, text) = match value {
        Number(number) => (number, None),
        Text(text) => (0.0, Some(text.to_owned())),
    };
    let (source, community, key) = ("uSimMarine".to_owned(), "craft".to_owned(), key.to_owned());
    Message { kind: NOTIFY, source, community, key, t_s, number, text }
}

/// The events of these variables, written and received this long after `NOW_S`, s.
fn heard<const N: usize>(
    client: &mut MoosClient,
    after: f64,
    variables: [(&str, Value); N],
) -> Vec<AutopilotEvent> {
    let messages = variables.map(|(key, value)| message(key, value, NOW_S + after));
    client.push(&packet(&messages), 10.0 + after, NOW_S + after)
}

/// The measurements among `events`.
fn measured(events: &[AutopilotEvent]) -> Vec<&Measurement> {
    fn measured(event: &AutopilotEvent) -> Option<&Measurement> {
        if let AutopilotEvent::Measured(measurement) = event { Some(measurement) } else { None }
    }
    events.iter().filter_map(measured).collect()
}
