//! The sockets of an IMC network, and the addresses of its systems.
//!
//! Systems announce themselves to a multicast group, with the addresses at which they take
//! datagrams. A message for one system goes there alone.

use std::collections::BTreeMap;
use std::io;
use std::net::{Ipv4Addr, SocketAddr, SocketAddrV4, UdpSocket};
use std::ops::RangeInclusive;
use std::time::Duration;

use parking_lot::Mutex;

use crate::imc::codec::{Message, Packet, PacketReader};

/// Where systems announce themselves, each program of a machine at one of the ports. Source: IMC,
/// "Discovery".
const GROUP: Ipv4Addr = Ipv4Addr::new(224, 0, 75, 69);
const PORTS: RangeInclusive<u16> = 30_100..=30_104;
/// A message for all systems.
const ALL: u16 = 0xFFFF;
const SERVICE: &str = "imc+udp://";
/// Longest wait for a datagram, after which announcements are looked for.
const WAIT: Duration = Duration::from_millis(50);
/// Most systems, and addresses of each, that are kept.
const SYSTEMS_MAX: usize = 256;
const ADDRESSES_MAX: usize = 8;

#[derive(Debug)]
pub(super) struct ImcNetwork {
    own: UdpSocket,
    group: UdpSocket,
    systems: Mutex<BTreeMap<u16, Addresses>>,
}

#[derive(Debug, Default)]
struct Addresses {
    announced: Vec<SocketAddr>,
    /// The sender of its newest datagram.
    heard: Option<SocketAddr>,
    /// How many datagrams of all systems had come by then.
    count: u64,
}

impl ImcNetwork {
    /// Opens the sockets at `address`, one of this computer's that the vehicles reach.
    pub(super) fn open(address: &str, write_timeout: Duration) -> io::Result<Self> {
        let address: SocketAddrV4 = address.parse().map_err(|_| io::ErrorKind::InvalidInput)?;
        let own = UdpSocket::bind(address)?;
        own.set_read_timeout(Some(WAIT))?;
        own.set_write_timeout(Some(write_timeout))?;
        let group = { PORTS }.find_map(|port| UdpSocket::bind((Ipv4Addr::UNSPECIFIED, port)).ok());
        let group = group.ok_or(io::ErrorKind::AddrInUse)?;
        group.join_multicast_v4(&GROUP, address.ip())?;
        group.set_nonblocking(true)?;
        Ok(Self { own, group, systems: Mutex::default() })
    }

    /// Receives a datagram, or an announcement.
    pub(super) fn receive(&self, into: &mut [u8]) -> io::Result<usize> {
        let (count, sender) = match self.group.recv_from(into) {
            Ok((count, _)) => (count, None),
            Err(_) => self.own.recv_from(into).map(|(count, sender)| (count, Some(sender)))?,
        };
        let mut systems = self.systems.lock();
        for Packet { header, message } in PacketReader::default().push(&into[..count], true) {
            if SYSTEMS_MAX <= systems.len() && !systems.contains_key(&header.source) {
                // The one that was silent for longest makes room.
                let oldest = systems.iter().min_by_key(|(_, system)| system.count).map(|(number, _)| *number);
                oldest.and_then(|number| systems.remove(&number));
            }
            let count = 1 + systems.values().map(|system| system.count).max().unwrap_or(0);
            let system = systems.entry(header.source).or_default();
            system.heard = sender.or(system.heard);
            system.count = count;
            if let Some(Message::Announce(announce)) = message {
                system.announced = addresses(&announce.services);
            }
        }
        // An empty datagram is not the end of a stream.
        if count == 0 { Err(io::ErrorKind::Interrupted.into()) } else { Ok(count) }
    }

    /// Sends the packet in `bytes` to the system or systems that it is for.
    pub(super) fn send(&self, bytes: &[u8]) -> io::Result<()> {
        let packets = PacketReader::default().push(bytes, true);
        let Some(Packet { header, message }) = packets.into_iter().next() else { return Ok(()) };
        let to: Vec<SocketAddr> = match (message, header.destination) {
            (Some(Message::Announce(_)), _) => PORTS.map(|port| (GROUP, port).into()).collect(),
            (_, ALL) => self.systems.lock().values().flat_map(Addresses::in_use).collect(),
            (_, one) => self.systems.lock().get(&one).map_or_else(Vec::new, Addresses::in_use),
        };
        // One of several addresses may have no route.
        let sent = to.iter().map(|to| self.own.send_to(bytes, to).map(drop));
        sent.reduce(Result::or).unwrap_or(Ok(()))
    }
}

