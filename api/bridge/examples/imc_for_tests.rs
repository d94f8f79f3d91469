//! Runs the codec of IMC on standard input, for tests in other languages.
//!
//! ```text
//! imc_for_tests read           packets in, one JSON object a packet out; then what was rejected
//! imc_for_tests write ORDER    such an object a line in, packets out, `little` or `big`
//! ```

use std::error::Error;
use std::io::{self, BufRead as _, Read as _, Write as _};

use pilotfish_bridge::imc::codec::{ByteOrder, Header, Message, Packet, PacketReader, packet};
use serde_json::json;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["read"] => read(),
        ["write", "little"] => write(ByteOrder::Little),
        ["write", "big"] => write(ByteOrder::Big),
        _ => Err("usage: imc_for_tests read | imc_for_tests write little|big".into()),
    }
}

/// Reads in pieces of the pipe's sizes.
fn read() -> Result<(), Box<dyn Error>> {
    let (mut reader, mut piece) = (PacketReader::default(), [0; 3001]);
    let mut out = io::BufWriter::new(io::stdout().lock());
    let mut stdin = io::stdin().lock();
    loop {
        let count = stdin.read(&mut piece)?;
        if count == 0 {
            break;
        }
        for Packet { header, message } in reader.push(&piece[..count], false) {
            writeln!(out, "{}", json!({ "header": header, "message": message }))?;
        }
    }
    writeln!(out, "{}", json!({ "rejected": reader.rejects.to_string() }))?;
    Ok(())
}

fn write(order: ByteOrder) -> Result<(), Box<dyn Error>> {
    let mut out = io::BufWriter::new(io::stdout().lock());
    for line in io::stdin().lock().lines() {
        let (header, message): (Header, Message) = serde_json::from_str(&line?)?;
        out.write_all(&packet(&header, &message, order))?;
    }
    Ok(())
}
