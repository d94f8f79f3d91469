//! Selects one of several sources of a quantity, and compares the others with it.

use std::collections::BTreeMap;

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Source {
    /// Number of the wire: 0 is the autopilot's. Lower numbers come first.
    pub(crate) wire: usize,
    /// The talker of an NMEA 0183 sentence.
    pub(crate) talker: [u8; 2],
}

/// Silence after which another source is used, s.
const HOLD_S: f64 = 2.0;
/// Time for which a better source must send before it is used again, s.
const RETURN_S: f64 = 5.0;
/// Time for which sources must differ, s.
const DIFFER_S: f64 = 5.0;
/// Most sources of one quantity: more talkers are noise.
const SOURCES_MAX: usize = 8;

#[derive(Clone, Debug)]
pub(super) struct Sources<T> {
    streams: BTreeMap<Source, Stream<T>>,
    used: Option<Source>,
}

#[derive(Clone, Copy, Debug)]
struct Stream<T> {
    since_s: f64,
    last_s: f64,
    value: T,
    /// The beginning and the end, s, of its difference from the used source.
    apart: Option<(f64, f64)>,
}

impl<T> Default for Sources<T> {
    fn default() -> Self {
        Self { streams: BTreeMap::new(), used: None }
    }
}

impl Sources<()> {
    /// `true` if `source` is the used one at `t_s`, s, of a quantity that is not compared.
    pub(super) fn uses_any(&mut self, t_s: f64, source: Source) -> bool {
        self.uses(t_s, source, (), |(), (), _| false)
    }
}

impl<T: Copy> Sources<T> {
    /// `true` if `source` is the used one at `t_s`, s. `apart` compares two values whose times
    /// differ by some seconds.
    pub(super) fn uses(
        &mut self,
        t_s: f64,
        source: Source,
        value: T,
        apart: impl Fn(&T, &T, f64) -> bool,
    ) -> bool {
        let speaks = |stream: &Stream<T>| (t_s - stream.last_s).abs() <= HOLD_S;
        if self.streams.len() >= SOURCES_MAX && !self.streams.contains_key(&source) {
            self.streams.retain(|_, stream| speaks(stream));
            if self.streams.len() >= SOURCES_MAX {
                return false;
            }
        }
        let before = self.streams.get(&source).filter(|stream| speaks(stream));
        let since_s = before.map_or(t_s, |stream| stream.since_s);
        let was_apart = self.streams.get(&source).and_then(|stream| stream.apart);
        let newest = Stream { since_s, last_s: t_s, value, apart: None };
        self.streams.insert(source, newest);
        let used = self
            .used
            .and_then(|used| Some((used, *self.streams.get(&used).filter(|stream| speaks(stream))?)));
        let (used, stream) = match used {
            Some((used, _)) if source.wire < used.wire && t_s - since_s >= RETURN_S => (source, newest),
            Some(used) => used,
            None => (source, newest),
        };
        self.used = Some(used);
        if used == source {
            // A source that fell silent contradicts nothing.
            for other in self.streams.values_mut() {
                other.apart = other.apart.filter(|(_, until_s)| t_s - until_s <= DIFFER_S);
            }
        } else if apart(&value, &stream.value, t_s - stream.last_s) {
            let since_s = was_apart.map_or(t_s, |(since_s, _)| since_s);
            self.streams.insert(source, Stream { apart: Some((since_s, t_s)), ..newest });
        }
        used == source
    }

    /// `true` if a source has differed from the used one for long.
    pub(super) fn differ(&self) -> bool {
        let mut apart = self.streams.values().filter_map(|stream| stream.apart);
        apart.any(|(since_s, until_s)| until_s - since_s >= DIFFER_S)
    }
}
