//! How many of something there may be at once, of all clients together and of each.

use std::{
    collections::HashMap,
    hash::Hash,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

/// A limit on how many there are at once, and on how many of those are one client's. Clones share it.
#[derive(Clone, Debug)]
pub struct Slots<K: Eq + Hash> {
    limit: usize,
    share: usize,
    taken: Arc<Mutex<Taken<K>>>,
}

#[derive(Debug)]
struct Taken<K> {
    of_all: usize,
    of_each: HashMap<K, usize>,
}

/// A slot, free again when dropped.
#[derive(Debug)]
pub struct Slot<K: Clone + Eq + Hash> {
    slots: Slots<K>,
    client: K,
}

/// Why there is no slot, and the limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoSlot {
    /// All are taken.
    OfAll(usize),
    /// The client has its share.
    OfClient(usize),
}

impl<K: Clone + Eq + Hash> Slots<K> {
    /// So many at once, of which one client has at most half.
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

    /// A slot for `client`.
    pub fn take(&self, client: K) -> Result<Slot<K>, NoSlot> {
        let mut taken = self.taken();
        if self.limit <= taken.of_all {
            return Err(NoSlot::OfAll(self.limit));
        }
        let of_client = taken.of_each.get(&client).copied().unwrap_or(0);
        if self.share <= of_client {
            return Err(NoSlot::OfClient(self.share));
        }
        taken.of_all += 1;
        taken.of_each.insert(client.clone(), of_client + 1);
        Ok(Slot {
            slots: self.clone(),
            client,
        })
    }

    fn taken(&self) -> MutexGuard<'_, Taken<K>> {
        self.taken.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<K: Clone + Eq + Hash> Drop for Slot<K> {
    fn drop(&mut self) {
        let mut taken = self.slots.taken();
        taken.of_all -= 1;
        if let Some(of_client) = taken.of_each.get_mut(&self.client) {
            *of_client -= 1;
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
    fn a_client_has_at_most_half_and_all_together_no_more_than_there_are() {
        let slots = Slots::new(4);
        let first: Vec<_> = (0..2).map(|_| slots.take("a").expect("is free")).collect();
        assert_eq!(slots.take("a").expect_err("has its share"), NoSlot::OfClient(2));
        let second: Vec<_> = (0..2).map(|_| slots.take("b").expect("is free")).collect();
        assert_eq!(slots.take("c").expect_err("none is left"), NoSlot::OfAll(4));
        drop(first);
        assert!(slots.take("c").is_ok());
        drop(second);
        assert!(slots.taken().of_each.is_empty());
    }
}
