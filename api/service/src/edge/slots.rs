//! Connection slots, shared by network address.
//!
//! A newcomer without a free slot takes one from an address with more connections: that of an idle
//! connection, a long request without a token, any request without a token, or a caller with a
//! token, in this order. Otherwise it takes one from its own address: of an idle connection, a long
//! request without a token, or the busiest caller there. Live missions keep their slots.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::net::{IpAddr, Ipv6Addr};
use std::sync::Arc;
use std::time::Instant;

use clock::Clock;
use parking_lot::Mutex;
use tokio::sync::Notify;

use crate::limits::{IPV6_NETWORK_BITS, LONG_REQUEST};

/// Slots for connections. Clones share them.
#[derive(Clone)]
pub struct ConnectionSlots(Arc<Mutex<Table>>);

/// The slot of a connection, until its last clone is dropped.
#[derive(Clone)]
pub struct ConnectionSlot(Arc<Claim>);

struct Claim {
    slots: ConnectionSlots,
    number: u64,
    revoked: Arc<Notify>,
}

/// A request of a connection, until it is dropped.
pub(crate) struct ActiveRequest(ConnectionSlot);

/// The present use of a connection. The first loses its slot first.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Use {
    /// It waits for a request, and none had a token.
    Idle,
    /// A request without a token.
    Request,
    /// A caller with a token.
    Caller,
    /// Reports to a mission, or its events.
    Mission,
}

struct Table {
    clock: Clock,
    limit: usize,
    share: usize,
    next: u64,
    connections: HashMap<u64, Connection>,
    by_address: BTreeMap<IpAddr, ByUse>,
}

/// Connections of an address, by use: the beginning of that use, and their numbers.
type ByUse = [BTreeSet<(Instant, u64)>; 4];

struct Connection {
    address: IpAddr,
    used: Use,
    since: Instant,
    /// Name of the caller with a token, once known.
    caller: Option<Arc<str>>,
    revoked: Arc<Notify>,
}

impl ConnectionSlots {
    /// At most `limit` slots, of which one address has at most half.
    pub fn new(limit: usize, clock: Clock) -> Self {
        Self(Arc::new(Mutex::new(Table {
            clock,
            limit,
            share: limit.div_ceil(2),
            next: 0,
            connections: HashMap::new(),
            by_address: BTreeMap::new(),
        })))
    }

    /// A slot for a connection from `address`; `None` if no connection may give way.
    pub fn acquire(&self, address: IpAddr) -> Option<ConnectionSlot> {
        let now = self.0.lock().clock.now();
        self.acquire_at(now, address)
    }

    fn acquire_at(&self, now: Instant, address: IpAddr) -> Option<ConnectionSlot> {
        let address = network(address);
        let mut table = self.0.lock();
        let own = table.count(&address);
        let has_its_share = table.share <= own;
        if has_its_share || table.limit <= table.connections.len() {
            let of_another = (!has_its_share).then(|| table.least_of_others(own, now));
            let number = of_another.flatten().or_else(|| table.least_of(&address, now))?;
            let revoked = table.remove(number).expect("has a slot").revoked;
            revoked.notify_one();
        }
        let number = table.next;
        table.next += 1;
        let revoked = Arc::new(Notify::new());
        let connection =
            Connection { address, used: Use::Idle, since: now, caller: None, revoked: Arc::clone(&revoked) };
        table.insert(number, connection);
        Some(ConnectionSlot(Arc::new(Claim { slots: self.clone(), number, revoked })))
    }
}

impl Table {
    fn count(&self, address: &IpAddr) -> usize {
        self.by_address.get(address).map_or(0, |of| of.iter().map(BTreeSet::len).sum())
    }

    fn insert(&mut self, number: u64, connection: Connection) {
        let of = self.by_address.entry(connection.address).or_default();
        of[connection.used as usize].insert((connection.since, number));
        self.connections.insert(number, connection);
    }

    fn remove(&mut self, number: u64) -> Option<Connection> {
        let connection = self.connections.remove(&number)?;
        if let Some(of) = self.by_address.get_mut(&connection.address) {
            of[connection.used as usize].remove(&(connection.since, number));
            if of.iter().all(BTreeSet::is_empty) {
                self.by_address.remove(&connection.address);
            }
        }
        Some(connection)
    }

    /// The connection that gives way to a newcomer from an address with `own` connections.
    fn least_of_others(&self, own: usize, now: Instant) -> Option<u64> {
        // The oldest such connection of the address that has the most of them.
        let longest = |used: Use, at_least: usize, until: Instant| {
            let others = self.by_address.iter();
            let others = others.filter(|(address, _)| at_least <= self.count(address));
            let (_, of) = others.max_by_key(|(_, of)| of[used as usize].len())?;
            first(of, used, until)
        };
        longest(Use::Idle, own + 1, now)
            .or_else(|| longest(Use::Request, own + 1, long_before(now)))
            // These give way only to an address that has fewer even with the newcomer.
            .or_else(|| longest(Use::Request, own + 2, now))
            .or_else(|| longest(Use::Caller, own + 2, now))
    }

