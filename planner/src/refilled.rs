//! Lists that are written again where they are.

/// `items` in the memory of an earlier `list`.
pub(crate) fn refilled<T>(mut list: Vec<T>, items: impl IntoIterator<Item = T>) -> Vec<T> {
    list.clear();
    list.extend(items);
    list
}

/// Replaces what `list` holds by `items`, in its memory.
pub(crate) fn refill<T>(list: &mut Vec<T>, items: impl IntoIterator<Item = T>) {
    list.clear();
    list.extend(items);
}
