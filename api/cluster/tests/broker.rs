//! Campaigns over a broker that the tests start from NATS_SERVER; `.ci/nats` tries two versions.

#![expect(clippy::disallowed_methods, reason = "a real broker lives in real time")]

use std::net::TcpListener;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::Mutex;
use std::time::Duration;

use async_nats::jetstream;
use clock::Clock;
use futures_util::StreamExt as _;
use lab::campaign::{Campaign, Directory, Manifest, ScenarioFiles, Shard, rows::SCHEMA_VERSION, run};
use pilotfish_cluster::{
    Access, Broker, ClusterError, Submitted, Worker, WorkerEvent, collect, progress, submit,
};
use rcgen::{BasicConstraints, CertificateParams, IsCa, Issuer, KeyPair};
use sim::scenario::Scenario;
use tempfile::TempDir;
use tokio::{sync::watch, time::sleep};

const SMALL: &str = r#"
schema_version = "1"
name = "small"
title = "a campaign for a cluster"
seed = 3
scenarios = ["paper-tracking", "switching"]
duration_s = 30
replicates = 6
[tuning]
replicates = 1
[[controllers]]
name = "mpc auto"
planner = {}
[[controllers]]
name = "saturated_los"
law = { name = "saturated_los" }
[[controllers]]
name = "as it is"
law = { name = "saturated_los", gains = { look_ahead_m = 5, along_track_gain_per_s = 0.1 } }
"#;

/// A broker on its own port.
struct Server {
    child: Mutex<Child>,
    port: u16,
    data: TempDir,
    flags: Vec<String>,
}

fn free_port() -> u16 {
    let socket = TcpListener::bind("127.0.0.1:0").expect("has a port");
    socket.local_addr().expect("has one").port()
}

impl Server {
    fn start() -> Self {
        Self::with(vec![])
    }

    fn with(flags: Vec<String>) -> Self {
        let (port, data) = (free_port(), TempDir::new().expect("is a folder"));
        let child = Mutex::new(Self::spawn(port, data.path(), &flags));
        Self { child, port, data, flags }
    }

    /// Three servers that form one broker.
    fn three() -> Vec<Self> {
        let routes: Vec<String> = (0..3).map(|_| format!("nats://127.0.0.1:{}", free_port())).collect();
        let flags = |(i, own): (usize, &String)| {
            let all = routes.join(",");
            let flags = format!("--name s{i} --cluster_name three --cluster {own} --routes {all}");
            flags.split(' ').map(str::to_owned).collect()
        };
        routes.iter().enumerate().map(flags).map(Self::with).collect()
    }

    fn spawn(port: u16, data: &Path, flags: &[String]) -> Child {
        let program =
            std::env::var("NATS_SERVER").expect("NATS_SERVER names a nats-server; .ci/nats sets it");
        let (data, port) = (data.display().to_string(), port.to_string());
        let mut command = Command::new(program);
        command.args(["-js", "-a", "127.0.0.1", "-p", &port, "-sd", &data]);
        let silent = command.args(flags).stdout(Stdio::null()).stderr(Stdio::null());
        silent.spawn().expect("nats-server starts")
    }

    fn kill(&self) {
        let mut child = self.child.lock().expect("no panic holds it");
        child.kill().expect("runs");
        child.wait().expect("was started");
    }

    /// Kills the broker, and starts it again on the same port and data.
    fn restart(&self) {
        self.kill();
        *self.child.lock().expect("no panic holds it") =
            Self::spawn(self.port, self.data.path(), &self.flags);
    }

    /// Access with this login, or none.
    fn access(&self, login: &str) -> Access {
        Access { url: format!("nats://{login}127.0.0.1:{}", self.port), ..Access::default() }
    }

    async fn broker(&self) -> Broker {
        self.broker_for(&self.access("")).await
    }

    async fn broker_for(&self, access: &Access) -> Broker {
        for _ in 0..100 {
            if let Ok(broker) = Broker::connect(access, "test", &Clock::machine()).await {
                return broker;
            }
            sleep(Duration::from_millis(100)).await;
        }
        panic!("nats-server does not answer");
    }