    /// The connection that gives way to a newcomer from its own address.
    fn least_of(&self, address: &IpAddr, now: Instant) -> Option<u64> {
        let of = self.by_address.get(address)?;
        first(of, Use::Idle, now)
            .or_else(|| first(of, Use::Request, long_before(now)))
            .or_else(|| self.of_busiest_caller(of, now))
    }

    /// The busiest caller's oldest connection. The only caller of an address keeps its recent ones.
    fn of_busiest_caller(&self, of: &ByUse, now: Instant) -> Option<u64> {
        let mut of_each: BTreeMap<_, Vec<_>> = BTreeMap::new();
        for (_, number) in &of[Use::Mission as usize] {
            of_each.entry(&self.connections[number].caller).or_default();
        }
        for oldest_first in &of[Use::Caller as usize] {
            let caller = &self.connections[&oldest_first.1].caller;
            of_each.entry(caller).or_default().push(*oldest_first);
        }
        let is_alone = of_each.len() == 1;
        let &(since, number) = of_each.values().max_by_key(|of| of.len())?.first()?;
        (!is_alone || since <= long_before(now)).then_some(number)
    }

    fn change(&mut self, number: u64, change: impl FnOnce(&mut Connection)) {
        if let Some(mut connection) = self.remove(number) {
            let before = connection.used;
            change(&mut connection);
            if connection.used != before {
                connection.since = self.clock.now();
            }
            self.insert(number, connection);
        }
    }
}

impl ConnectionSlot {
    /// Waits until a newcomer takes the slot: the connection must end.
    pub async fn revoked(&self) {
        self.0.revoked.notified().await;
    }

    /// Marks a request as being answered, until the result is dropped.
    pub(crate) fn request(&self) -> ActiveRequest {
        self.change(|connection| connection.used = connection.used.max(Use::Request));
        ActiveRequest(self.clone())
    }

    /// Records that the `caller` has a token.
    pub(crate) fn serves_a_caller(&self, caller: &Arc<str>) {
        self.change(|connection| {
            connection.used = connection.used.max(Use::Caller);
            connection.caller = Some(Arc::clone(caller));
        });
    }

    /// Records that a mission depends on the connection.
    pub(crate) fn serves_a_mission(&self) {
        self.change(|connection| connection.used = Use::Mission);
    }

    fn change(&self, change: impl FnOnce(&mut Connection)) {
        self.0.slots.0.lock().change(self.0.number, change);
    }
}

impl Drop for Claim {
    fn drop(&mut self) {
        self.slots.0.lock().remove(self.number);
    }
}

impl Drop for ActiveRequest {
    fn drop(&mut self) {
        self.0.change(|connection| {
            if connection.used == Use::Request {
                connection.used = Use::Idle;
            }
        });
    }
}

/// The connection with the longest such use, if it began at `by` or earlier.
fn first(of: &ByUse, used: Use, by: Instant) -> Option<u64> {
    let &(since, number) = of[used as usize].first()?;
    (since <= by).then_some(number)
}

fn long_before(now: Instant) -> Instant {
    now.checked_sub(LONG_REQUEST).unwrap_or(now)
}

fn network(address: IpAddr) -> IpAddr {
    match address {
        IpAddr::V6(address) => {
            let host_bits = u128::BITS - IPV6_NETWORK_BITS;
            IpAddr::V6(Ipv6Addr::from_bits(address.to_bits() >> host_bits << host_bits))
        }
        v4 @ IpAddr::V4(_) => v4,
    }
}

#[cfg(test)]
mod tests {
    use std::net::Ipv4Addr;

    use futures_util::FutureExt as _;

    use super::*;

    const GOOD: IpAddr = IpAddr::V4(Ipv4Addr::new(10, 0, 0, 1));
    const BAD: [IpAddr; 2] = [IpAddr::V4(Ipv4Addr::new(10, 0, 0, 2)), IpAddr::V4(Ipv4Addr::new(10, 0, 0, 3))];

    /// All of 8 slots, taken alternately by two addresses.
    fn crowded(slots: &ConnectionSlots) -> Vec<ConnectionSlot> {
        (0..8).map(|i| slots.acquire(BAD[i % 2]).expect("is free")).collect()
    }

    fn serve(slot: &ConnectionSlot, caller: &str) {
        slot.serves_a_caller(&caller.into());
    }

    fn lost(slot: &ConnectionSlot) -> bool {
        slot.revoked().now_or_never().is_some()
    }

