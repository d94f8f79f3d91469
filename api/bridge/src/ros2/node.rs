//! The node: topics, its parameters, its thread. What the messages mean is the [`Conversion`]'s business.

use std::{fmt, io, net::Ipv4Addr, thread};

use futures_executor::block_on;
use ros2_client::{
    Context, MessageTypeName, Name, Node, NodeName, NodeOptions, ParameterValue, Publisher, QosProfile,
    Spinner, Subscription,
    dds::rustdds::DomainParticipantBuilder,
    names::NameError,
    qos::{Durability, History, WhenFull},
};

use super::{
    conversion::Conversion,
    error::Ros2Error,
    messages::{Odometry, Path, TwistStamped},
    settings::Settings,
};
use crate::{
    Measurement, Refused,
    reference::{PlannedReference, Reference},
};

/// A ROS 2 node that subscribes to odometry and publishes the reference.
pub struct Ros2Wire {
    conversion: Conversion,
    refused: Refused,
    craft: Subscription<Odometry>,
    auvs: Vec<(String, Subscription<Odometry>)>,
    twist: Publisher<TwistStamped>,
    path: Publisher<Path>,
    /// When the plan was made whose path was published last, s of Unix time.
    planned_s: Option<f64>,
    /// Its drop stops the thread.
    _node: Node,
}

/// Messages of one topic that are kept between two polls, and taken by one: 0.3 s of a filter that publishes at 100 Hz.
const QUEUE: usize = 32;

impl fmt::Debug for Ros2Wire {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // The node's own parts show nothing of themselves.
        let mut shown = f.debug_struct("Ros2Wire");
        shown.field("refused", &self.refused).finish_non_exhaustive()
    }
}

impl Ros2Wire {
    /// Starts the node. Other nodes find it within a few seconds.
    pub fn new(settings: Settings) -> Result<Self, Ros2Error> {
        let mut node = started(&settings)?;
        let craft = subscription(&mut node, &settings.topics.craft_odometry)?;
        let auvs = settings.auvs.iter().zip(&settings.topics.auv_odometry);
        let auvs = auvs
            .map(|(auv, topic)| Ok((auv.clone(), subscription(&mut node, topic)?)))
            .collect::<Result<_, Ros2Error>>()?;

        // The caller's control loop must not wait for a slow subscriber: the next reference replaces this one.
        let reference = QosProfile::publisher_default().reliability_reliable(WhenFull::Fail);
        // Subscribers that join later receive the last plan, as they do a map.
        let plan = reference.clone().durability(Durability::TransientLocal);
        let topics = &settings.topics;
        let twist_type = MessageTypeName::new("geometry_msgs", "TwistStamped");
        let twist = node.create_topic(&topic_name(&topics.twist)?, twist_type, &reference)?;
        let path_type = MessageTypeName::new("nav_msgs", "Path");
        let path = node.create_topic(&topic_name(&topics.path)?, path_type, &plan)?;
        let (twist, path) = (
            node.create_publisher(&twist, None)?,
            node.create_publisher(&path, None)?,
        );

        let spinner = node.spinner()?;
        spin(spinner).map_err(Ros2Error::Thread)?;
        Ok(Self {
            conversion: Conversion::new(
                settings.origin,
                (settings.map_frame, settings.base_frame),
                settings.heading_loop,
            )?,
            refused: Refused::default(),
            craft,
            auvs,
            twist,
            path,
            planned_s: None,
            _node: node,
        })
    }

    /// The measurements of all messages since the last poll; `received_s` is the time now, s of Unix time. Never waits.
    /// Of each topic it takes at most the newest 32 messages or so; older ones are lost.
    pub fn poll(&mut self, received_s: f64) -> Vec<Measurement> {
        let refused = &mut self.refused;
        let mut measurements = Vec::new();
        for odometry in taken(&self.craft, refused) {
            measurements.extend(self.conversion.craft(&odometry, received_s, refused));
        }
        for (auv, subscription) in &self.auvs {
            for odometry in taken(subscription, refused) {
                measurements.extend(self.conversion.auv(auv, &odometry, received_s, refused));
            }
        }
        measurements
    }

