//! What is kept by the shape of a program, within a number of bytes: the client chooses the shapes.

use crate::program::layout::Layout;

/// Most bytes that programs, and as many that solvers take in a workspace beside those of the shape in use: room for a dozen ordinary
/// shapes, or one large one.
pub const KEPT_BYTES_MAX: usize = 8 << 20;

/// Values of the shapes used last.
#[derive(Debug)]
pub(crate) struct ByShape<T> {
    /// With their bytes, the one used last at the end.
    kept: Vec<(Layout, usize, T)>,
}

impl<T> Default for ByShape<T> {
    fn default() -> Self {
        Self { kept: Vec::new() }
    }
}

impl<T> ByShape<T> {
    /// Whether a value of that shape is kept; it is the last one from now on.
    pub(crate) fn is_kept(&mut self, layout: &Layout) -> bool {
        let index = self.kept.iter().position(|(kept, ..)| kept == layout);
        index.is_some_and(|index| {
            self.kept[index..].rotate_left(1);
            true
        })
    }

    /// The value used last.
    pub(crate) fn last(&mut self) -> Option<&mut T> {
        self.kept.last_mut().map(|(.., value)| value)
    }

    /// Keeps the value of a shape that takes so many `bytes`, and no older ones beyond [`KEPT_BYTES_MAX`].
    pub(crate) fn insert(&mut self, layout: Layout, bytes: usize, value: T) {
        self.shrink_to(KEPT_BYTES_MAX.saturating_sub(bytes));
        self.kept.push((layout, bytes, value));
    }

    /// Forgets the values used longest ago, until the others take no more than so many bytes.
    pub(crate) fn shrink_to(&mut self, bytes: usize) {
        while bytes < self.bytes() {
            self.kept.remove(0);
        }
    }

    /// What all of them take.
    pub(crate) fn bytes(&self) -> usize {
        self.kept.iter().map(|(_, bytes, _)| bytes).sum()
    }

    /// Their shapes.
    pub(crate) fn shapes(&self) -> impl Iterator<Item = &Layout> {
        self.kept.iter().map(|(layout, ..)| layout)
    }
}
