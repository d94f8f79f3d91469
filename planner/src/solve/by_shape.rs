//! Values kept by the shape of a program, within a limit of bytes, since clients choose the shapes.

use crate::program::layout::Layout;

/// Most bytes of programs, and of solvers, besides those in use: a dozen ordinary shapes.
pub const KEPT_BYTES_MAX: usize = 8 << 20;

/// Values of the last used shapes.
#[derive(Debug)]
pub struct ByShape<T> {
    /// With their bytes; the last used one is at the end.
    kept: Vec<(Layout, usize, T)>,
}

impl<T> Default for ByShape<T> {
    fn default() -> Self {
        Self { kept: Vec::new() }
    }
}

impl<T> ByShape<T> {
    /// `true` if a value of that shape is kept, which becomes the last used one.
    pub(crate) fn is_kept(&mut self, layout: &Layout) -> bool {
        let index = self.kept.iter().position(|(kept, ..)| kept == layout);
        index.is_some_and(|index| {
            self.kept[index..].rotate_left(1);
            true
        })
    }

    pub(crate) fn last(&mut self) -> Option<&mut T> {
        self.kept.last_mut().map(|(.., value)| value)
    }

    /// Keeps the value of a shape with its `bytes`, and drops the oldest beyond [`KEPT_BYTES_MAX`].
    pub(crate) fn insert(&mut self, layout: Layout, bytes: usize, value: T) {
        self.shrink_to(KEPT_BYTES_MAX.saturating_sub(bytes));
        self.kept.push((layout, bytes, value));
    }

    /// Drops the least recently used values until the others take at most `bytes`.
    pub(crate) fn shrink_to(&mut self, bytes: usize) {
        while bytes < self.bytes() {
            self.kept.remove(0);
        }
    }

    /// Size of all values.
    pub fn bytes(&self) -> usize {
        self.kept.iter().map(|(_, bytes, _)| bytes).sum()
    }

    pub(crate) fn shapes(&self) -> impl Iterator<Item = &Layout> {
        self.kept.iter().map(|(layout, ..)| layout)
    }
}
