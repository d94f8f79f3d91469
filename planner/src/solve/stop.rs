//! The stop signal of a search for a better plan.

use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// A stop signal, polled at each interior-point iteration and SCP iteration. Clones share it.
///
/// The planner has no clock: the caller defines the result of a poll. Once due, it remains due.
#[derive(Clone)]
pub struct Stop {
    /// `None`: there is always time.
    poll: Option<Arc<dyn Fn() -> bool + Send + Sync>>,
    found: Arc<AtomicBool>,
}

impl Stop {
    /// Never due.
    pub fn never() -> Self {
        Self { poll: None, found: Arc::default() }
    }

    /// Due once `poll` returns `true`.
    pub fn when(poll: impl Fn() -> bool + Send + Sync + 'static) -> Self {
        Self { poll: Some(Arc::new(poll)), found: Arc::default() }
    }

    /// Due before the first program: a lower fallback level answers.
    pub fn at_once() -> Self {
        Self::when(|| true)
    }

    /// Polls the signal.
    pub fn is_due(&self) -> bool {
        let Some(poll) = &self.poll else { return false };
        // An independent flag.
        let due = self.was_due() || poll();
        self.found.store(due, Ordering::Relaxed);
        due
    }

    /// `true` if a poll found the signal due. Does not poll.
    pub fn was_due(&self) -> bool {
        self.found.load(Ordering::Relaxed)
    }
}

impl fmt::Debug for Stop {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Stop").field("ever", &self.poll.is_some()).field("found", &self.was_due()).finish()
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicU32;

    use super::*;

    #[test]
    fn a_due_signal_stays_due_for_every_clone_without_another_poll() {
        let looks = Arc::new(AtomicU32::new(0));
        let counted = Arc::clone(&looks);
        // Due at the third poll only.
        let stop = Stop::when(move || counted.fetch_add(1, Ordering::Relaxed) == 2);
        let clone = stop.clone();
        assert!(!stop.is_due() && !clone.is_due() && !clone.was_due());
        assert!(clone.is_due());
        assert!(stop.was_due() && stop.is_due());
        assert_eq!(looks.load(Ordering::Relaxed), 3);
    }

    #[test]
    fn never_is_never_due_and_at_once_is_due_at_the_first_poll() {
        assert!(!Stop::never().is_due());
        let stop = Stop::at_once();
        assert!(!stop.was_due());
        assert!(stop.is_due());
    }
}