    async fn plain(&self) -> jetstream::Context {
        let client = async_nats::connect(format!("127.0.0.1:{}", self.port)).await;
        jetstream::new(client.expect("answers"))
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        if let Ok(child) = self.child.get_mut() {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

fn small(text: &str) -> Campaign {
    Campaign::parse(text, "small.toml", ScenarioFiles::default()).expect("is a campaign")
}

/// The digest of the rows of a single process.
fn flown_here(campaign: &Campaign) -> String {
    let folder = TempDir::new().expect("is a folder");
    let directory = Directory::create(folder.path(), Manifest::of(campaign, Shard::WHOLE)).expect("is new");
    let jobs = std::num::NonZeroUsize::new(2).expect("positive");
    let rows = run(campaign, &directory, jobs, &mut |_| {});
    rows.expect("flies").digest()
}

async fn sent(broker: &Broker, campaign: &Campaign) -> Submitted {
    submit(broker, campaign, 1).await.expect("is sent")
}

/// The digest of the rows of a campaign whose work is done.
async fn collected(broker: &Broker, id: &str) -> String {
    let folder = TempDir::new().expect("is a folder");
    let (_, rows) = collect(broker, id, folder.path()).await.expect("all is there");
    rows.digest()
}

/// Lets workers work until the campaign is over.
async fn work(
    server: &Server,
    id: &str,
    workers: usize,
    tries_max: i64,
    mut meanwhile: impl AsyncFnMut(usize),
) -> Vec<WorkerEvent> {
    let events = Mutex::new(vec![]);
    let notify = |event: WorkerEvent| events.lock().expect("no panic holds it").push(event);
    let (stop, stopped) = watch::channel(false);
    let mut crew = vec![];
    for _ in 0..workers {
        crew.push(Worker::new(server.broker().await, 1, tries_max));
    }
    let runs = crew.iter().map(|worker| worker.run(stopped.clone(), None, &notify));
    let flying = futures_util::future::join_all(runs);
    let watching = async {
        let broker = server.broker().await;
        for step in 0..600 {
            meanwhile(step).await;
            let progress = progress(&broker, id).await;
            if progress.is_ok_and(|progress| progress.is_over()) {
                break;
            }
            sleep(Duration::from_millis(200)).await;
        }
        stop.send(true).expect("they listen");
    };
    let (ended, ()) = tokio::join!(flying, watching);
    for end in ended {
        end.expect("works");
    }
    events.into_inner().expect("no panic held it")
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn any_number_of_workers_gives_the_rows_of_one_process() {
    let campaign = small(SMALL);
    let here = flown_here(&campaign);
    for workers in [1, 2, 4] {
        let (server, folder) = (Server::start(), TempDir::new().expect("is a folder"));
        let broker = server.broker().await;
        let first = sent(&broker, &campaign).await;
        // Gains first: chunks are sent once the gains of their case are found.
        assert_eq!((first.sent, first.done), (2, 0));
        let early = collect(&broker, &first.id, &folder.path().join("early")).await;
        assert!(matches!(early, Err(ClusterError::Unfinished(0, _))));
        work(&server, &first.id, workers, 5, async |_| {}).await;
        // The same bytes twice, also in measured columns.
        let mut bytes = vec![];
        for name in ["a", "b"] {
            let path = folder.path().join(name);
            let (_, rows) = collect(&broker, &first.id, &path).await.expect("all is there");
            assert_eq!(rows.digest(), here, "{workers} workers");
            bytes.push(std::fs::read(path.join("runs.parquet")).expect("is written"));
        }
        assert_eq!(bytes[0], bytes[1]);
        let again = sent(&broker, &campaign).await;
        assert_eq!((again.sent, again.done), (0, campaign.chunks().len()));
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn scenario_files_travel_to_workers_that_do_not_have_them() {
    let folder = TempDir::new().expect("is a folder");
    let file = folder.path().join("campaign.toml");
    let scenario = Scenario::text("cross-current").expect("is built in");
    let mine = scenario.replace("\"cross-current\"", "\"mine\"");
    std::fs::write(folder.path().join("mine.toml"), mine).expect("is written");
    let text = SMALL.replace("scenarios = [", "scenarios = [\"mine.toml\", ");
    std::fs::write(&file, text).expect("is written");
    let campaign = Campaign::read(&file).expect("is a campaign");
    drop(folder);
    let (server, folder) = (Server::start(), TempDir::new().expect("is a folder"));
    let broker = server.broker().await;
    let id = sent(&broker, &campaign).await.id;
    work(&server, &id, 1, 5, async |_| {}).await;
    let (_, rows) = collect(&broker, &id, folder.path()).await.expect("all is there");
    assert!(rows.words("scenario").expect("a column").contains(&"mine"));
    assert_eq!(rows.digest(), flown_here(&campaign));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_broker_that_is_killed_twice_loses_nothing() {
    let campaign = small(&SMALL.replace("duration_s = 30", "duration_s = 120"));
    let here = flown_here(&campaign);
    let server = Server::start();
    let id = sent(&server.broker().await, &campaign).await.id;
    work(&server, &id, 2, 20, async |step| {
        if step == 5 || step == 20 {
            server.restart();
        }
    })
    .await;
    assert_eq!(collected(&server.broker().await, &id).await, here);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn work_that_never_succeeds_is_given_up_and_named() {
    let campaign = small(SMALL);
    let server = Server::start();
    let broker = server.broker().await;
    let first = sent(&broker, &campaign).await;
    // A worker takes work and dies, again and again.
    let plain = server.plain().await;
    let (stop, stopped) = watch::channel(true);
    let worker = Worker::new(server.broker().await, 1, 1);
    worker.run(stopped, None, &|_| {}).await.expect("makes the queue");
    drop(stop);
    let stream = plain.get_stream("PILOTFISH_WORK").await.expect("is there");
    let version = env!("CARGO_PKG_VERSION").replace('.', "-");
    let name = format!("workers-{version}_{SCHEMA_VERSION}");
    let queue = stream.get_consumer::<jetstream::consumer::pull::Config>(&name).await;
    let queue = queue.expect("is there");
    for _ in 0..3 {
        let batch = queue.batch().max_messages(2).expires(Duration::from_secs(10));
        let mut messages = batch.messages().await.expect("answers");
        // All are taken before one is returned, which could come again in the same round.
        let mut taken = vec![];
        while let Some(message) = messages.next().await {
            taken.push(message.expect("is work"));
        }
        assert_eq!(taken.len(), first.sent);
        for message in taken {
            let returned = message.ack_with(jetstream::AckKind::Nak(None)).await;
            returned.expect("answers");
        }
    }
    let in_time = async |step: usize| assert!(step < 500, "is over");
    work(&server, &first.id, 1, 3, in_time).await;
    let end = progress(&broker, &first.id).await.expect("is there");
    let all_gains = end.parked.iter().all(|parked| parked.starts_with("gains/"));
    assert!(!end.parked.is_empty() && all_gains, "{end:?}");
    let folder = TempDir::new().expect("is a folder");
    let refused = collect(&broker, &first.id, folder.path()).await;
    let refused = refused.expect_err("work was given up").to_string();
    assert!(refused.contains("started 3 times without a result"), "{refused}");
    // A second submission gets new tries.
    let again = sent(&broker, &campaign).await;
    assert_eq!(again.sent, end.parked.len());
    let waiting = progress(&broker, &first.id).await.expect("is there");
    assert!(!waiting.is_over() && waiting.parked.is_empty(), "{waiting:?}");
    work(&server, &first.id, 2, 3, async |_| {}).await;
    assert_eq!(collected(&broker, &first.id).await, flown_here(&campaign));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_campaign_has_the_requested_copies_even_if_a_worker_came_first() {
    let servers = Server::three();
    let broker = servers[0].broker().await;
    let campaign = small(SMALL);
    let worker = Worker::new(servers[0].broker().await, 1, 5);
    // Three servers keep nothing until they have met: the worker waits.
    let (_stop, stopped) = watch::channel(false);
    let idle = Some(Duration::from_secs(1));
    worker.run(stopped, idle, &|_| {}).await.expect("makes the queue");
    let id = submit(&broker, &campaign, 3).await.expect("is sent").id;
    let plain = servers[1].plain().await;
    for name in ["PILOTFISH_WORK".to_owned(), format!("OBJ_pilotfish-{id}")] {
        let stream = plain.get_stream(&name).await.expect("is there");
        assert_eq!(stream.cached_info().config.num_replicas, 3, "{name}");
    }
    work(&servers[2], &id, 2, 5, async |_| {}).await;
    assert_eq!(collected(&broker, &id).await, flown_here(&campaign));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_worker_waits_for_its_broker() {
    let server = Server::start();
    server.kill();
    let access = server.access("");
    let events = Mutex::new(vec![]);
    let notify = |event: WorkerEvent| events.lock().expect("no panic holds it").push(event);
    let started = async {
        sleep(Duration::from_millis(500)).await;
        server.restart();
    };
    let clock = Clock::machine();
    let connected = Broker::connect_when_ready(&access, "test", &clock, &notify);
    let (awaited, ()) = tokio::join!(connected, started);
    awaited.expect("is there in the end");
    let events = events.into_inner().expect("no panic held it");
    assert!(
        matches!(&events[0], WorkerEvent::Trouble(words) if words.contains("is a nats-server running")),
        "{events:?}"
    );
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_silent_broker_is_not_taken_for_one_without_the_campaign() {
    let server = Server::start();
    let broker = server.broker().await;
    server.kill();
    let silent = progress(&broker, "small-0123456789ab").await;
    assert!(matches!(silent, Err(ClusterError::Broker(..))), "{silent:?}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_password_in_the_address_opens_a_broker_and_a_wrong_one_is_named() {
    let server = Server::with(["--user", "me", "--pass", "s@cret"].map(str::to_owned).to_vec());
    let broker = server.broker_for(&server.access("me:s%40cret@")).await;
    sent(&broker, &small(SMALL)).await;
    for login in ["", "me:wrong@", "token@"] {
        let refused = Broker::connect(&server.access(login), "test", &Clock::machine()).await;
        let refused = refused.expect_err("is refused").to_string();
        let names_no_secret = refused.contains("user:password@") && !refused.contains("wrong");
        assert!(names_no_secret, "{refused}");
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn certificates_open_a_broker_and_a_missing_one_is_named() {
    let folder = TempDir::new().expect("is a folder");
    let at = |name: &str| folder.path().join(name);
    let write = |name: &str, text: String| std::fs::write(at(name), text).expect("is written");
    for authority in ["ours", "theirs"] {
        let mut claims = CertificateParams::default();
        claims.is_ca = IsCa::Ca(BasicConstraints::Unconstrained);
        let key = KeyPair::generate().expect("is a key");
        write(authority, claims.self_signed(&key).expect("is signed").pem());
        let issuer = Issuer::new(claims, key);
        for (name, host) in [("server", "127.0.0.1"), ("client", "worker")] {
            let key = KeyPair::generate().expect("is a key");
            let claims = CertificateParams::new(vec![host.to_owned()]).expect("is a name");
            let signed = claims.signed_by(&key, &issuer).expect("is signed");
            write(&format!("{authority}-{name}"), signed.pem());
            write(&format!("{authority}-{name}-key"), key.serialize_pem());
        }
    }
    let file = |name: &str| at(name).display().to_string();
    let server = Server::with(vec![
        "--tlsverify".to_owned(),
        format!("--tlscacert={}", file("ours")),
        format!("--tlscert={}", file("ours-server")),
        format!("--tlskey={}", file("ours-server-key")),
    ]);
    let access = |authority: &str, client: Option<&str>| Access {
        url: format!("tls://127.0.0.1:{}", server.port),
        credentials: None,
        authority: Some(at(authority)),
        certificate: client.map(|name| (at(name), at(&format!("{name}-key")))),
    };
    let broker = server.broker_for(&access("ours", Some("ours-client"))).await;
    sent(&broker, &small(SMALL)).await;
    for (access, advice) in [
        (access("theirs", Some("ours-client")), "--nats-ca"),
        (access("ours", None), "--nats-cert"),
        (access("nowhere", None), "nowhere"),
    ] {
        let refused = Broker::connect(&access, "test", &Clock::machine()).await;
        let refused = refused.expect_err("is refused").to_string();
        assert!(refused.contains(advice), "{refused}");
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn work_for_another_version_is_refused_by_name_and_left_for_it() {
    let server = Server::start();
    let broker = server.broker().await;
    let campaign = small(SMALL);
    let id = sent(&broker, &campaign).await.id;
    let plain = server.plain().await;
    let subject = "pilotfish.work.9-9-9_1.other-000000000000.chunks.0";
    let work = plain.publish(subject, "{}".into()).await;
    work.expect("is sent").await.expect("is stored");
    let events = Mutex::new(vec![]);
    let (_stop, stopped) = watch::channel(true);
    let worker = Worker::new(server.broker().await, 1, 5);
    let notify = |event| events.lock().expect("free").push(event);
    worker.run(stopped, None, &notify).await.expect("starts");
    let events = events.into_inner().expect("free");
    let named =
        |event: &WorkerEvent| matches!(event, WorkerEvent::Refused(words) if words.contains("9-9-9_1"));
    assert!(events.iter().any(named), "{events:?}");
    // A campaign with another program's manifest is refused by name.
    let bucket = plain.get_object_store(format!("pilotfish-{id}")).await;
    let bucket = bucket.expect("is there");
    let manifest = Manifest { program: "9.9.9".to_owned(), ..Manifest::of(&campaign, Shard::WHOLE) };
    let json = serde_json::to_vec(&manifest).expect("is JSON");
    let stored = bucket.put("manifest", &mut std::io::Cursor::new(json)).await;
    stored.expect("is stored");
    let refused = progress(&broker, &id).await.expect_err("is another version's");
    assert!(refused.to_string().contains("is of version 9.9.9"), "{refused}");
    let nowhere = progress(&broker, "nowhere-0").await;
    assert!(matches!(nowhere, Err(ClusterError::NoCampaign(_))));
}