impl Addresses {
    /// The announced address from which it sends; all of them before it does.
    fn in_use(&self) -> Vec<SocketAddr> {
        let heard = self.heard.filter(|heard| self.announced.is_empty() || self.announced.contains(heard));
        heard.map_or_else(|| self.announced.clone(), |heard| vec![heard])
    }
}

fn addresses(services: &str) -> Vec<SocketAddr> {
    let addresses = services.split(';').filter_map(|service| service.trim().strip_prefix(SERVICE));
    let addresses = addresses.filter_map(|address| address.split('/').next()?.parse().ok());
    addresses.take(ADDRESSES_MAX).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::imc::codec::{Announce, ByteOrder, Header, Heartbeat, packet};

    /// A network on this machine, at free ports and without the group.
    fn network() -> ImcNetwork {
        let [own, group] = [(); 2].map(|()| UdpSocket::bind("127.0.0.1:0").expect("a free port"));
        group.set_nonblocking(true).expect("can be");
        ImcNetwork { own, group, systems: Mutex::default() }
    }

    fn bytes(source: u16, destination: u16, message: impl Into<Message>) -> Vec<u8> {
        let header = Header { source, destination, ..Header::default() };
        packet(&header, &message.into(), ByteOrder::Little)
    }

    #[test]
    fn only_services_by_datagrams_have_addresses() {
        let services =
            "dune://0.0.0.0/uid/1;imc+info://x/;imc+udp://10.0.2.70:6002/;imc+udp://no/; imc+udp://[::1]:7";
        let found: Vec<String> = addresses(services).iter().map(ToString::to_string).collect();
        assert_eq!(found, ["10.0.2.70:6002", "[::1]:7"]);
        assert_eq!(addresses(&"imc+udp://1.2.3.4:5;".repeat(1000)).len(), ADDRESSES_MAX);
    }

    #[test]
    fn a_message_goes_to_the_announced_address_that_answers_and_to_no_other_system() {
        let network = network();
        let here = network.own.local_addr().expect("is bound");
        let [craft, elsewhere, auv] = [(); 3].map(|()| UdpSocket::bind("127.0.0.1:0").expect("a free port"));
        for socket in [&craft, &elsewhere, &auv] {
            socket.set_read_timeout(Some(Duration::from_secs(5))).expect("is a time");
        }
        let services = |sockets: &[&UdpSocket]| -> String {
            let address =
                |socket: &&UdpSocket| format!("imc+udp://{}/;", socket.local_addr().expect("is bound"));
            sockets.iter().map(address).collect()
        };
        let announce =
            |sockets: &[&UdpSocket]| Announce { services: services(sockets), ..Announce::default() };
        let (mut buffer, receive) =
            ([0; 2048], |network: &ImcNetwork| while network.receive(&mut [0; 2048]).is_err() {});
        auv.send_to(&bytes(2, ALL, announce(&[&auv])), here).expect("is sent");
        receive(&network);
        craft.send_to(&bytes(1, ALL, announce(&[&elsewhere, &craft])), here).expect("is sent");
        receive(&network);
        let to_craft = bytes(9, 1, Heartbeat {});
        network.send(&to_craft).expect("is sent");
        network.send(&bytes(9, 3, Heartbeat {})).expect("nobody has that number");
        network.send(&bytes(9, ALL, Heartbeat {})).expect("is sent");
        for (socket, first) in [(&craft, &to_craft), (&auv, &bytes(9, ALL, Heartbeat {}))] {
            let (count, _) = socket.recv_from(&mut buffer).expect("is heard");
            assert_eq!(&buffer[..count], first);
        }
        elsewhere.set_nonblocking(true).expect("can be");
        assert!(elsewhere.recv_from(&mut buffer).is_err());
    }

    #[test]
    fn a_system_that_came_late_takes_the_place_of_the_one_that_was_silent_for_longest() {
        let network = network();
        let here = network.own.local_addr().expect("is bound");
        let peer = UdpSocket::bind("127.0.0.1:0").expect("a free port");
        // The first one speaks again: the second is then silent for longest.
        let last = u16::try_from(SYSTEMS_MAX).expect("is small") + 1;
        for source in (1..last).chain([1, last]) {
            peer.send_to(&bytes(source, ALL, Heartbeat {}), here).expect("is sent");
            network.receive(&mut [0; 256]).expect("is heard");
        }
        let systems = network.systems.lock();
        assert_eq!(systems.len(), SYSTEMS_MAX);
        assert_eq!([1, 2, last].map(|number| systems.contains_key(&number)), [true, false, true]);
    }
}
