//! No-go areas as geometry: what is inside, how near it is, and the way round it.

pub(crate) mod land;
pub(crate) mod shape;
pub(crate) mod sides;
#[cfg(test)]
mod tests;
pub(crate) mod way;
