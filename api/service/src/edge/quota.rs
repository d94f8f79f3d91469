//! Limits of simultaneous things, for all clients together and for each.

use std::{
    collections::HashMap,
    hash::Hash,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

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

impl<K: Clone + Eq + Hash> Quota<K> {
    /// At most `limit` at once, of which one client has at most half.
    #[must_use]
    pub fn new(limit: usize) -> Self {
        Self {
            limit,
            share: limit.div_ceil(2),
            taken: Arc::new(Mutex::new(Taken {
                of_all: 0,
                of_each: HashMap::new(),
            })),
        }
    }

    /// A permit for `n` things of `client`.
    pub fn take(&self, client: K, n: usize) -> Result<QuotaPermit<K>, QuotaExceeded> {
        let mut taken = self.taken();
        if self.limit < taken.of_all + n {
            return Err(QuotaExceeded::OfAll(self.limit));
        }
        let of_client = taken.of_each.get(&client).copied().unwrap_or(0);
        if self.share < of_client + n {
            return Err(QuotaExceeded::OfClient(self.share));
        }
        taken.of_all += n;
        taken.of_each.insert(client.clone(), of_client + n);
        Ok(QuotaPermit {
            quota: self.clone(),
            client,
            n,
        })
    }

    fn taken(&self) -> MutexGuard<'_, Taken<K>> {
        self.taken.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<K: Clone + Eq + Hash> Drop for QuotaPermit<K> {
    fn drop(&mut self) {
        let mut taken = self.quota.taken();
        taken.of_all -= self.n;
        if let Some(of_client) = taken.of_each.get_mut(&self.client) {
            *of_client -= self.n;
            if *of_client == 0 {
                taken.of_each.remove(&self.client);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_client_has_at_most_half_and_all_clients_at_most_the_limit() {
        let quota = Quota::new(4);
        let first: Vec<_> = (0..2).map(|_| quota.take("a", 1).expect("is free")).collect();
        assert_eq!(
            quota.take("a", 1).expect_err("has its share"),
            QuotaExceeded::OfClient(2)
        );
        let second: Vec<_> = (0..2).map(|_| quota.take("b", 1).expect("is free")).collect();
        assert_eq!(
            quota.take("c", 1).expect_err("none is left"),
            QuotaExceeded::OfAll(4)
        );
        drop(first);
        assert!(quota.take("c", 1).is_ok());
        drop(second);
        assert!(quota.taken().of_each.is_empty());
    }
}
