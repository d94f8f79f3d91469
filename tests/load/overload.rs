//! Requests for plans in an open loop, which does not wait for the service, beside live missions.

use std::{cell::RefCell, error::Error, net::SocketAddr, rc::Rc, time::Duration};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tests::client::post;
use tokio::{
    task::LocalSet,
    time::{Instant, sleep_until},
};

use super::{
    http::Connection,
    tally::{Samples, memory},
};

/// The snapshot of every request.
const SNAPSHOT: &str = include_str!("../../examples/snapshots/intermittent.json");
/// Clients with one request at a time each, which find the rate that the service sustains.
const CLOSED_CLIENTS: usize = 4;
/// Time of measurement without overload.
const PROBE: Duration = Duration::from_secs(10);
/// Connections of the open loop; a request without one counts as not sent.
const CONNECTIONS_MAX: usize = 2_000;
/// The service has recovered when this many answers in a row are as fast as without load.
const RECOVERED: usize = 20;

/// The outcome of some requests.
#[derive(Debug, Default)]
struct Outcome {
    /// Time from a request's due time to its answer, ms.
    planned: Samples,
    /// Times of refusals.
    shed: Samples,
    other: u64,
    lost: u64,
    not_sent: u64,
}

impl Outcome {
    fn table(&self, seconds: f64) -> String {
        #[expect(clippy::cast_precision_loss, reason = "counts of minutes")]
        let rate = |n: usize| n as f64 / seconds;
        let rows = [("planned", &self.planned), ("turned away", &self.shed)].map(|(name, samples)| {
            let (n, spread) = (samples.len(), samples.all());
            format!("  {name}: {n}, {:.0}/s, p50/p99/max {spread} ms\n", rate(n))
        });
        let (other, lost, not_sent) = (self.other, self.lost, self.not_sent);
        rows.concat() + &format!("  other answers {other}, not answered {lost}, not sent {not_sent}\n")
    }
}

type Counted = Rc<RefCell<Outcome>>;

/// Asks once, and counts the answer. `due` is when the request should have been sent.
async fn ask(connection: &mut Connection, due: Instant, counted: &Counted) {
    let answer = connection.ask(post("/v1/plan", SNAPSHOT)).await;
    let ms = due.elapsed().as_secs_f64() * 1e3;
    let mut counted = counted.borrow_mut();
    match answer.map(|answer| answer.status) {
        Ok(200) => counted.planned.add(ms),
        Ok(503) => counted.shed.add(ms),
        Ok(_) => counted.other += 1,
        Err(_) => counted.lost += 1,
    }
}

/// This number of clients, each with one request at a time.
async fn closed(address: SocketAddr, clients: usize, time: Duration) -> Counted {
    let counted = Counted::default();
    let end = Instant::now() + time;
    let tasks = LocalSet::new();
    for _ in 0..clients {
        let counted = Rc::clone(&counted);
        tasks.spawn_local(async move {
            let mut connection = Connection::new(address);
            while Instant::now() < end {
                ask(&mut connection, Instant::now(), &counted).await;
            }
        });
    }
    tasks.await;
    counted
}

/// Requests at random moments, `rate` a second on average.
async fn open(address: SocketAddr, rate: f64, time: Duration) -> Counted {
    let counted = Counted::default();
    let free: Rc<RefCell<Vec<Connection>>> = Rc::default();
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let mut made = 0;
    let mut due = Instant::now();
    let end = due + time;
    let tasks = LocalSet::new();
    tasks
        .run_until(async {
            while due < end {
                due += Duration::from_secs_f64(-random.random::<f64>().max(1e-12).ln() / rate);
                sleep_until(due).await;
                let connection = free.borrow_mut().pop();
                let connection = connection.or_else(|| {
                    (made < CONNECTIONS_MAX).then(|| {
                        made += 1;
                        Connection::new(address)
                    })
                });
                let Some(mut connection) = connection else {
                    counted.borrow_mut().not_sent += 1;
                    continue;
                };
                let (counted, free) = (Rc::clone(&counted), Rc::clone(&free));
                tokio::task::spawn_local(async move {
                    ask(&mut connection, due, &counted).await;
                    free.borrow_mut().push(connection);
                });
            }
        })
        .await;
    tasks.await;
    counted
}

/// Time until plans come within `most` ms again.
async fn recovery(address: SocketAddr, most: f64) -> Duration {
    let begun = Instant::now();
    let mut connection = Connection::new(address);
    let (mut in_a_row, mut since) = (0, begun);
    while in_a_row < RECOVERED {
        let counted = Counted::default();
        ask(&mut connection, Instant::now(), &counted).await;
        let planned = counted.borrow().planned.all();
        if planned.high() <= most {
            in_a_row += 1;
        } else {
            in_a_row = 0;
            since = Instant::now();
        }
    }
    since - begun
}

/// Measures without overload, at `factor` times the sustained rate, and during the recovery.
pub(crate) async fn run(
    address: SocketAddr,
    factor: f64,
    time: Duration,
    pid: Option<u32>,
) -> Result<(), Box<dyn Error>> {
    let alone = closed(address, 1, PROBE).await;
    println!("one client\n{}", alone.borrow().table(PROBE.as_secs_f64()));
    let several = closed(address, CLOSED_CLIENTS, PROBE).await;
    let table = several.borrow().table(PROBE.as_secs_f64());
    println!("{CLOSED_CLIENTS} clients\n{table}");
    #[expect(clippy::cast_precision_loss, reason = "counts of seconds")]
    let sustainable = several.borrow().planned.len() as f64 / PROBE.as_secs_f64();
    if sustainable == 0.0 {
        return Err("the service makes no plan".into());
    }
    println!("memory before overload {}", memory(pid));

    let rate = factor * sustainable;
    let overload = open(address, rate, time).await;
    let highest_alone = alone.borrow().planned.all().high();
    let recovered = recovery(address, 2.0 * highest_alone).await;
    println!(
        "open loop, {rate:.0} requests a second: {factor} times what {CLOSED_CLIENTS} clients get\n{}",
        overload.borrow().table(time.as_secs_f64())
    );
    println!(
        "p99 of plans is {:.2} times that of one client; recovered in {:.2} s; memory {}",
        overload.borrow().planned.all().high() / highest_alone,
        recovered.as_secs_f64(),
        memory(pid)
    );
    Ok(())
}
