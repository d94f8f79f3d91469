//! The places for connections, shared by network address.
//!
//! A newcomer without a free place takes one from an address with more connections: that of an idle
//! connection, a long request without a token, any request without a token, or a caller with a
//! token, in this order. Otherwise it takes one from its own address: of an idle connection, a long
//! request without a token, or the busiest caller there. Live missions keep their places.

use std::{
    collections::{BTreeMap, BTreeSet, HashMap},
    net::{IpAddr, Ipv6Addr},
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::Instant,
};

use clock::Clock;
use tokio::sync::Notify;

use crate::limits::{IPV6_NETWORK_BITS, LONG_REQUEST};

/// Places for connections. Clones share them.
#[derive(Clone)]
pub struct Places(Arc<Mutex<Table>>);

/// The place of a connection, until its last clone is dropped.
#[derive(Clone)]
pub struct Place(Arc<Taken>);

struct Taken {
    places: Places,
    number: u64,
    lost: Arc<Notify>,
}

/// A request of a connection, until it is dropped.
pub(crate) struct Asking(Place);

/// The present use of a connection. The first loses its place first.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Serves {
    /// It waits for a request, and none had a token.
    Nothing,
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
    seats: HashMap<u64, Seat>,
    of_each: BTreeMap<IpAddr, OfAddress>,
}

/// Connections of an address, by use: the beginning of that use, and their numbers.
type OfAddress = [BTreeSet<(Instant, u64)>; 4];

struct Seat {
    address: IpAddr,
    serves: Serves,
    since: Instant,
    /// Name of the caller with a token, once known.
    caller: Option<Arc<str>>,
    lost: Arc<Notify>,
}

impl Places {
    /// At most `limit` places, of which one address has at most half.
    #[must_use]
    pub fn new(limit: usize, clock: Clock) -> Self {
        Self(Arc::new(Mutex::new(Table {
            clock,
            limit,
            share: limit.div_ceil(2),
            next: 0,
            seats: HashMap::new(),
            of_each: BTreeMap::new(),
        })))
    }

    /// A place for a connection from `address`; `None` if no connection may give way.
    #[must_use]
    pub fn take(&self, address: IpAddr) -> Option<Place> {
        let now = self.table().clock.now();
        self.take_at(now, address)
    }

    fn take_at(&self, now: Instant, address: IpAddr) -> Option<Place> {
        let address = network(address);
        let mut table = self.table();
        let own = table.count(&address);
        let has_its_share = table.share <= own;
        if has_its_share || table.limit <= table.seats.len() {
            let of_another = (!has_its_share)
                .then(|| table.least_of_others(own, now))
                .flatten();
            let number = of_another.or_else(|| table.least_of(&address, now))?;
            let lost = table.leave(number).expect("has a seat").lost;
            lost.notify_one();
        }
        let number = table.next;
        table.next += 1;
        let lost = Arc::new(Notify::new());
        let seat = Seat {
            address,
            serves: Serves::Nothing,
            since: now,
            caller: None,
            lost: Arc::clone(&lost),
        };
        table.sit(number, seat);
        Some(Place(Arc::new(Taken {
            places: self.clone(),
            number,
            lost,
        })))
    }

    fn table(&self) -> MutexGuard<'_, Table> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Table {
    fn count(&self, address: &IpAddr) -> usize {
        let of = self.of_each.get(address);
        of.map_or(0, |of| of.iter().map(BTreeSet::len).sum())
    }

    fn sit(&mut self, number: u64, seat: Seat) {
        let of = self.of_each.entry(seat.address).or_default();
        of[seat.serves as usize].insert((seat.since, number));
        self.seats.insert(number, seat);
    }

    fn leave(&mut self, number: u64) -> Option<Seat> {
        let seat = self.seats.remove(&number)?;
        if let Some(of) = self.of_each.get_mut(&seat.address) {
            of[seat.serves as usize].remove(&(seat.since, number));
            if of.iter().all(BTreeSet::is_empty) {
                self.of_each.remove(&seat.address);
            }
        }
        Some(seat)
    }

