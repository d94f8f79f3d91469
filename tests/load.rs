//! Hundreds of missions, from outside: `load --missions 200 --minutes 10 --pid PID`.
//!
//! Every mission has two AUVs and a surface craft, posts reports once a second at its own times,
//! and reads the reference twice in between. On one machine, clients and service share the cores.

use std::{error::Error, net::SocketAddr, time::Duration};

use clap::Parser;
use tests::client::post;
use tokio::task::JoinSet;
use tokio::time::{Instant, sleep, sleep_until};

#[path = "load/flight.rs"]
mod flight;
#[path = "load/http.rs"]
mod http;
#[path = "load/record.rs"]
mod record;
#[path = "load/tally.rs"]
mod tally;

use flight::{Flight, make};
use http::Connection;
use record::Plans;
use tally::{Shared, memory};

/// Least time between two created missions. No divisor of a second: plans are due whole seconds
/// after creation, and so spread evenly over every second.
const APART_MIN: Duration = Duration::from_millis(17);
/// Between two lines of progress.
const TELL_EVERY: Duration = Duration::from_secs(30);
/// Time after which memory should no longer grow.
const WARM: Duration = Duration::from_mins(2);
/// Between two steps.
const STEP: Duration = Duration::from_mins(1);
/// Age of a plan that is late by half a period, s.
const LATE_AGE: f64 = 1.5;

/// Posts to many live missions and says how the service bears it.
#[derive(Debug, Parser)]
struct Arguments {
    /// The service's URL.
    #[arg(long, default_value = "http://127.0.0.1:8080")]
    url: String,
    /// Number of missions.
    #[arg(long, default_value_t = 200)]
    missions: usize,
    /// Duration, minutes.
    #[arg(long, default_value_t = 10.0)]
    minutes: f64,
    /// Process of the service, whose memory is reported.
    #[arg(long)]
    pid: Option<u32>,
    /// Other vessels that each mission's reports tell of, within a kilometre.
    #[arg(long, default_value_t = 0)]
    vessels: usize,
    /// Add so many missions every minute instead, until the service has too much to do.
    #[arg(long)]
    step: Option<usize>,
}

#[tokio::main(flavor = "current_thread")]
async fn main() -> Result<(), Box<dyn Error>> {
    let arguments = Arguments::parse();
    let address = arguments.url.trim_start_matches("http://").trim_end_matches('/');
    let address: SocketAddr = address.parse()?;
    let mut load = Load::new(address, arguments.pid, arguments.vessels);
    let time = Duration::from_secs_f64(60.0 * arguments.minutes);
    match arguments.step {
        Some(step) => load.step(step).await?,
        None => load.keep(arguments.missions, time).await?,
    }
    load.account().await
}

/// Missions under way, and their results so far.
struct Load {
    address: SocketAddr,
    pid: Option<u32>,
    vessels: usize,
    shared: Shared,
    ids: Vec<String>,
    flights: JoinSet<()>,
    begun: Instant,
}

impl Load {
    fn new(address: SocketAddr, pid: Option<u32>, vessels: usize) -> Self {
        Self {
            address,
            pid,
            vessels,
            shared: Shared::default(),
            ids: vec![],
            flights: JoinSet::new(),
            begun: Instant::now(),
        }
    }

    /// Creates that many missions that last until `end`; `true` if the service took all.
    async fn add(&mut self, missions: usize, end: Instant) -> Result<bool, Box<dyn Error>> {
        // The service closes one that is idle for 10 s.
        let mut connection = Connection::new(self.address);
        let apart = Duration::from_secs(1) / u32::try_from(missions.max(1))?;
        for _ in 0..missions {
            let next = Instant::now() + apart.max(APART_MIN);
            let Some(id) = make(&mut connection, &self.shared).await? else { return Ok(false) };
            let flight =
                Flight::new(self.address, self.ids.len(), id.clone(), self.vessels, self.shared.clone());
            self.ids.push(id);
            self.flights.spawn(flight.fly(end));
            sleep_until(next).await;
        }
        Ok(true)
    }

    /// So many missions for so long.
    async fn keep(&mut self, missions: usize, time: Duration) -> Result<(), Box<dyn Error>> {
        let end = self.begun + time;
        println!("memory before: {}", memory(self.pid));
        self.add(missions, end).await?;
        let mut warm = Some(self.begun + WARM);
        let mut tell = self.begun + TELL_EVERY;
        while Instant::now() < end {
            sleep_until(tell.min(end)).await;
            if warm.is_some_and(|warm| warm <= Instant::now()) {
                println!("memory at minute 2: {}", memory(self.pid));
                warm = None;
            }
            self.tell();
            tell += TELL_EVERY;
        }
        Ok(())
    }

    /// More and more missions, until there are too many.
    async fn step(&mut self, step: usize) -> Result<(), Box<dyn Error>> {
        // Long after any machine has enough.
        let end = self.begun + Duration::from_hours(24);
        let sign = loop {
            let next = Instant::now() + STEP;
            let took_all = self.add(step, end).await?;
            let sign = self.watch(next).await;
            self.tell();
            match sign {
                Some(sign) => break sign,
                None if took_all => {}
                None => break "it takes on no more".to_owned(),
            }
        };
        println!("\ntoo much to do with {} missions: {sign}", self.ids.len());
        self.flights.abort_all();
        Ok(())
    }

    /// The first sign of too much work until `end`.
    async fn watch(&self, end: Instant) -> Option<String> {
        while Instant::now() < end {
            let sign = self.shared.lock().sign(LATE_AGE);
            if sign.is_some() {
                return sign;
            }
            sleep(Duration::from_millis(100)).await;
        }
        None
    }

    fn tell(&self) {
        let progress = self.shared.lock().progress();
        let seconds = self.begun.elapsed().as_secs();
        let (missions, memory) = (self.ids.len(), memory(self.pid));
        println!("{seconds} s, {missions} missions: {progress}; memory {memory}");
    }

    /// Ends all missions, and prints the measurements of clients and records.
    async fn account(mut self) -> Result<(), Box<dyn Error>> {
        while self.flights.join_next().await.is_some() {}
        println!("\nmemory at the end        {}", memory(self.pid));
        print!("{}", self.shared.lock().table());
        let mut plans = Plans::default();
        let mut connection = Connection::new(self.address);
        for id in &self.ids {
            let finish = post(&format!("/v1/missions/{id}/finish"), "");
            let finished = connection.ask(finish).await?;
            if finished.status != 200 {
                let problem = String::from_utf8_lossy(&finished.body);
                println!("{id} is not finished: {problem}");
            }
        }
        for id in &self.ids {
            plans.read(self.address, id).await?;
        }
        print!("{plans}");
        println!("memory after the records {}", memory(self.pid));
        Ok(())
    }
}
