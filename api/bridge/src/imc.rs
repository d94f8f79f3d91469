//! IMC 5.4: messages from and to DUNE's vehicles, and what else speaks with Neptus.
//!
//! [`codec`] turns bytes into messages and back. None of the files uses a socket.

pub mod codec;