    /// The connection that gives way to a newcomer from an address with `own` connections.
    fn least_of_others(&self, own: usize, now: Instant) -> Option<u64> {
        // The oldest such connection of the address that has the most of them.
        let longest = |serves: Serves, at_least: usize, until: Instant| {
            let others = self.of_each.iter();
            let others = others.filter(|(address, _)| at_least <= self.count(address));
            let (_, of) = others.max_by_key(|(_, of)| of[serves as usize].len())?;
            first(of, serves, until)
        };
        longest(Serves::Nothing, own + 1, now)
            .or_else(|| longest(Serves::Request, own + 1, long_before(now)))
            // These give way only to an address that has fewer even with the newcomer.
            .or_else(|| longest(Serves::Request, own + 2, now))
            .or_else(|| longest(Serves::Caller, own + 2, now))
    }

    /// The connection that gives way to a newcomer from its own address.
    fn least_of(&self, address: &IpAddr, now: Instant) -> Option<u64> {
        let of = self.of_each.get(address)?;
        first(of, Serves::Nothing, now)
            .or_else(|| first(of, Serves::Request, long_before(now)))
            .or_else(|| self.of_busiest_caller(of, now))
    }

    /// The oldest connection of the caller with the most. The only caller of an address keeps its
    /// recent ones.
    fn of_busiest_caller(&self, of: &OfAddress, now: Instant) -> Option<u64> {
        let mut of_each: BTreeMap<_, Vec<_>> = BTreeMap::new();
        for (_, number) in &of[Serves::Mission as usize] {
            of_each.entry(&self.seats[number].caller).or_default();
        }
        for &(since, number) in &of[Serves::Caller as usize] {
            of_each
                .entry(&self.seats[&number].caller)
                .or_default()
                .push((since, number));
        }
        let is_alone = of_each.len() == 1;
        let &(since, number) = of_each.values().max_by_key(|of| of.len())?.first()?;
        (!is_alone || since <= long_before(now)).then_some(number)
    }

    fn serve(&mut self, number: u64, change: impl FnOnce(&mut Seat)) {
        if let Some(mut seat) = self.leave(number) {
            let before = seat.serves;
            change(&mut seat);
            if seat.serves != before {
                seat.since = self.clock.now();
            }
            self.sit(number, seat);
        }
    }
}

impl Place {
    /// Waits until a newcomer takes the place: the connection must end.
    pub async fn lost(&self) {
        self.0.lost.notified().await;
    }

    /// Marks a request as being answered, until the result is dropped.
    pub(crate) fn asks(&self) -> Asking {
        self.serve(|seat| seat.serves = seat.serves.max(Serves::Request));
        Asking(self.clone())
    }

    /// Records that the `caller` has a token.
    pub(crate) fn serves_a_caller(&self, caller: &Arc<str>) {
        self.serve(|seat| {
            seat.serves = seat.serves.max(Serves::Caller);
            seat.caller = Some(Arc::clone(caller));
        });
    }

    /// Records that a mission depends on the connection.
    pub(crate) fn serves_a_mission(&self) {
        self.serve(|seat| seat.serves = Serves::Mission);
    }

    fn serve(&self, change: impl FnOnce(&mut Seat)) {
        self.0.places.table().serve(self.0.number, change);
    }
}

impl Drop for Taken {
    fn drop(&mut self) {
        self.places.table().leave(self.number);
    }
}

impl Drop for Asking {
    fn drop(&mut self) {
        self.0.serve(|seat| {
            if seat.serves == Serves::Request {
                seat.serves = Serves::Nothing;
            }
        });
    }
}

/// The connection with the longest such use, if it began at `by` or earlier.
fn first(of: &OfAddress, serves: Serves, by: Instant) -> Option<u64> {
    let &(since, number) = of[serves as usize].first()?;
    (since <= by).then_some(number)
}

fn long_before(now: Instant) -> Instant {
    now.checked_sub(LONG_REQUEST).unwrap_or(now)
}

