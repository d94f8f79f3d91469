//! Limits of simultaneous things, for all clients together and for each.

use std::collections::HashMap;
use std::hash::Hash;
use std::sync::Arc;

use parking_lot::Mutex;

use crate::edge::problem::Problem;

/// A limit for all clients together, and one for each. Clones share the count.
#[derive(Clone, Debug)]
pub struct Quota<K: Eq + Hash> {
    limit: usize,
    share: usize,
    taken: Arc<Mutex<Taken<K>>>,
}

#[derive(Debug)]
struct Taken<K> {
    of_all: usize,
    of_each: HashMap<K, usize>,
}

/// Counts until it is dropped.
#[derive(Debug)]
pub struct QuotaPermit<K: Clone + Eq + Hash> {
    quota: Quota<K>,
    client: K,
    n: usize,
}

/// An exhausted quota, with its limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum QuotaExceeded {
    /// All clients together use it up.
    OfAll(usize),
    /// This client uses up its share.
    OfClient(usize),
}

impl QuotaExceeded {
    /// The problem of the client that wants more of `what`.
    pub(crate) fn problem(self, what: &'static str) -> Problem {
        match self {
            Self::OfAll(limit) => Problem::Crowded { what, limit },
            Self::OfClient(limit) => Problem::Share { what, limit },
        }
    }
}

impl<K: Clone + Eq + Hash> Quota<K> {
    /// At most `limit` at once, of which one client has at most half.
    pub fn new(limit: usize) -> Self {
        Self {
            limit,
            share: limit.div_ceil(2),
            taken: Arc::new(Mutex::new(Taken { of_all: 0, of_each: HashMap::new() })),
        }
    }

    /// A permit for `n` things of `client`.
    pub fn take(&self, client: K, n: usize) -> Result<QuotaPermit<K>, QuotaExceeded> {
        let mut permit = self.existing(client, 0);
        permit.resize(n)?;
        Ok(permit)
    }

    /// A permit for `n` things of `client` that exist already, even beyond the limits.
    pub fn existing(&self, client: K, n: usize) -> QuotaPermit<K> {
        let mut permit = QuotaPermit { quota: self.clone(), client, n: 0 };
        permit.set(n, &mut self.taken.lock());
        permit
    }
}

impl<K: Clone + Eq + Hash> QuotaPermit<K> {
    /// Counts `n` things from now on, if these are no more than before, or within the limits.
    pub fn resize(&mut self, n: usize) -> Result<(), QuotaExceeded> {
        let quota = self.quota.clone();
        let mut taken = quota.taken.lock();
        let more = n.saturating_sub(self.n);
        let of_client = taken.of_each.get(&self.client).copied().unwrap_or(0);
        if 0 < more && quota.limit < taken.of_all + more {
            return Err(QuotaExceeded::OfAll(quota.limit));
        }
        if 0 < more && quota.share < of_client + more {
            return Err(QuotaExceeded::OfClient(quota.share));
        }
        self.set(n, &mut taken);
        Ok(())
    }

    fn set(&mut self, n: usize, taken: &mut Taken<K>) {
        taken.of_all = taken.of_all - self.n + n;
        let of_client = taken.of_each.remove(&self.client).unwrap_or(0) - self.n + n;
        if 0 < of_client {
            taken.of_each.insert(self.client.clone(), of_client);
        }
        self.n = n;
    }
}

impl<K: Clone + Eq + Hash> Drop for QuotaPermit<K> {
    fn drop(&mut self) {
        let quota = self.quota.clone();
        self.set(0, &mut quota.taken.lock());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_client_has_at_most_half_and_all_clients_at_most_the_limit() {
        let quota = Quota::new(4);
        let first: Vec<_> = (0..2).map(|_| quota.take("a", 1).expect("is free")).collect();
        assert_eq!(quota.take("a", 1).expect_err("has its share"), QuotaExceeded::OfClient(2));
        let second: Vec<_> = (0..2).map(|_| quota.take("b", 1).expect("is free")).collect();
        assert_eq!(quota.take("c", 1).expect_err("none is left"), QuotaExceeded::OfAll(4));
        drop(first);
        let mut third = quota.take("c", 1).expect("is free");
        assert_eq!(third.resize(3), Err(QuotaExceeded::OfAll(4)));
        drop(second);
        assert_eq!(third.resize(3), Err(QuotaExceeded::OfClient(2)));
        let existing = quota.existing("c", 5);
        assert_eq!(third.resize(2), Err(QuotaExceeded::OfAll(4)));
        assert_eq!(third.resize(0), Ok(()));
        drop((third, existing));
        assert!(quota.taken.lock().of_each.is_empty());
    }
}