    #[tokio::test(start_paused = true)]
    async fn two_addresses_that_took_every_slot_leave_some_to_a_third() {
        for serve in [|_: &ConnectionSlot| None, |slot: &ConnectionSlot| Some(slot.request())] {
            let slots = ConnectionSlots::new(8, Clock::simulated(0.0));
            let bad = crowded(&slots);
            let _requests: Vec<_> = bad.iter().map(serve).collect();
            let good: Vec<_> = (0..2).map(|_| slots.acquire(GOOD).expect("takes a slot")).collect();
            assert!(!good.iter().any(lost));
            assert_eq!(bad.iter().filter(|slot| lost(slot)).count(), 2);
        }
    }

    #[tokio::test(start_paused = true)]
    async fn a_caller_with_a_token_gives_way_only_if_its_address_has_more() {
        let slots = ConnectionSlots::new(8, Clock::simulated(0.0));
        let bad = crowded(&slots);
        for slot in &bad {
            serve(slot, "bad");
        }
        let caller = || slots.acquire(GOOD).inspect(|slot| serve(slot, "good"));
        let good: Vec<_> = (0..8).map_while(|_| caller()).collect();
        assert_eq!(good.len(), 2, "a third each");
        assert!(slots.acquire(BAD[0]).is_none() && slots.acquire(GOOD).is_none());
    }

    #[tokio::test(start_paused = true)]
    async fn a_caller_outlives_the_others_of_its_address_and_a_mission_every_newcomer() {
        let slots = ConnectionSlots::new(4, Clock::simulated(0.0));
        let [caller, other] = [(); 2].map(|()| slots.acquire(BAD[0]).expect("is free"));
        serve(&caller, "bridge");
        let newcomer = slots.acquire(BAD[0]).expect("takes the slot of the other");
        assert!(lost(&other) && !lost(&caller));
        newcomer.serves_a_mission();
        caller.serves_a_mission();
        assert!(slots.acquire(BAD[0]).is_none(), "half is its share");
        let others: Vec<_> = (0..2).map(|_| slots.acquire(BAD[1]).expect("is free")).collect();
        assert!(slots.acquire(GOOD).is_some() && !lost(&caller));
        drop(others);
    }

    #[tokio::test(start_paused = true)]
    async fn a_request_outlives_newcomers_of_its_address_unless_it_is_long() {
        let slots = ConnectionSlots::new(4, Clock::simulated(0.0));
        let asking = [(); 2].map(|()| slots.acquire(GOOD).expect("is free"));
        let requests = asking.each_ref().map(ConnectionSlot::request);
        let now = slots.0.lock().clock.now();
        assert!(slots.acquire_at(now, GOOD).is_none());
        let newcomer = slots.acquire_at(now + 2 * LONG_REQUEST, GOOD).expect("takes a slot");
        assert!(lost(&asking[0]) && !lost(&asking[1]));
        serve(&newcomer, "bridge");
        drop(requests);
        assert!(slots.acquire(GOOD).is_some() && lost(&asking[1]), "it idles now");
    }

    #[tokio::test(start_paused = true)]
    async fn calls_of_one_caller_leave_slots_to_other_callers_of_its_address() {
        let slots = ConnectionSlots::new(12, Clock::simulated(0.0));
        let taken: Vec<_> = (0..6).map(|_| slots.acquire(GOOD).expect("is free")).collect();
        for slot in &taken {
            serve(slot, "reader");
        }
        let now = slots.0.lock().clock.now();
        assert!(slots.acquire_at(now, GOOD).is_none(), "half is its share, in use by one caller");
        let bridge = slots.acquire_at(now + 2 * LONG_REQUEST, GOOD).expect("takes a slot that has lasted");
        assert!(lost(&taken[0]));
        serve(&bridge, "bridge");
        bridge.serves_a_mission();
        let other = slots.acquire_at(now, GOOD).expect("takes a slot of the busiest");
        assert!(lost(&taken[1]) && !lost(&bridge) && !lost(&other));
        assert_eq!(taken.iter().filter(|slot| lost(slot)).count(), 0, "one each");
    }

    #[tokio::test(start_paused = true)]
    async fn an_ipv6_network_counts_as_one_address_and_ended_connections_leave_no_trace() {
        let slots = ConnectionSlots::new(4, Clock::simulated(0.0));
        let taken: Vec<_> = (1..9)
            .map(|host| slots.acquire(IpAddr::V6(Ipv6Addr::new(0x2001, 0xdb8, 0, 1, 0, 0, 0, host))))
            .collect();
        assert_eq!(slots.0.lock().connections.len(), 2);
        drop(taken);
        let table = slots.0.lock();
        assert!(table.connections.is_empty() && table.by_address.is_empty());
    }
}
