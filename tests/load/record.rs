//! The plans in the records of missions.

use std::{collections::BTreeMap, fmt, io, net::SocketAddr};

use serde::Deserialize;
use tests::client::get;

use super::http::Lines;

/// The members of a record's line that matter here.
#[derive(Debug, Deserialize)]
struct Line {
    sequence: u64,
    kind: String,
    t_s: Option<f64>,
    late_s: Option<f64>,
    outcome: Option<String>,
    reason: Option<String>,
}

/// Plans of many missions.
#[derive(Debug, Default)]
pub(crate) struct Plans {
    missions: u64,
    reported: u64,
    planned: u64,
    /// Largest time between two plans of a mission, s.
    interval_max: f64,
    /// Largest time from a plan's due time to just before its storage, s.
    late_max: f64,
    degraded: BTreeMap<String, u64>,
    /// Events whose number does not continue the previous event's.
    breaks: u64,
}

impl Plans {
    /// Takes up the record of one more mission, as it is read.
    pub(crate) async fn read(&mut self, address: SocketAddr, id: &str) -> io::Result<()> {
        let get = get(&format!("/v1/missions/{id}/record?format=events_ndjson"));
        let mut lines = Lines::of(address, get).await?;
        if lines.status != 200 {
            let problem = lines.next().await?.unwrap_or_default();
            return Err(io::Error::other(format!("{}: {problem}", lines.status)));
        }
        self.missions += 1;
        let (mut sequence, mut before) = (0, None);
        while let Some(line) = lines.next().await? {
            let line: Line = serde_json::from_str(&line)?;
            self.breaks += u64::from(line.sequence != sequence + 1);
            sequence = line.sequence;
            match line.kind.as_str() {
                "reported" => self.reported += 1,
                "planned" => self.take_up(line, &mut before),
                _ => {}
            }
        }
        Ok(())
    }

    fn take_up(&mut self, line: Line, before: &mut Option<f64>) {
        self.planned += 1;
        self.late_max = self.late_max.max(line.late_s.unwrap_or(f64::INFINITY));
        if let (Some(before), Some(t_s)) = (*before, line.t_s) {
            self.interval_max = self.interval_max.max(t_s - before);
        }
        *before = line.t_s;
        if line.outcome.as_deref() == Some("degraded") {
            let reason = line.reason.unwrap_or_else(|| "none given".to_owned());
            *self.degraded.entry(reason).or_default() += 1;
        }
    }
}

impl fmt::Display for Plans {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (missions, breaks) = (self.missions, self.breaks);
        writeln!(out, "records                  {missions} missions, {breaks} breaks")?;
        writeln!(out, "posts in the log         {}", self.reported)?;
        writeln!(out, "plans in the log         {}", self.planned)?;
        writeln!(out, "largest interval, s      {:.3}", self.interval_max)?;
        writeln!(out, "largest late_s, s        {:.3}", self.late_max)?;
        writeln!(out, "degraded                 {:?}", self.degraded)
    }
}