    /// Publishes `reference` as of `t_s` of Unix time, and `plan` if it is a new one. Never waits.
    pub fn publish(&mut self, reference: &Reference, plan: &PlannedReference, t_s: f64) {
        let refused = &mut self.refused;
        if let Some(twist) = self.conversion.twist(reference, t_s, refused)
            && self.twist.publish(twist).is_err()
        {
            refused.count("reference: not sent");
        }
        if self.planned_s == Some(plan.planned_s) {
            return;
        }
        match self
            .conversion
            .path(plan, refused)
            .map(|path| self.path.publish(path))
        {
            // What was not sent is tried again with the next reference.
            Some(Err(_)) => refused.count("plan: not sent"),
            Some(Ok(())) | None => self.planned_s = Some(plan.planned_s),
        }
    }

    /// What was not understood, or not sent, so far.
    #[must_use]
    pub fn refused(&self) -> &Refused {
        &self.refused
    }
}

fn started(settings: &Settings) -> Result<Node, Ros2Error> {
    let mut participant = DomainParticipantBuilder::new(settings.domain_id);
    if settings.localhost_only {
        participant = participant.with_only_networks([Ipv4Addr::LOCALHOST]);
    }
    let participant = participant.build().map_err(ros2_client::CreateError::from)?;
    let context = Context::from_domain_participant(participant)?;
    let name = NodeName::new(&settings.namespace, &settings.node);
    let name = name.map_err(name_error(&settings.node))?;
    Ok(context.new_node(name, options(settings))?)
}

/// Parameters are read-only: sockets and topics are made from them before the first request.
fn options(settings: &Settings) -> NodeOptions {
    let parameters = settings.parameters();
    let mut options = NodeOptions::new().enable_rosout(false);
    for (name, value) in &parameters {
        options = options.declare_parameter(name, value.clone());
    }
    options.parameter_validator(Box::new(move |name: &str, value: &ParameterValue| {
        let is_so = parameters.iter().any(|(known, is)| *known == name && is == value);
        is_so
            .then_some(())
            .ok_or_else(|| format!("{name} is read when the node starts: start it again"))
    }))
}

/// Serves the parameter services on a thread of its own until the node is dropped.
fn spin(spinner: Spinner) -> io::Result<()> {
    thread::Builder::new().name("ros2".to_owned()).spawn(move || {
        if let Err(error) = block_on(spinner.spin()) {
            tracing::warn!(%error, "parameter services have stopped");
        }
    })?;
    Ok(())
}

/// A best-effort subscription matches reliable publishers as well; a reliable one would not match best-effort publishers.
fn subscription(node: &mut Node, topic: &str) -> Result<Subscription<Odometry>, Ros2Error> {
    let quality = QosProfile::subscription_default().history(History::KeepLast { depth: QUEUE });
    let message = MessageTypeName::new("nav_msgs", "Odometry");
    let topic = node.create_topic(&topic_name(topic)?, message, &quality)?;
    Ok(node.create_subscription(&topic, None)?)
}

fn taken(subscription: &Subscription<Odometry>, refused: &mut Refused) -> Vec<Odometry> {
    let mut taken = Vec::new();
    for _ in 0..QUEUE {
        match subscription.take() {
            Ok(Some((odometry, _))) => taken.push(odometry),
            Ok(None) => break,
            Err(_) => refused.count("odometry: cannot be decoded"),
        }
    }
    taken
}

fn topic_name(topic: &str) -> Result<Name, Ros2Error> {
    Name::parse(topic).map_err(name_error(topic))
}

fn name_error(name: &str) -> impl FnOnce(NameError) -> Ros2Error {
    let name = name.to_owned();
    move |source| Ros2Error::Name { name, source }
}