/// The network of an address, which shares its places.
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
    const BAD: [IpAddr; 2] = [
        IpAddr::V4(Ipv4Addr::new(10, 0, 0, 2)),
        IpAddr::V4(Ipv4Addr::new(10, 0, 0, 3)),
    ];

    /// All of 8 places, taken alternately by two addresses.
    fn crowded(places: &Places) -> Vec<Place> {
        let taken = (0..8).map(|i| places.take(BAD[i % 2]).expect("is free"));
        taken.collect()
    }

    fn serve(place: &Place, caller: &str) {
        place.serves_a_caller(&caller.into());
    }

    fn lost(place: &Place) -> bool {
        place.lost().now_or_never().is_some()
    }

    #[tokio::test(start_paused = true)]
    async fn two_addresses_that_took_every_place_leave_some_to_a_third() {
        for serve in [|_: &Place| None, |place: &Place| Some(place.asks())] {
            let places = Places::new(8, Clock::simulated(0.0));
            let bad = crowded(&places);
            let _requests: Vec<_> = bad.iter().map(serve).collect();
            let good: Vec<_> = (0..2)
                .map(|_| places.take(GOOD).expect("takes a place"))
                .collect();
            assert!(!good.iter().any(lost));
            assert_eq!(bad.iter().filter(|place| lost(place)).count(), 2);
        }
    }

    #[tokio::test(start_paused = true)]
    async fn a_caller_with_a_token_gives_way_only_if_its_address_has_more() {
        let places = Places::new(8, Clock::simulated(0.0));
        let bad = crowded(&places);
        for place in &bad {
            serve(place, "bad");
        }
        let caller = || places.take(GOOD).inspect(|place| serve(place, "good"));
        let good: Vec<_> = (0..8).map_while(|_| caller()).collect();
        assert_eq!(good.len(), 2, "a third each");
        assert!(places.take(BAD[0]).is_none() && places.take(GOOD).is_none());
    }

    #[tokio::test(start_paused = true)]
    async fn a_caller_outlives_the_others_of_its_address_and_a_mission_every_newcomer() {
        let places = Places::new(4, Clock::simulated(0.0));
        let [caller, other] = [(); 2].map(|()| places.take(BAD[0]).expect("is free"));
        serve(&caller, "bridge");
        let newcomer = places.take(BAD[0]).expect("takes the place of the other");
        assert!(lost(&other) && !lost(&caller));
        newcomer.serves_a_mission();
        caller.serves_a_mission();
        assert!(places.take(BAD[0]).is_none(), "half is its share");
        let others: Vec<_> = (0..2).map(|_| places.take(BAD[1]).expect("is free")).collect();
        assert!(places.take(GOOD).is_some() && !lost(&caller));
        drop(others);
    }

    #[tokio::test(start_paused = true)]
    async fn a_request_outlives_newcomers_of_its_address_unless_it_is_long() {
        let places = Places::new(4, Clock::simulated(0.0));
        let asking = [(); 2].map(|()| places.take(GOOD).expect("is free"));
        let requests = asking.each_ref().map(Place::asks);
        let now = places.table().clock.now();
        assert!(places.take_at(now, GOOD).is_none());
        let newcomer = places
            .take_at(now + 2 * LONG_REQUEST, GOOD)
            .expect("takes a place");
        assert!(lost(&asking[0]) && !lost(&asking[1]));
        serve(&newcomer, "bridge");
        drop(requests);
        assert!(places.take(GOOD).is_some() && lost(&asking[1]), "it idles now");
    }

    #[tokio::test(start_paused = true)]
    async fn calls_of_one_caller_leave_places_to_other_callers_of_its_address() {
        let places = Places::new(12, Clock::simulated(0.0));
        let seats: Vec<_> = (0..6).map(|_| places.take(GOOD).expect("is free")).collect();
        for place in &seats {
            serve(place, "reader");
        }
        let now = places.table().clock.now();
        assert!(
            places.take_at(now, GOOD).is_none(),
            "half is its share, in use by one caller"
        );
        let bridge = places
            .take_at(now + 2 * LONG_REQUEST, GOOD)
            .expect("takes a place that has lasted");
        assert!(lost(&seats[0]));
        serve(&bridge, "bridge");
        bridge.serves_a_mission();
        let other = places.take_at(now, GOOD).expect("takes a place of the busiest");
        assert!(lost(&seats[1]) && !lost(&bridge) && !lost(&other));
        assert_eq!(seats.iter().filter(|place| lost(place)).count(), 0, "one each");
    }

    #[tokio::test(start_paused = true)]
    async fn an_ipv6_network_counts_as_one_address_and_ended_connections_leave_no_trace() {
        let places = Places::new(4, Clock::simulated(0.0));
        let taken: Vec<_> = (1..9)
            .map(|host| places.take(IpAddr::V6(Ipv6Addr::new(0x2001, 0xdb8, 0, 1, 0, 0, 0, host))))
            .collect();
        assert_eq!(places.table().seats.len(), 2);
        drop(taken);
        let table = places.table();
        assert!(table.seats.is_empty() && table.of_each.is_empty());
    }
}
